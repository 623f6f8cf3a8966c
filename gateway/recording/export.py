"""Recordings in the formats that people's tools read: candump logs, MAVLink logs, findings a line each."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from drivers.logs.candump_writer import candump_lines
from drivers.logs.damage import DamageReport
from drivers.logs.tlog_writer import PacketCutter, tlog_record
from gateway.recording.entries import Entry, Found, Frames, Heard, Spoken
from gateway.recording.reading import read_about, read_entries

CAN, HEARD, ALL, FINDINGS = "can.log", "heard.tlog", "all.tlog", "findings.jsonl"
# what came in is stamped when it came, what went out when it went: written down in that order only roughly
ORDER_S = 1.0


@dataclass(frozen=True, slots=True)
class Run:
    """The files of a run, in their order. `name`: of the folder that they are exported to."""

    name: str
    files: tuple[Path, ...]


@dataclass(slots=True)
class Exported:
    """What has been written of a run.

    Attributes:
        folder: where to.
        counts: frames, packets and findings, by the name of the file; those that there are none of have no file.
        damage: of each of its files.
        outside: bytes from the MAVLink link that are no packets.
    """

    folder: Path
    counts: Counter[str] = field(default_factory=Counter)
    damage: dict[Path, DamageReport] = field(default_factory=dict)
    outside: int = 0

    def lines(self) -> list[str]:
        """For people."""
        said = [f"{self.folder / name}: {count}" for name, count in self.counts.items()]
        if self.outside:
            said.append(f"left out: {self.outside} bytes from the MAVLink link that are no packets")
        lost = [f"{path.name}: {line}" for path, damage in self.damage.items() for line in damage.lines()]
        return [*(said or [f"{self.folder}: nothing was recorded"]), *lost]


_UNKNOWN = 0  # which part of its run a file is, where what it says of itself is damaged


def runs(files: Iterable[Path]) -> list[Run]:
    """These recordings, run by run.

    Raises:
        OSError: one cannot be read.
        ValueError: one is no recording of ours.
    """
    by_run: defaultdict[str, list[tuple[int, Path]]] = defaultdict(list)
    for path in files:
        run, part = _identity(path)
        if part == _UNKNOWN or part not in {known for known, _ in by_run[run]}:  # a copy is not exported again
            by_run[run].append((part, path))
    several = {run: tuple(path for _, path in sorted(parts)) for run, parts in by_run.items()}
    names = Counter(map(_name, several.values()))
    return [
        Run(_name(paths) if names[_name(paths)] == 1 else f"{_name(paths)}_{run[:8]}", paths)
        for run, paths in several.items()
    ]


def export(run: Run, folder: Path) -> Exported:
    """Writes a run's files into a folder of its name.

    Args:
        run: to be exported.
        folder: where that folder is to lie; what is in it of an earlier export is replaced.

    Raises:
        OSError: something cannot be read or written.
        ValueError: a file is no recording of ours.
    """
    exported = Exported(folder / run.name)
    exported.folder.mkdir(parents=True, exist_ok=True)
    for name in (CAN, HEARD, ALL, FINDINGS):
        (exported.folder / name).unlink(missing_ok=True)
    with _Outputs(exported) as outputs:
        for path in run.files:
            damage = exported.damage[path] = DamageReport()
            for entries in read_entries(path, damage):
                outputs.take(entries)
        outputs.end()
    return exported


class _Outputs(ExitStack):
    """The files of an export; each is made when the first is written to it."""

    def __init__(self, exported: Exported) -> None:
        super().__init__()
        self._exported = exported
        self._files: dict[str, BinaryIO] = {}
        self._cutter = PacketCutter()
        self._records: list[tuple[float, bytes, bool]] = []
        self._heard_s = 0.0

    def take(self, entries: Sequence[Entry]) -> None:
        """What a chunk holds."""
        for entry in entries:
            match entry:
                case Frames(bus, block):
                    self._write(CAN, [line.encode() for line in candump_lines(bus, block)])
                case Heard(_, time_s, data):
                    self._heard_s = time_s
                    self._keep(time_s, self._cutter.cut(data), heard=True)
                case Spoken(_, time_s, data):
                    self._keep(time_s, [data], heard=False)
                case Found(_, finding):
                    self._write(FINDINGS, [f"{finding.json_line()}\n".encode()])
        self._write_packets(max((time_s for time_s, *_ in self._records), default=0.0) - ORDER_S)

    def end(self) -> None:
        """Nothing comes any more."""
        self._keep(self._heard_s, self._cutter.rest(), heard=True)
        self._write_packets(float("inf"))
        self._exported.outside = self._cutter.outside

    def _keep(self, time_s: float, packets: Iterable[bytes], heard: bool) -> None:
        self._records += [(time_s, tlog_record(time_s, one), heard) for one in packets]

    def _write_packets(self, until_s: float) -> None:
        self._records.sort(key=lambda one: one[0])
        done = [one for one in self._records if one[0] <= until_s]
        self._records = self._records[len(done) :]
        self._write(ALL, [record for _, record, _ in done])
        self._write(HEARD, [record for _, record, heard in done if heard])

    def _write(self, name: str, records: Sequence[bytes]) -> None:
        if not records:
            return
        if name not in self._files:
            self._files[name] = self.enter_context((self._exported.folder / name).open("wb"))
        self._files[name].writelines(records)
        self._exported.counts[name] += len(records)


def _name(files: Sequence[Path]) -> str:
    """Of a run, by its first file: without the number of that."""
    return files[0].stem.rpartition("_")[0] or files[0].stem


def _identity(path: Path) -> tuple[str, int]:
    """By which files of one run belong together, and are in order."""
    try:
        about = read_about(path)
    except ValueError:
        read_entries(path, DamageReport())  # raises where it is no recording at all
        return path.stem, _UNKNOWN
    return about.run, about.part

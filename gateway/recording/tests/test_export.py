"""Recordings as candump logs, tlogs and findings, as others and we ourselves read them."""

from pathlib import Path

import pytest
from can.io import CanutilsLogReader
from pymavlink import mavutil

from drivers.logs.candump import read_candump
from drivers.logs.damage import DamageReport
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.messages import StatusText
from gateway.config_sections import Recording
from gateway.findings import Finding
from gateway.recording.entries import Frames
from gateway.recording.export import ALL, CAN, FINDINGS, HEARD, export, runs
from gateway.recording.scribe import Scribe
from gateway.recording.tests.dive import FINDINGS as FOUND
from gateway.recording.tests.dive import START_S, about, dive
from gateway.recording.waiting import Waiting

AUTOPILOT, OURS = MavlinkEncoder(1, 25), MavlinkEncoder(1, 192)


def record(folder: Path, *parts: Waiting, **changes: object) -> list[Path]:
    """A run of some files."""
    paths = []
    for number, journal in enumerate(parts, 1):
        scribe = Scribe(Recording(folder=folder, keep_free_mb=0.0), about(part=number, **changes), lambda: START_S)
        while batch := journal.take(1 << 20):
            scribe.write(batch.items)
        scribe.close()
        paths.append(scribe.path)
    return paths


def talk(journal: Waiting, begin_s: float, words: str) -> None:
    """Packets from the autopilot, cut like a serial line's; what we say is written down before what came earlier."""
    heard = b"".join(AUTOPILOT.encode(StatusText(6, f"{words} {number}"), begin_s) for number in range(10))
    for number, start in enumerate(range(0, len(heard), 17)):
        journal.heard(heard[start : start + 17], begin_s + 0.01 * number)
        if number == 5:
            journal.said(OURS.encode(StatusText(2, "T1 entangled?"), begin_s), begin_s + 0.065)


def texts(path: Path) -> list[tuple[str, float]]:
    reader = mavutil.mavlink_connection(str(path))
    try:
        return [(one.text, one._timestamp) for one in iter(lambda: reader.recv_match(type="STATUSTEXT"), None)]
    finally:
        reader.close()


@pytest.fixture
def journal() -> Waiting:
    return Waiting(lambda: START_S)


def test_frames(tmp_path: Path, journal: Waiting):
    recorded = dive(journal, seconds=2)
    (run,) = runs(record(tmp_path, journal))
    exported = export(run, tmp_path / "out")
    log = tmp_path / "out" / "bluerov2-heavy_20261122_183923" / CAN
    assert exported.counts[CAN] == 2 * 91
    wanted = [one for one in recorded.entries if isinstance(one, Frames)]
    for bus in ("can0", "can1"):
        ours = [one for name, block in read_candump(log, DamageReport()) if name == bus for one in block.frames()]
        frames = [frame for one in wanted if one.bus == bus for frame in one.frames.frames()]
        assert [(one.identifier, one.data, one.fd) for one in ours] == [
            (one.identifier, one.data, one.fd) for one in frames
        ]
    with CanutilsLogReader(log) as reader:
        assert sum(1 for _ in reader) == 2 * 91


def test_packets(tmp_path: Path, journal: Waiting):
    talk(journal, START_S, "depth")
    (run,) = runs(record(tmp_path, journal))
    exported = export(run, tmp_path / "out")
    heard, both = texts(exported.folder / HEARD), texts(exported.folder / ALL)
    assert [text for text, _ in heard] == [f"depth {number}" for number in range(10)]
    assert sorted(both) == sorted([*heard, *(one for one in both if one[0] == "T1 entangled?")])
    assert len(both) == 11
    assert [time_s for _, time_s in both] == sorted(time_s for _, time_s in both)
    assert exported.outside == 0


def test_findings(tmp_path: Path, journal: Waiting):
    dive(journal)
    (run,) = runs(record(tmp_path, journal))
    lines = (export(run, tmp_path / "out").folder / FINDINGS).read_text().splitlines()
    assert [Finding.of_json_line(line).text for line in lines] == [one.text for one in FOUND]
    assert lines == [one.json_line() for one in FOUND]


def test_the_files_of_a_run_belong_together(tmp_path: Path, journal: Waiting):
    talk(journal, START_S, "first")
    second, other = Waiting(lambda: START_S), Waiting(lambda: START_S)
    talk(second, START_S + 10.0, "second")
    talk(other, START_S, "other")
    files = record(tmp_path, journal, second, run="a") + record(tmp_path / "x", other, run="b")
    several = runs(reversed(files))
    assert {len(run.files) for run in several} == {1, 2}
    assert len({run.name for run in several}) == 2
    found = [
        text
        for text, _ in texts(export(max(several, key=lambda run: len(run.files)), tmp_path / "out").folder / HEARD)
    ]
    assert found == [f"{word} {number}" for word in ("first", "second") for number in range(10)]


def test_an_export_takes_the_place_of_an_earlier_one(tmp_path: Path, journal: Waiting):
    talk(journal, START_S, "depth")
    (run,) = runs(record(tmp_path, journal))
    stale = tmp_path / "out" / run.name / CAN
    stale.parent.mkdir(parents=True)
    stale.write_text("of an earlier one")
    export(run, tmp_path / "out")
    assert not stale.exists()
    assert texts(stale.with_name(HEARD))


def test_a_file_that_is_named_twice_is_exported_once(tmp_path: Path, journal: Waiting):
    dive(journal, seconds=1)
    (path,) = record(tmp_path / "recordings", journal)
    (run,) = runs([path, tmp_path / "recordings" / ".." / "recordings" / path.name])
    assert run.files == (path,)

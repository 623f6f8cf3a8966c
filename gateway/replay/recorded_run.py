"""A run of the gateway as it recorded itself: the pipeline gets the same again, and comes to the same findings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from pathlib import Path

from drivers.logs.damage import DamageReport
from gateway import state
from gateway.config import Config
from gateway.findings import Finding
from gateway.pipeline import Pipeline
from gateway.recording.entries import About, Entry, Found
from gateway.recording.reading import read_entries
from gateway.replay.merging import STRETCH_S
from gateway.replay.recorded_links import RecordedLinks
from gateway.replay.recorded_order import in_stretches
from gateway.replay.reel import share_of
from gateway.replay.result import ReplayResult
from gateway.stretches.stretch import BlockArrival
from gateway.supervisor import Memory

Read = Callable[[Path, DamageReport], Iterator[Sequence[Entry]]]


class RecordedRun:
    """A `Reel`: one run, or so many parts of it as follow each other.

    Args:
        parts: what its files say of themselves, in order.
        config: what is watched; it need not be that of the run.
        read: the entries of a file, chunk by chunk.
    """

    def __init__(self, parts: Sequence[tuple[Path, About]], config: Config, read: Read = read_entries) -> None:
        self._config, self._read, self._about = config, read, parts[0][1]
        self._damage = {path: DamageReport() for path, _ in parts}
        self._links = RecordedLinks(config, self._about.started_s)
        self._found: list[Finding] = []
        self._foreign = ""

    def begin(self, pipeline: Pipeline) -> None:
        """Gives it what an earlier run had learnt, as far as that has a meaning with this configuration."""
        if not self._about.state:
            self._foreign = "what was learnt before is not in it: all is learnt anew" if self._about.resumed else ""
            return
        try:
            known = state.unpack(self._about.state)
        except state.StateError as error:
            self._foreign = f"what was learnt before: {error}: all is learnt anew"
            return
        others = pipeline.recall(known.learnt)
        if others:
            self._foreign = f"what was learnt before is of others, and learnt anew: {', '.join(others)}"
        if self._about.resumed and isinstance(known.passing, Memory):
            pipeline.resume(known.passing)

    def __iter__(self) -> Iterator[list[BlockArrival]]:
        """See `Reel`."""
        chunks = chain.from_iterable(self._read(path, damage) for path, damage in self._damage.items())
        for entries in in_stretches(chunks, STRETCH_S):
            for entry in entries:
                if isinstance(entry, Found):
                    self._found.append(entry.finding)
                else:
                    self._links.take(entry)
            arrivals = self._links.arrivals()
            if arrivals:
                yield arrivals

    def share(self) -> float:
        """See `Reel`."""
        return share_of(self._damage)

    def account(self, result: ReplayResult, found: Sequence[Finding] | None) -> None:
        """See `Reel`."""
        result.add_drops(self._links.drops())
        result.unused += self._links.unused
        remarks = [one for one in (self._other, self._links.remark, self._foreign, self._as_live(found)) if one]
        for path, damage in self._damage.items():
            result.add_log(path, damage, remarks)
            remarks = []  # of the run, and said once

    @property
    def _other(self) -> str:
        """Whether it is of another vehicle."""
        recorded, judged = self._about.vehicle, self._config.vehicle.name
        return "" if recorded == judged else f"recorded on {recorded}, judged as {judged}"

    def _as_live(self, found: Sequence[Finding] | None) -> str:
        """Whether the run itself found the same."""
        if found is None:
            return ""
        ours, live = [one.json_line() for one in found], [one.json_line() for one in self._found]
        if ours == live:
            return f"the {len(live)} findings are those of the run itself" if live else ""
        why = "" if self._config.text == self._about.config else ", by another configuration"
        why += f", and what came before part {self._about.part} is not there" if self._about.part > 1 else ""
        why += ", and something of it is lost" if any(one.lost for one in self._damage.values()) else ""
        return f"{len(ours)} findings, where the run itself had {len(live)}{why}"

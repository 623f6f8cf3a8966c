"""What a replay came to, in lines for whoever asked for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from detectors.verdict import Level
from drivers.logs.damage import DamageReport
from gateway.pipeline import Pipeline
from gateway.replay.set_back import SetBack
from gateway.stretches.stretch import BlockArrival
from gateway.summary import listed, worst_first
from gateway.timeline import STILL_S

# before it, a clock was never set, or counts from some start of its own
UNIX_SINCE_S = datetime(1990, 1, 1, tzinfo=UTC).timestamp()


@dataclass(slots=True)
class ReplayResult:
    """What a replay came to.

    Attributes:
        begin_s, end_s: times of the first and the last reading; None: there was none.
        told_from_s: when that begins of which findings are told; None: never.
        levels_before: of every subject then.
        duration_s: of the dive, without the pauses of the recording.
        findings: their number, by level.
        levels: last level of every subject.
        remarks: what is worth saying beside.
        judged: whether there was a sample of anything; unjudged: subjects of which there was never one.
        drops: what was thrown away, by link or stage, by cause.
        logs: of each by its name, in lines: what was read, by which clock, and what could not be read.
        unused: frames of interfaces that no link is for.
    """

    begin_s: float | None = None
    end_s: float | None = None
    told_from_s: float | None = None
    levels_before: dict[str, Level] = field(default_factory=dict)
    duration_s: float = 0.0
    findings: Counter[str] = field(default_factory=Counter)
    levels: dict[str, Level] = field(default_factory=dict)
    remarks: dict[str, str] = field(default_factory=dict)
    judged: bool = False
    unjudged: list[str] = field(default_factory=list)
    drops: dict[str, Counter[str]] = field(default_factory=dict)
    logs: dict[str, list[str]] = field(default_factory=dict)
    unused: Counter[str] = field(default_factory=Counter)

    @property
    def faulty(self) -> bool:
        """Whether something was found, or was so before."""
        return bool(self.findings[Level.FAULT.name]) or Level.FAULT in self.levels_before.values()

    def add_drops(self, drops: Mapping[str, Counter[str]]) -> None:
        """Adds what was thrown away, by link and cause."""
        for place, causes in drops.items():
            self.drops[place] = self.drops.get(place, Counter()) + causes

    def add_log(self, path: Path, damage: DamageReport, remarks: Sequence[str]) -> None:
        """Adds a log: how much was read of it, what is to be said of it, and what was lost."""
        lost = [f"lost, {line}" for line in damage.lines()]
        self.logs[str(path)] = [f"{damage.records} records", *remarks, *lost]

    def tell_from(self, arrivals: Sequence[BlockArrival], levels: Mapping[str, Level]) -> None:
        """What is found from here on is told; the first time counts."""
        if self.told_from_s is None:
            self.told_from_s = min(float(one.readings.times()[1].min()) for one in arrivals)
            self.levels_before = dict(levels)

    def cover(self, arrivals: Sequence[BlockArrival]) -> None:
        """Takes the times of a stretch that was judged."""
        several_s = [arrival.readings.times()[1] for arrival in arrivals]
        first_s, last_s = min(float(one.min()) for one in several_s), max(float(one.max()) for one in several_s)
        if self.begin_s is None or self.end_s is None:
            self.begin_s = self.end_s = first_s
        if last_s > self.end_s:
            pause_s = first_s - self.end_s
            self.duration_s += last_s - (first_s if pause_s > STILL_S else self.end_s)
            self.end_s = last_s

    def end_reel(self, pipeline: Pipeline) -> None:
        """Takes what a pipeline came to: levels and remarks are the last one's; what any has judged was judged."""
        never = [subject for subject, newest in pipeline.newest.items() if newest is None]
        self.unjudged = [one for one in never if one in self.unjudged or not self.judged]
        self.judged = self.judged or len(never) < len(pipeline.newest)
        self.levels, self.remarks = pipeline.levels(), pipeline.remarks()
        self.add_drops({"pipeline": pipeline.drops()})

    def lines(self) -> list[str]:
        """For people."""
        begin = "" if self.begin_s is None else f", from {instant(self.begin_s)} on"
        return [
            f"replayed {self.duration_s:.1f} s of the dive{begin}",
            *self._told(),
            *(f"{name}: {line}" for name, lines in self.logs.items() for line in lines),
            *(
                f"{interface}: {count} frames that no link is for; where they are of one, name it: LINK=LOG"
                for interface, count in self.unused.items()
            ),
            *(f"dropped at {place}: {listed(causes)}" for place, causes in self.drops.items() if causes),
            f"findings: {listed(self.findings)}",
            f"levels: {worst_first(self.levels, self.unjudged)}",
            *(f"{subject}: {remark}" for subject, remark in self.remarks.items()),
            *([f"never judged: {', '.join(self.unjudged)}"] if self.unjudged else []),
        ]

    def _told(self) -> list[str]:
        """Where not all is told."""
        if self.told_from_s is None or self.told_from_s == self.begin_s:
            return []
        return [f"told from {instant(self.told_from_s)} on; levels then: {worst_first(self.levels_before)}"]


def instant(time_s: float) -> str:
    """A time of a log: a date where it is one."""
    if time_s < UNIX_SINCE_S:
        return f"{time_s:.1f} s by the log"
    return f"{datetime.fromtimestamp(time_s, UTC):%Y-%m-%d %H:%M:%S} UTC"


def told(step: SetBack) -> str:
    """Of a clock that was set back, for the user."""
    return f"clock set back by {step.by_s:.1f} s at {instant(step.at_s)}: what follows is told that much later"

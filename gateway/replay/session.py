"""A replay: logs in, findings out, and an account of what was read and what was lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

from threadpoolctl import threadpool_limits

from detectors.verdict import Level
from gateway.config import Config
from gateway.findings import Finding, FindingsFile
from gateway.outlet import NOTES
from gateway.pipeline import Factories, Pipeline
from gateway.replay.clocks import TimedLog
from gateway.replay.detector_processes import detector_processes
from gateway.replay.log_input import LogInput
from gateway.replay.log_readings import LogReadings
from gateway.replay.merging import stretches
from gateway.replay.prefetch import prefetched
from gateway.summary import worst_first


@dataclass(slots=True)
class ReplayResult:
    """What a replay came to.

    Attributes:
        begin_s, end_s: times of the first and the last reading; None: there was none.
        findings: their number, by level.
        levels: last level of every subject.
        remarks: what is worth saying beside; unjudged: subjects of which there was never a sample.
        drops: what was thrown away, by link or stage, by cause.
        logs: of each by its name, in lines: what was read, by which clock, and what could not be read.
        unused: frames of interfaces that no link is for.
    """

    begin_s: float | None = None
    end_s: float | None = None
    findings: Counter[str] = field(default_factory=Counter)
    levels: dict[str, Level] = field(default_factory=dict)
    remarks: dict[str, str] = field(default_factory=dict)
    unjudged: list[str] = field(default_factory=list)
    drops: dict[str, Counter[str]] = field(default_factory=dict)
    logs: dict[str, list[str]] = field(default_factory=dict)
    unused: Counter[str] = field(default_factory=Counter)

    @property
    def duration_s(self) -> float:
        """Of the dive."""
        return 0.0 if self.begin_s is None or self.end_s is None else self.end_s - self.begin_s

    @property
    def faulty(self) -> bool:
        """Whether something was found."""
        return bool(self.findings[Level.FAULT.name])

    def lines(self) -> list[str]:
        """For people."""
        return [
            f"replayed {self.duration_s:.1f} s of the dive",
            *(f"{name}: {line}" for name, lines in self.logs.items() for line in lines),
            *(
                f"{interface}: {count} frames, and no link is for them: name the link, LINK=LOG"
                for interface, count in self.unused.items()
            ),
            *(f"dropped at {place}: {_listed(causes)}" for place, causes in self.drops.items() if causes),
            f"findings: {_listed(self.findings)}",
            f"levels: {worst_first(self.levels)}",
            *(f"{subject}: {remark}" for subject, remark in self.remarks.items()),
            *([f"never judged: {', '.join(self.unjudged)}"] if self.unjudged else []),
        ]


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a replay is: the time of the dive, from its beginning, and what was found since the last time."""

    dive_s: float
    findings: Sequence[Finding]


def grouped(logs: Iterable[LogInput], config: Config) -> list[LogReadings]:
    """Logs of one kind and link follow each other, in the order in which they are named.

    Raises:
        ValueError: the configuration has no link that a log could be of.
    """
    ordered = sorted(logs, key=_group)
    return [LogReadings(list(several), config) for _, several in groupby(ordered, key=_group)]


def _group(log: LogInput) -> tuple[str, str]:
    return log.kind, log.link or ""


def replay(
    config: Config,
    logs: Sequence[TimedLog],
    findings: Path,
    progress: Callable[[Progress], None] = lambda _: None,
    factories: Factories | None = None,
    jobs: int = 1,
) -> ReplayResult:
    """Has the pipeline judge the logs, and writes what it finds.

    Args:
        config: what to watch.
        logs: on one clock, see `gateway.replay.clocks`.
        findings: file for them; one that is there is replaced.
        progress: hears how far it is.
        factories: makes the detectors; None: the real ones.
        jobs: processes for the detectors of thrusters, where the real ones are made; 1: they are in this one.

    Raises:
        OSError: a log cannot be read, or the findings cannot be written.
        ValueError: a log is not what its name says, or two logs are of one link.
    """
    findings.unlink(missing_ok=True)
    result = ReplayResult()
    with (
        threadpool_limits(limits=1, user_api="blas"),
        FindingsFile(findings) as file,
        _factories(factories, min(jobs, len(config.thruster))) as made_by,
    ):
        pipeline = Pipeline(_without_plots(config), made_by)
        for arrivals in prefetched(stretches(logs)):
            found = [one for one in pipeline.take_stretch(arrivals) if isinstance(one, Finding)]
            for finding in found:
                file.append(finding)
            times_s = [time_s for arrival in arrivals for time_s in arrival.readings.times()[1][[0, -1]].tolist()]
            result.begin_s = min(times_s) if result.begin_s is None else result.begin_s
            result.end_s = max([*times_s, result.begin_s if result.end_s is None else result.end_s])
            result.findings += Counter(one.level.name for one in found if one.detector not in NOTES)
            progress(Progress(result.duration_s, found))
        _account(result, pipeline, logs)
    return result


@contextmanager
def _factories(given: Factories | None, jobs: int) -> Iterator[Factories]:
    if given is not None or jobs <= 1:
        yield given or Factories()
        return
    with detector_processes(jobs) as make:
        yield Factories(thruster=make)


def _without_plots(config: Config) -> Config:
    """There is no ground station to plot anything."""
    if config.mavlink is None:
        return config
    return replace(config, mavlink=config.mavlink.model_copy(update={"named_values_period_s": 0.0}))


def _account(result: ReplayResult, pipeline: Pipeline, logs: Iterable[TimedLog]) -> None:
    result.levels, result.remarks = pipeline.levels(), pipeline.remarks()
    result.unjudged = [subject for subject, newest in pipeline.newest.items() if newest is None]
    for one in logs:
        result.drops |= one.readings.drops()
        result.unused += one.readings.unused
        for path, damage in one.readings.damage.items():
            told = [f"clock {one.remark}"] if one.remark else []
            lost = [f"lost, {line}" for line in damage.lines()]
            result.logs[path.name] = [f"{damage.records} records", *told, *lost]
    result.drops["pipeline"] = pipeline.drops()


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(counts.items())) or "none"

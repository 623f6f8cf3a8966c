"""A replay: logs in, findings out, and an account of what was read and what was lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from gateway.config import Config
from gateway.findings import Finding, FindingsFile
from gateway.outlet import NOTES
from gateway.pipeline import Factories, Pipeline
from gateway.replay.clocks import TimedLog
from gateway.replay.detector_processes import detector_processes
from gateway.replay.merging import stretches
from gateway.replay.onlooker import Nobody, Onlooker
from gateway.replay.prefetch import prefetched
from gateway.replay.result import ReplayResult, told


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a replay is.

    Attributes:
        begin_s: of the dive.
        dive_s: from there.
        findings: what was found since the last time.
    """

    begin_s: float
    dive_s: float
    findings: Sequence[Finding]


def replay(
    config: Config,
    logs: Sequence[TimedLog],
    findings: Path,
    progress: Callable[[Progress], None] = lambda _: None,
    factories: Factories | None = None,
    jobs: int = 1,
    onlooker: Onlooker | None = None,
) -> ReplayResult:
    """Has the pipeline judge the logs, and writes what it finds.

    Args:
        config: what to watch.
        logs: on one clock, see `gateway.replay.clocks`.
        findings: file for them; one that is there is replaced.
        progress: hears how far it is.
        factories: makes the detectors; None: the real ones.
        jobs: processes for the detectors of thrusters, where the real ones are made; 1: they are in this one.
        onlooker: is told everything; None: nobody is.

    Raises:
        OSError: a log cannot be read, or the findings cannot be written.
        ValueError: a log is not what its name says, or two logs are of one link.
    """
    findings.unlink(missing_ok=True)
    result, onlooker = ReplayResult(), onlooker or Nobody()
    with (
        threadpool_limits(limits=1, user_api="blas"),
        FindingsFile(findings) as file,
        _factories(factories, min(jobs, len(config.thruster))) as made_by,
    ):
        pipeline = Pipeline(_without_plots(config), made_by)
        for arrivals in prefetched(stretches(logs)):
            onlooker.stretch(arrivals)
            outcomes = pipeline.take_stretch(arrivals, onlooker.seen)
            found = [one for one in outcomes if isinstance(one, Finding)]
            for finding in found:
                file.append(finding)
            result.cover(arrivals)
            result.findings += Counter(one.level.name for one in found if one.detector not in NOTES)
            progress(Progress(result.begin_s or 0.0, result.duration_s, found))
        _account(result, pipeline, logs)
        onlooker.end(pipeline)
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
    result.judged = len(result.unjudged) < len(pipeline.newest)
    for one in logs:
        result.drops |= one.readings.drops()
        result.unused += one.readings.unused
        for path, damage in one.readings.damage.items():
            clock = [f"clock {one.remark}"] if one.remark else []
            set_back = [told(step) for step in one.readings.set_back.get(path, ())]
            lost = [f"lost, {line}" for line in damage.lines()]
            result.logs[str(path)] = [f"{damage.records} records", *clock, *set_back, *lost]
    result.drops["pipeline"] = pipeline.drops()

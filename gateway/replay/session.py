"""A replay: logs in, findings out, and an account of what was read and what was lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from gateway.config import Config
from gateway.findings import Finding, FindingsFile
from gateway.outlet import NOTES
from gateway.pipeline import Factories, Pipeline
from gateway.replay.detector_processes import detector_processes
from gateway.replay.onlooker import Nobody, Onlooker
from gateway.replay.prefetch import prefetched
from gateway.replay.reel import Reel
from gateway.replay.result import ReplayResult
from gateway.stretches.stretch import BlockArrival


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
    reels: Sequence[Reel],
    findings: Path,
    progress: Callable[[Progress], None] = lambda _: None,
    factories: Factories | None = None,
    jobs: int = 1,
    onlooker: Onlooker | None = None,
) -> ReplayResult:
    """Has a pipeline judge each reel, and writes what it finds.

    Args:
        config: what to watch.
        reels: one after the other, see `gateway.replay.reels`.
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
    with (
        threadpool_limits(limits=1, user_api="blas"),
        FindingsFile(findings) as file,
        _factories(factories, min(jobs, len(config.thruster))) as made_by,
    ):
        session = _Session(file, progress, onlooker or Nobody())
        for reel in reels:
            session.judge(reel, Pipeline(_without_plots(config), made_by))
    return session.result


class _Session:
    """Reel by reel."""

    def __init__(self, file: FindingsFile, progress: Callable[[Progress], None], onlooker: Onlooker) -> None:
        self._file, self._progress, self._onlooker = file, progress, onlooker
        self.result = ReplayResult()

    def judge(self, reel: Reel, pipeline: Pipeline) -> None:
        """Takes the next one."""
        reel.begin(pipeline)
        found: list[Finding] = []
        for arrivals in prefetched(reel):
            self._onlooker.stretch(arrivals)
            outcomes = pipeline.take_stretch(arrivals, self._onlooker.seen)
            newest = [one for one in outcomes if isinstance(one, Finding)]
            found += newest
            self._keep(arrivals, newest)
        self.result.end_reel(pipeline)
        reel.account(self.result, found)
        self._onlooker.end(pipeline)

    def _keep(self, arrivals: Sequence[BlockArrival], found: Sequence[Finding]) -> None:
        for finding in found:
            self._file.append(finding)
        self.result.cover(arrivals)
        self.result.findings += Counter(one.level.name for one in found if one.detector not in NOTES)
        self._progress(Progress(self.result.begin_s or 0.0, self.result.duration_s, found))


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

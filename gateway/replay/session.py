"""A replay: logs in, findings out, and an account of what was read and what was lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

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
from gateway.replay.window import Span, Window
from gateway.stretches.stretch import BlockArrival

DETECTORS = frozenset({"thruster", "speed", "navigation"})


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a replay is.

    Attributes:
        begin_s: of the dive.
        dive_s: from there.
        share: of the logs' bytes, that was read.
        findings: what was found since the last time.
    """

    begin_s: float
    dive_s: float
    share: float
    findings: Sequence[Finding]


@dataclass(frozen=True, slots=True)
class Terms:
    """How a replay is to be made.

    Attributes:
        window: what of it is told; all before it is only learnt from.
        detectors: names of those that judge, of `DETECTORS`.
        phase: of the grid of the thrusters' samples, see `gateway.align`.

    Raises:
        ValueError: no such detector.
    """

    window: Window = field(default_factory=Window)
    detectors: frozenset[str] = DETECTORS
    phase: float = 0.0

    @property
    def whole(self) -> bool:
        """Whether they are those of a run."""
        return self == Terms()

    def __post_init__(self) -> None:
        if not self.detectors or not self.detectors <= DETECTORS:
            raise ValueError(f"detectors = {sorted(self.detectors)}: want some of {', '.join(sorted(DETECTORS))}")


def replay(
    config: Config,
    reels: Sequence[Reel],
    findings: Path,
    progress: Callable[[Progress], None] = lambda _: None,
    factories: Factories | None = None,
    jobs: int = 1,
    onlooker: Onlooker | None = None,
    terms: Terms | None = None,
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
        terms: how it is to be made; None: all of it, by all detectors.

    Raises:
        OSError: a log cannot be read, or the findings cannot be written.
        ValueError: a log is not what its name says, or two logs are of one link.
    """
    findings.unlink(missing_ok=True)
    terms = terms or Terms()
    with (
        threadpool_limits(limits=1, user_api="blas"),
        FindingsFile(findings) as file,
        _factories(factories, terms.detectors, min(jobs, len(config.thruster))) as made_by,
    ):
        session = _Session(file, progress, onlooker or Nobody(), terms)
        for reel in reels:
            session.judge(reel, Pipeline(_without_plots(config), made_by, phase=terms.phase))
    return session.result


class _Session:
    """Reel by reel."""

    def __init__(
        self, file: FindingsFile, progress: Callable[[Progress], None], onlooker: Onlooker, terms: Terms
    ) -> None:
        self._file, self._progress, self._onlooker, self._terms = file, progress, onlooker, terms
        self._begin_s: float | None = None
        self.result = ReplayResult()

    def judge(self, reel: Reel, pipeline: Pipeline) -> None:
        """Takes the next one."""
        reel.begin(pipeline)
        found: list[Finding] = []
        with closing(prefetched(reel)) as several:
            for arrivals in several:
                before, inside, after = self._span(arrivals).parts(arrivals)
                if before:
                    pipeline.take_stretch(before)
                    self._told(reel, before, [])
                if inside:
                    found += self._judged(reel, inside, pipeline)
                if after:
                    break
        self.result.end_reel(pipeline)
        reel.account(self.result, found if self._terms.whole else None)
        self._onlooker.end(pipeline)

    def _span(self, arrivals: Sequence[BlockArrival]) -> Span:
        if self._begin_s is None:
            self._begin_s = min(float(one.readings.times()[1].min()) for one in arrivals)
        return self._terms.window.of(self._begin_s)

    def _judged(self, reel: Reel, arrivals: Sequence[BlockArrival], pipeline: Pipeline) -> list[Finding]:
        self.result.tell_from(arrivals, pipeline.levels())
        self._onlooker.stretch(arrivals)
        outcomes = pipeline.take_stretch(arrivals, self._onlooker.seen)
        found = [one for one in outcomes if isinstance(one, Finding)]
        for finding in found:
            self._file.append(finding)
        self.result.findings += Counter(one.level.name for one in found if one.detector not in NOTES)
        self._told(reel, arrivals, found)
        return found

    def _told(self, reel: Reel, arrivals: Sequence[BlockArrival], found: Sequence[Finding]) -> None:
        self.result.cover(arrivals)
        self._progress(Progress(self.result.begin_s or 0.0, self.result.duration_s, reel.share(), found))


@contextmanager
def _factories(given: Factories | None, detectors: frozenset[str], jobs: int) -> Iterator[Factories]:
    unwatched: dict[str, Any] = dict.fromkeys(DETECTORS - detectors)
    if given is not None or jobs <= 1 or "thruster" in unwatched:
        yield replace(given or Factories(), **unwatched)
        return
    with detector_processes(jobs) as make:
        yield replace(Factories(thruster=make), **unwatched)


def _without_plots(config: Config) -> Config:
    """There is no ground station to plot anything."""
    if config.mavlink is None:
        return config
    return replace(config, mavlink=config.mavlink.model_copy(update={"named_values_period_s": 0.0}))

"""Logs to dives: through the pipeline of the running gateway, keeping what its detectors were given.

Logs in one folder are of one dive, or of dives one after the other; logs in different folders are different dives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

from detectors.navigation import NavigationSample
from detectors.thruster import ThrusterConfig
from detectors.thruster.wear import CommissionedCurve
from gateway.channel import NavigationJudgement, SpeedJudgement
from gateway.commissioning.dive import RecordedDive, ThrusterSamples
from gateway.commissioning.keeping import KeepingDetector
from gateway.config import Config
from gateway.findings import Finding
from gateway.outlet import NOTES
from gateway.pipeline import Factories, Outcome, Pipeline
from gateway.replay.clocks import on_one_clock
from gateway.replay.grouping import grouped
from gateway.replay.log_input import LogInput
from gateway.replay.merging import stretches
from gateway.replay.prefetch import prefetched
from gateway.replay.result import ReplayResult


def by_dive(logs: Iterable[LogInput]) -> dict[Path, list[LogInput]]:
    """The logs of each folder, in the order in which they were named."""
    dives: dict[Path, list[LogInput]] = {}
    for log in logs:
        dives.setdefault(log.path.resolve().parent, []).append(log)
    return dives


def read_dive(
    config: Config,
    logs: Sequence[LogInput],
    name: str,
    progress: Callable[[float], None] = lambda _: None,
) -> RecordedDive:
    """What the logs of one dive hold for the detectors.

    Args:
        config: where everything is read, and with which settings it is judged.
        logs: of one dive.
        name: of it.
        progress: hears how many seconds of it were read.

    Raises:
        OSError: a log cannot be read.
        ValueError: a log is not what its name says, or the logs do not go together.
    """
    made: list[KeepingDetector] = []

    def make(settings: ThrusterConfig, commissioned: CommissionedCurve | None) -> KeepingDetector:
        made.append(KeepingDetector(settings, commissioned))
        return made[-1]

    course, kept = ReplayResult(), _Kept()
    pipeline = Pipeline(config, Factories(thruster=make))
    with threadpool_limits(limits=1, user_api="blas"):
        for arrivals in prefetched(stretches(on_one_clock(grouped(logs, config), config, {}))):
            kept.take(pipeline.take_stretch(arrivals))
            course.cover(arrivals)
            progress(course.duration_s)
    return RecordedDive(
        name=name,
        begin_s=course.begin_s or 0.0,
        duration_s=course.duration_s,
        thrusters=dict(_thrusters(config, pipeline, made)),
        poses=kept.poses,
        motion=kept.motion,
        findings=kept.findings,
    )


class _Kept:
    """What is kept of the outcomes."""

    def __init__(self) -> None:
        self.poses: list[SpeedJudgement] = []
        self.motion: list[NavigationSample] = []
        self.findings: list[Finding] = []

    def take(self, outcomes: Iterable[Outcome]) -> None:
        for one in outcomes:
            match one:
                case SpeedJudgement():
                    self.poses.append(one)
                case NavigationJudgement():
                    self.motion.append(one.sample)
                case Finding() if one.detector not in NOTES:
                    self.findings.append(one)


def _thrusters(
    config: Config, pipeline: Pipeline, made: Sequence[KeepingDetector]
) -> Iterator[tuple[int, ThrusterSamples]]:
    """The pipeline makes the detectors in the order of the configuration."""
    learnt = pipeline.learnt()
    for thruster, detector in zip(config.thruster, made, strict=True):
        rate_hz, kept = learnt[f"thruster {thruster.number}"].alignment, detector.kept()
        if rate_hz is not None and kept.shape[1]:
            yield thruster.number, ThrusterSamples(rate_hz, *kept)

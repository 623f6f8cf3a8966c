"""What a replay's detectors were given, kept for whoever learns from it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import NavigationSample
from detectors.thruster import ThrusterSample
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.commissioning.dive import RecordedDive, ThrusterSamples
from gateway.findings import Finding
from gateway.outlet import NOTES
from gateway.pipeline import Pipeline
from gateway.replay.result import ReplayResult
from gateway.stretches.stretch import BlockArrival
from gateway.thruster_channel import JudgedColumns

FloatArray: TypeAlias = NDArray[np.float64]


class Keeping:
    """An `Onlooker` of a replay: each of its reels becomes a dive.

    Args:
        name: of the dive; where there are several, they are numbered.

    Attributes:
        dives: those that are complete.
    """

    def __init__(self, name: str) -> None:
        self.dives: list[RecordedDive] = []
        self._name = name
        self._begin()

    def stretch(self, arrivals: Sequence[BlockArrival]) -> None:
        """See `Onlooker`."""
        self._course.cover(arrivals)

    def seen(self, shown: JudgedColumns | Judgement) -> None:
        """See `Onlooker`."""
        match shown:
            case JudgedColumns():
                one = shown.samples
                columns = (one.time_s, one.command, one.speed_rpm, one.voltage_v, one.current_a)
                self._thrusters[shown.thruster].append(np.stack(columns))
            case ThrusterJudgement():
                self._thrusters[shown.thruster].append(_column(shown.sample))
            case SpeedJudgement():
                self._poses.append(shown)
            case NavigationJudgement():
                self._motion.append(shown.sample)

    def found(self, findings: Sequence[Finding]) -> None:
        """What was found since the last time."""
        self._findings += (one for one in findings if one.detector not in NOTES)

    def end(self, pipeline: Pipeline) -> None:
        """See `Onlooker`."""
        number = len(self.dives) + 1
        self.dives.append(
            RecordedDive(
                name=self._name if number == 1 else f"{self._name}, run {number}",
                begin_s=self._course.begin_s or 0.0,
                duration_s=self._course.duration_s,
                thrusters=dict(self._samples(pipeline)),
                poses=self._poses,
                motion=self._motion,
                findings=self._findings,
            )
        )
        self._begin()

    def _begin(self) -> None:
        self._course = ReplayResult()
        self._thrusters: defaultdict[int, list[FloatArray]] = defaultdict(list)
        self._poses: list[SpeedJudgement] = []
        self._motion: list[NavigationSample] = []
        self._findings: list[Finding] = []

    def _samples(self, pipeline: Pipeline) -> Iterator[tuple[int, ThrusterSamples]]:
        learnt = pipeline.learnt()
        for number, blocks in self._thrusters.items():
            kept = np.concatenate(blocks, axis=1)
            if kept.shape[1]:
                yield number, ThrusterSamples(learnt[f"thruster {number}"].alignment, *kept)


def _column(sample: ThrusterSample) -> FloatArray:
    volts, amperes = (np.nan if value is None else value for value in (sample.voltage_v, sample.current_a))
    return np.array([[sample.time_s], [sample.command], [sample.speed_rpm], [volts], [amperes]])

"""A stand-in for the thruster detector that changes its mind at known instants, and names each of these changes."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import ArrayLike

from detectors.thruster import ThrusterConfig, ThrusterSample, ThrusterVerdict
from detectors.thruster.detector import ThrusterVerdicts
from detectors.thruster.learnt import LearntCurve
from detectors.thruster.sample import FaultKind
from detectors.thruster.wear import CommissionedCurve
from detectors.verdict import Level
from gateway.thruster_channel import Detector

CHANGE_S = 0.3
SPEED_RPM = 800
WANTED_RPM = 1000  # and one more with each change: the pilot's text says so, `want 1007`


class TimedDetector:
    """Says FAULT and NORMAL in turns, and notes when it did; or always NORMAL.

    Attributes:
        said_ns: unix time of each change, by its number.
        sample_s: time of the sample on which it changed.
    """

    def __init__(self, changing: bool) -> None:
        self._changing = changing
        self._begin_s: float | None = None
        self.said_ns: dict[int, int] = {}
        self.sample_s: dict[int, float] = {}

    @property
    def commissioned(self) -> CommissionedCurve | None:
        """None: it needs no curve."""
        return None

    @property
    def learnt(self) -> LearntCurve | None:
        """None: it learns none."""
        return None

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        """As in `gateway.thruster_channel.Detector`."""
        self._begin_s = sample.time_s if self._begin_s is None else self._begin_s
        number = int((sample.time_s - self._begin_s) / CHANGE_S) if self._changing else 0
        if number not in self.said_ns:
            self.said_ns[number], self.sample_s[number] = time.time_ns(), sample.time_s
        return _verdict(sample.time_s, Level.FAULT if number % 2 else Level.NORMAL, number)

    def run(
        self,
        time_s: ArrayLike,
        command: ArrayLike,
        speed_rpm: ArrayLike,
        voltage_v: ArrayLike | None = None,
        current_a: ArrayLike | None = None,
    ) -> ThrusterVerdicts:
        """As in `gateway.thruster_channel.Detector`."""
        samples = np.stack([np.asarray(time_s), np.asarray(command), np.asarray(speed_rpm)], axis=1).tolist()
        said = [self.update(ThrusterSample(*sample)) for sample in samples]
        return ThrusterVerdicts(
            **{name: np.array([getattr(one, name) for one in said]) for name in ThrusterVerdicts.__slots__}
        )

    def accept(self) -> None:
        """Nothing was learnt."""

    def resume(self) -> None:
        """Nothing was learnt."""


def _verdict(time_s: float, level: Level, number: int) -> ThrusterVerdict:
    predicted_rpm = float(WANTED_RPM + number)
    return ThrusterVerdict(
        time_s=time_s,
        level=level,
        score=1.5 if level is Level.FAULT else 0.5,
        residual_rpm=SPEED_RPM - predicted_rpm,
        predicted_rpm=predicted_rpm,
        threshold_rpm=50.0,
        order=1,
        window=100,
        delay=0,
        lag_s=0.0,
        refitted=False,
        kind=FaultKind.ENTANGLED if level is Level.FAULT else FaultKind.NONE,
    )


class TimedDetectors:
    """Makes one that changes, for the first thruster, and others that do not.

    Attributes:
        made: all of them.
    """

    def __init__(self) -> None:
        self.made: list[TimedDetector] = []

    def make(self, _config: ThrusterConfig, _commissioned: CommissionedCurve | None) -> Detector:
        """As in `gateway.thruster_channel.ThrusterFactory`."""
        self.made.append(TimedDetector(changing=not self.made))
        return self.made[-1]

"""A recorded dive as the detectors got it: samples of each, and what was found in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import NavigationSample
from gateway.channel import SpeedJudgement
from gateway.findings import Finding

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ThrusterSamples:
    """(N,) samples of one thruster in one dive, evenly spaced but for gaps.

    Attributes:
        rate_hz: samples a second.
        time_s, command, speed_rpm: as in `ThrusterSample`.
        voltage_v, current_a: NaN where not measured.
    """

    rate_hz: float
    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    voltage_v: FloatArray
    current_a: FloatArray

    def __len__(self) -> int:
        return len(self.time_s)

    def columns(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """As `ThrusterDetector.run` takes them."""
        return self.time_s, self.command, self.speed_rpm, self.voltage_v, self.current_a


@dataclass(frozen=True, slots=True)
class RecordedDive:
    """One dive.

    Attributes:
        name: what the user calls it: a folder, or its first log.
        begin_s: of its first reading.
        duration_s: without the pauses of the recording.
        thrusters: samples by number of the thruster; one that was never heard, or too shortly, is not in it.
        poses: what the speed watch made of it, one for each pose sample; empty without `[speed]`.
        motion: samples of the navigation sensors, in the order in which the detector gets them; empty without
            `[navigation]`.
        findings: what the gateway found in it with the settings that it had.
    """

    name: str
    begin_s: float
    duration_s: float
    thrusters: Mapping[int, ThrusterSamples]
    poses: Sequence[SpeedJudgement]
    motion: Sequence[NavigationSample]
    findings: Sequence[Finding]

"""A configuration, and a detector whose words a test decides."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from gateway.config import Config, parse

TWO_THRUSTERS = """
[vehicle]
name = "Test vehicle"

[[can]]
name = "can0"
interface = "virtual"
channel = "gateway tests"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:0"

[[thruster]]
number = 1
command = { link = "can0", esc_index = 0 }
rpm = { link = "can0", esc_index = 0 }

[[thruster]]
number = 2
command = { link = "mavlink", servo_channel = 3 }
rpm = { link = "can0", esc_index = 1 }

[align]
sample_rate_hz = 50
"""

FULL_RPM = 3000.0
TOLERANCE_RPM = 150.0
WARMUP = 50


class ThresholdDetector:
    """A stand-in of the contract: it knows the curve, learns for 50 samples, then goes by the residual."""

    def __init__(self, config: object = None, commissioned: object = None) -> None:
        self.commissioned = commissioned
        self.samples = 0
        self.accepted = 0

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        self.samples += 1
        predicted_rpm = FULL_RPM * sample.command
        residual_rpm = sample.speed_rpm - predicted_rpm
        score = abs(residual_rpm) / TOLERANCE_RPM
        level = Level.FAULT if score > 1.0 else Level.SUSPECT if score > 0.5 else Level.NORMAL
        return verdict(
            sample.time_s,
            Level.UNKNOWN if self.samples <= WARMUP or not math.isfinite(score) else level,
            score=score,
            residual_rpm=residual_rpm,
            predicted_rpm=predicted_rpm,
            kind=FaultKind.ENTANGLED if level is Level.FAULT else FaultKind.NONE,
        )

    def run(self, *columns: np.ndarray) -> Rows:
        return Rows(self.update(ThrusterSample(*row)) for row in np.stack(columns, axis=1).tolist())

    def accept(self) -> None:
        self.accepted += 1


class Rows(list):
    """Verdicts of a block."""

    def row(self, index: int) -> ThrusterVerdict:
        return self[index]


def verdict(time_s: float, level: Level, **fields: object) -> ThrusterVerdict:
    """A verdict with what matters to a test; the rest is plausible."""
    plausible = {
        "score": 0.1,
        "residual_rpm": 0.0,
        "predicted_rpm": 1000.0,
        "threshold_rpm": TOLERANCE_RPM,
        "order": 2,
        "window": 300,
        "delay": 2,
        "lag_s": 0.1,
        "refitted": False,
    }
    return ThrusterVerdict(time_s=time_s, level=level, **{**plausible, **fields})


@pytest.fixture
def config(tmp_path: Path) -> Config:
    return parse(TWO_THRUSTERS, tmp_path)

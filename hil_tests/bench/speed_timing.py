"""The speed detector beside a plain filter over the same positions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from filterpy.kalman import KalmanFilter

from detectors.speed import PoseSample, SpeedConfig, SpeedDetector
from hil_tests.bench.speed_detection import samples
from hil_tests.bench.timing import Comparison
from hil_tests.missions import random_mission

SEED = 0
RATE_HZ, NOISE_M = 10.0, 0.1
SPEED_WANDER, FLOW_WANDER = 1e-3, 1e-3  # process noise, m/s a square root of a second, squared
CLOSE = 0.15  # of the speed


def speed_watch() -> Comparison:
    """A healthy mission judged sample by sample; the peer estimates speed and flow, and judges nothing.

    They agree where both know the speed at the end.
    """
    mission = random_mission(SEED, rate_hz=RATE_HZ, noise_m=NOISE_M)
    seen = samples(mission)
    true_mps = float(mission.true_speed_mps[-1])

    def ours() -> float:
        detector = SpeedDetector(
            SpeedConfig(speed_min_mps=mission.speed_min_mps, speed_max_mps=mission.speed_max_mps)
        )
        for sample in seen:
            verdict = detector.update(sample)
        return verdict.speed_mps

    return Comparison(
        work="SpeedDetector.update",
        peer="plain filterpy filter",
        unit="sample",
        count=len(seen),
        ours=ours,
        theirs=lambda: plain_filter(seen),
        agree=lambda one, other: bool(np.allclose([one, other], true_mps, rtol=CLOSE)),
    )


def plain_filter(seen: Sequence[PoseSample]) -> float:
    """Speed through the water at the end, by a Kalman filter over north, east, speed and a constant flow."""
    kalman = KalmanFilter(dim_x=5, dim_z=2)
    kalman.x = np.array([seen[0].north_m, seen[0].east_m, 0.0, 0.0, 0.0])
    kalman.P = np.diag([1.0, 1.0, 4.0, 4.0, 4.0])
    kalman.H = np.eye(2, 5)
    kalman.R = NOISE_M**2 * np.eye(2)
    for before, sample in pairwise(seen):
        interval_s = sample.time_s - before.time_s
        kalman.F = np.eye(5)
        kalman.F[:2, 2] = interval_s * np.cos(before.heading_rad), interval_s * np.sin(before.heading_rad)
        kalman.F[:2, 3:] = interval_s * np.eye(2)
        kalman.Q = interval_s * np.diag([0.0, 0.0, SPEED_WANDER, FLOW_WANDER, FLOW_WANDER])
        kalman.predict()
        kalman.update(np.array([sample.north_m, sample.east_m]))
    return float(kalman.x[2])

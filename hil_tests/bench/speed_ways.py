"""What the speed detector is measured on: random missions, and recordings with a current and a loss put into them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from detectors.speed.config import EstimatorName
from hil_tests.bench.speed_detection import Finding, detector_for, judge
from hil_tests.missions import Drive, Style, carried, random_mission, read_kvlcc2, read_snapir
from hil_tests.missions.water import WaterKind

MISSIONS, FINE = "missions", "10 Hz, 0.1 m"
FINE_RATE_HZ, FINE_NOISE_M = 10.0, 0.1
ONSET = 0.6  # of a recording
RECORDING_NOISE_M = 0.5


@dataclass(frozen=True, slots=True)
class Recorded:
    """A set of recordings and what is done to them.

    Attributes:
        pattern: of the files' names. read: one of them.
        waters, flow_mps: currents that are added.
        loss: that is imposed.
    """

    pattern: str
    read: Callable[[Path], Drive]
    waters: tuple[WaterKind, ...]
    flow_mps: float
    loss: float


# The AUV changes its speed by a factor of two on purpose, and its commands are not recorded: 30 % less is within
# what it makes anyway, half is not.
RECORDED = {
    "kvlcc2": Recorded("kvlcc2/*.dat", read_kvlcc2, ("constant", "tidal"), flow_mps=2.0, loss=0.3),
    "snapir": Recorded("snapir/*.npz", read_snapir, ("constant", "tidal"), flow_mps=0.8, loss=0.5),
}


def judge_mission(estimator: EstimatorName, seed: int, style: Style, loss: float) -> list[Finding]:
    """One estimator on the mission of a seed: healthy, with a loss, and with a loss seen by fine sensors."""
    drawn = [(MISSIONS, random_mission(seed, lost, style)) for lost in (0.0, loss)]
    fine = (FINE, random_mission(seed, loss, style, rate_hz=FINE_RATE_HZ, noise_m=FINE_NOISE_M))
    return [
        judge(
            mission,
            detector_for(estimator, mission),
            estimator=estimator,
            group=group,
            water=str(mission.drawn["water"]),
            seed=seed,
        )
        for group, mission in (*drawn, fine)
    ]


def judge_recording(estimator: EstimatorName, name: str, path: Path, water: WaterKind) -> list[Finding]:
    """One estimator on a recording of `RECORDED`: healthy, and with a loss."""
    recorded = RECORDED[name]
    drive = recorded.read(path)
    onset_s = ONSET * float(drive.time_s[-1])
    ways = [
        carried(drive, water, recorded.flow_mps, noise_m=RECORDING_NOISE_M, seed=0, loss=loss, onset_s=onset_s)
        for loss in (0.0, recorded.loss)
    ]
    group = f"{name}, {water}"
    return [
        judge(way, detector_for(estimator, way), estimator=estimator, group=group, water=water, seed=0)
        for way in ways
    ]

"""What the navigation detector is measured on: dives, and the faults that are put into them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from detectors.navigation import Sensor
from gateway.navigation_data import NavigationData, read_navigation_data
from hil_tests.dives import IMU_HZ, Style, VehicleName, random_dive, thinned
from hil_tests.navigation_trials import turning
from hil_tests.sensor_faults import Kind, SensorFault

FAULT_S = 50.0  # a fault lasts so long, as in paper 003
LEARNT_S = 120.0  # single faults begin after this
CLEAR_S = 12.0  # a fault "straight on" has no turn for so long after its onset; one "in a turn" begins in one


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording.

    Attributes:
        path: of the file. imu_hz: its IMU's samples are averaged to this rate.
    """

    path: Path
    imu_hz: float = IMU_HZ
    group: str = "recordings"

    @property
    def name(self) -> str:
        return self.path.stem

    def load(self) -> NavigationData:
        """Reads it."""
        data = read_navigation_data(self.path)
        return data if self.imu_hz == IMU_HZ else _slower(data, self.imu_hz)


@dataclass(frozen=True, slots=True)
class Simulated:
    """A random dive, by its seed."""

    seed: int
    style: Style = "plain"
    imu_hz: float = IMU_HZ
    duration_s: float = 400.0
    vehicle: VehicleName | None = None
    group: str = "random dives"

    @property
    def name(self) -> str:
        return f"dive {self.seed}"

    def load(self) -> NavigationData:
        """Simulates it."""
        return random_dive(
            self.seed, vehicle=self.vehicle, style=self.style, duration_s=self.duration_s, imu_hz=self.imu_hz
        )


Source = Recorded | Simulated


@dataclass(frozen=True, slots=True)
class Case:
    """A kind of fault and its size.

    Attributes:
        sensor, kind, size: see `SensorFault`. unit: of the size.
        paper: time to detect that paper 003 states, in seconds, by the method's name.
    """

    sensor: Sensor
    kind: Kind
    size: float = 0.0
    unit: str = ""
    paper: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """In words: DVL drift 0.04 m/s2."""
        sensor = {Sensor.DVL: "DVL", Sensor.GYROSCOPE: "gyro", Sensor.ACCELEROMETER: "accel."}.get(
            self.sensor, str(self.sensor)
        )
        return " ".join([sensor, self.kind, *([f"{self.size:g}", self.unit] if self.size else [])]).strip()

    def fault(self, onset_s: float, rng: np.random.Generator) -> SensorFault:
        """It, with what it leaves open drawn: an offset's axis (forward or right: what the depth sensor cannot see)
        and sign, a beam's number."""
        offset = self.kind in ("step", "drift", "quadratic")
        draw, sign = int(rng.integers(4)), float(rng.choice([-1.0, 1.0]))
        axis = draw if self.kind == "beam" else draw % 2 if offset and self.sensor is not Sensor.DEPTH else None
        return SensorFault(
            sensor=self.sensor, kind=self.kind, onset_s=onset_s, end_s=onset_s + FAULT_S, axis=axis,
            size=self.size * sign if offset or self.kind == "beam" else self.size, seed=draw,
        )  # fmt: skip


PAPER_STEP = (("chi_square", 0.0), ("cusum", 0.0), ("lstm", 0.0))
PAPER_DRIFT = (("chi_square", 34.0), ("cusum", 27.0), ("lstm", 17.0))
# The paper's slope is lost in our text of it. With 0.04 m/s a second, its chi-square finds 1.4 m/s of error after its
# 34 s; half and twice of it stand beside.
PAPER_CASE = Case(Sensor.DVL, "drift", 0.04, "m/s2", PAPER_DRIFT)
CASES = (
    Case(Sensor.DVL, "step", 1.0, "m/s", PAPER_STEP),
    Case(Sensor.DVL, "step", 0.3, "m/s"),
    Case(Sensor.DVL, "drift", 0.02, "m/s2"),
    PAPER_CASE,
    Case(Sensor.DVL, "drift", 0.08, "m/s2"),
    Case(Sensor.DVL, "quadratic", 0.002, "m/s3"),
    Case(Sensor.DVL, "zero"),
    Case(Sensor.DVL, "stuck"),
    Case(Sensor.DVL, "intermittent"),
    Case(Sensor.DVL, "scale", 0.2),
    Case(Sensor.DVL, "noise", 0.3, "m/s"),
    Case(Sensor.DVL, "beam", 0.35, "m/s"),
    Case(Sensor.DEPTH, "step", 2.0, "m"),
    Case(Sensor.DEPTH, "drift", 0.05, "m/s"),
    Case(Sensor.DEPTH, "zero"),
    Case(Sensor.DEPTH, "stuck"),
    Case(Sensor.DEPTH, "noise", 0.5, "m"),
    Case(Sensor.GYROSCOPE, "step", 0.02, "rad/s"),
    Case(Sensor.GYROSCOPE, "drift", 0.001, "rad/s2"),
    Case(Sensor.GYROSCOPE, "stuck"),
    Case(Sensor.GYROSCOPE, "zero"),
    Case(Sensor.ACCELEROMETER, "step", 0.5, "m/s2"),
    Case(Sensor.ACCELEROMETER, "drift", 0.02, "m/s3"),
    Case(Sensor.ACCELEROMETER, "stuck"),
    Case(Sensor.ACCELEROMETER, "zero"),
)


def onsets(data: NavigationData, rng: np.random.Generator) -> dict[str, float]:
    """A random instant on a straight leg and one in a turn, by "straight" and "turn"; none where there is none."""
    time_s, turns = turning(data)
    fitting = (time_s >= time_s[0] + LEARNT_S) & (time_s <= time_s[-1] - FAULT_S)
    ahead = round(CLEAR_S)
    turning_soon = np.convolve(np.append(turns, np.zeros(ahead, dtype=bool)), np.ones(ahead))[ahead - 1 :] > 0.0
    found = {"straight": fitting & ~turning_soon[: len(time_s)], "turn": fitting & turns}
    return {name: float(rng.choice(time_s[where]) + rng.random()) for name, where in found.items() if where.any()}


def _slower(data: NavigationData, imu_hz: float) -> NavigationData:
    return NavigationData(data.name, thinned(data.imu, imu_hz), data.dvl, data.depth, data.reference)

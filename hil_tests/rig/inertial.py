"""A MEMS inertial measurement unit in the autopilot, as RAW_IMU or HIGHRES_IMU tells of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from detectors.navigation import Sensor
from hil_tests.rig.injection import Injection
from hil_tests.rig.kinematics import Vector, added, felt, scaled
from hil_tests.rig.vehicle import Motion
from hil_tests.sensor_faults import SensorFault

STANDARD_GRAVITY_MPS2 = 9.80665
INT16_MAX = 2**15 - 1
HIGHRES_UPDATED = 0x3F  # xacc to zgyro (HIGHRES_IMU_UPDATED_FLAGS)
STILL: tuple[Vector, Vector] = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuErrors:
    """How far off an IMU is; the defaults are of an ICM-20602 (data sheet) that the autopilot has calibrated.

    Attributes:
        accelerometer_noise_mps2: white noise, of the mean of one second.
        gyroscope_noise_radps: the same.
        accelerometer_bias_mps2: standard deviation of each axis' constant offset.
        gyroscope_bias_radps: the same; the gyroscope's is taken off at start-up, but for this.

    Raises:
        ValueError: a number is negative or not finite.
    """

    accelerometer_noise_mps2: float = 1.0e-3
    gyroscope_noise_radps: float = 7.0e-5
    accelerometer_bias_mps2: float = 0.03
    gyroscope_bias_radps: float = 5.0e-4

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not (isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} = {value}: want a standard deviation, 0 or more")


EXACT_IMU = ImuErrors(
    accelerometer_noise_mps2=0.0, gyroscope_noise_radps=0.0, accelerometer_bias_mps2=0.0, gyroscope_bias_radps=0.0
)


@dataclass(frozen=True, slots=True)
class ImuReading:
    """(3,) specific force and (3,) angular rate, forward, right, down, on average since the last reading."""

    specific_force_mps2: Vector
    angular_rate_radps: Vector


class InertialUnit:
    """Feels every step, and tells the mean since it was last read: nothing between two messages is lost or folded.

    Args:
        errors: how far off it is.
        seed: of noise and offsets.
        faults: of gyroscope and accelerometer among those of other sensors, in seconds since the start.
    """

    def __init__(self, errors: ImuErrors, seed: int, faults: Sequence[SensorFault] = ()) -> None:
        self._random = np.random.default_rng([seed, 1])
        self._noises = errors.accelerometer_noise_mps2, errors.gyroscope_noise_radps
        self._biases = [
            scaled(deviation, self._three_normal())
            for deviation in (errors.accelerometer_bias_mps2, errors.gyroscope_bias_radps)
        ]
        self._injections = Injection(Sensor.ACCELEROMETER, faults), Injection(Sensor.GYROSCOPE, faults)
        self._sums, self._summed_s = STILL, 0.0

    def step(self, before: Motion, after: Motion, period_s: float) -> None:
        """Feel the motion over a period."""
        force, rate = felt(before, after, period_s)
        self._sums = added(self._sums[0], scaled(period_s, force)), added(self._sums[1], scaled(period_s, rate))
        self._summed_s += period_s

    def read(self, since_s: float) -> ImuReading | None:
        """The mean since the last reading; None where nothing is to be told.

        Args:
            since_s: since the start, not earlier than before.
        """
        if self._summed_s == 0.0:
            return None
        force, rate = (self._measured(kind, since_s) for kind in (0, 1))
        self._sums, self._summed_s = STILL, 0.0
        return ImuReading(force, rate) if force and rate else None

    def _measured(self, kind: int, since_s: float) -> Vector | None:
        """Of the accelerometer (0) or the gyroscope (1)."""
        mean = scaled(1.0 / self._summed_s, self._sums[kind])
        noise = scaled(self._noises[kind] / sqrt(self._summed_s), self._three_normal())
        return self._injections[kind].vector(since_s, added(mean, self._biases[kind], noise))

    def _three_normal(self) -> Vector:
        first, second, third = self._random.standard_normal(3).tolist()
        return first, second, third


def raw_imu(boot_s: float, reading: ImuReading) -> Any:
    """RAW_IMU as ArduSub fills it: in whole thousandths of standard gravity and of a radian per second, cut off."""
    forces = [_whole(1e3 * part / STANDARD_GRAVITY_MPS2) for part in reading.specific_force_mps2]
    rates = [_whole(1e3 * part) for part in reading.angular_rate_radps]
    return mavlink.MAVLink_raw_imu_message(round(1e6 * boot_s), *forces, *rates, 0, 0, 0)


def highres_imu(boot_s: float, reading: ImuReading) -> Any:
    """HIGHRES_IMU as PX4 fills it, in SI units; of magnetic field, pressure and temperature it says nothing new."""
    absent = (0.0,) * 7
    return mavlink.MAVLink_highres_imu_message(
        round(1e6 * boot_s), *reading.specific_force_mps2, *reading.angular_rate_radps, *absent, HIGHRES_UPDATED
    )


def _whole(value: float) -> int:
    """Cut off towards zero, and within the message's 16 bits: a faulty sensor may say anything."""
    return max(-INT16_MAX, min(INT16_MAX, int(value)))

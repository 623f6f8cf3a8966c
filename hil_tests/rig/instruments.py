"""The navigation sensors of the simulated vehicle, together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hil_tests.rig.dvl import DopplerLog, DvlErrors
from hil_tests.rig.inertial import ImuErrors, InertialUnit, highres_imu, raw_imu
from hil_tests.rig.pressure import PressureErrors, PressureSensor, scaled_pressure2
from hil_tests.rig.vehicle import Motion
from hil_tests.sensor_faults import SensorFault


@dataclass(frozen=True, slots=True, kw_only=True)
class Equipment:
    """Which sensors there are, how far off they are, and what happens to them.

    Attributes:
        imu: errors of the inertial measurement unit; None: nothing is told of any.
        dvl: of the Doppler log, or None.
        pressure: of the pressure sensor, or None.
        faults: in seconds since the start.
    """

    imu: ImuErrors | None = ImuErrors()  # noqa: RUF009  frozen
    dvl: DvlErrors | None = DvlErrors()  # noqa: RUF009
    pressure: PressureErrors | None = PressureErrors()  # noqa: RUF009
    faults: Sequence[SensorFault] = ()


class Instruments:
    """The sensors themselves.

    Args:
        equipment: which.
        seed: of all noise.
        motion: of the vehicle at the start.
    """

    def __init__(self, equipment: Equipment, seed: int, motion: Motion) -> None:
        faults = equipment.faults
        self._imu = InertialUnit(equipment.imu, seed, faults) if equipment.imu else None
        self._dvl = DopplerLog(equipment.dvl, seed, faults) if equipment.dvl else None
        self._pressure = PressureSensor(equipment.pressure, seed, faults) if equipment.pressure else None
        self._motion = motion

    def step(self, motion: Motion, period_s: float) -> None:
        """Take in how the vehicle has moved within a period."""
        if self._imu:
            self._imu.step(self._motion, motion, period_s)
        self._motion = motion

    def raw_imu(self, boot_s: float) -> Any | None:
        """RAW_IMU, of the mean since the last one; None where there is nothing to tell."""
        reading = self._imu and self._imu.read(boot_s)
        return raw_imu(boot_s, reading) if reading else None

    def highres_imu(self, boot_s: float) -> Any | None:
        """HIGHRES_IMU of the same, which an autopilot sends in place of it."""
        reading = self._imu and self._imu.read(boot_s)
        return highres_imu(boot_s, reading) if reading else None

    def scaled_pressure2(self, boot_s: float) -> Any | None:
        """SCALED_PRESSURE2; None where there is nothing to tell."""
        pressure_pa = self._pressure.read(boot_s, self._motion) if self._pressure else None
        return None if pressure_pa is None else scaled_pressure2(boot_s, pressure_pa)

    def vision_position_delta(self, boot_s: float) -> Any | None:
        """The DVL's message if it is due, else None."""
        return self._dvl and self._dvl.due(boot_s, self._motion)

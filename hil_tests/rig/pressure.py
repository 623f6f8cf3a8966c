"""A pressure sensor outside the hull, by which the depth is known: the autopilot's second barometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from detectors.navigation import Sensor
from hil_tests.rig.geodesy import gravity_mps2
from hil_tests.rig.injection import Injection
from hil_tests.rig.vehicle import Motion
from hil_tests.sensor_faults import SensorFault

WATER_TEMPERATURE_CENTI_DEG = 850


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureErrors:
    """The water and the air above it, and how far off the sensor is; the default noise is of a Bar30.

    Attributes:
        noise_m: standard deviation of the depth.
        surface_pa: pressure of the air.
        density_kgm3: of the water.

    Raises:
        ValueError: a number is out of its range.
    """

    noise_m: float = 0.005
    surface_pa: float = 101_325.0
    density_kgm3: float = 1025.0

    def __post_init__(self) -> None:
        if not (isfinite(self.noise_m) and self.noise_m >= 0.0):
            raise ValueError(f"noise_m = {self.noise_m}: want a standard deviation, 0 or more")
        for name in ("surface_pa", "density_kgm3"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}: want a number above 0")


class PressureSensor:
    """Tells the pressure of the water where the vehicle is.

    Args:
        errors: how far off it is.
        seed: of the noise.
        faults: of the depth sensor among those of others, in seconds since the start and metres.
    """

    def __init__(self, errors: PressureErrors, seed: int, faults: Sequence[SensorFault] = ()) -> None:
        self._errors = errors
        self._random = np.random.default_rng([seed, 3])
        self._injection = Injection(Sensor.DEPTH, faults)

    def read(self, since_s: float, motion: Motion) -> float | None:
        """Pressure in Pa; None where nothing is to be told.

        Args:
            since_s: since the start, not earlier than before.
            motion: where the vehicle is.
        """
        noisy_m = motion.down_m + self._errors.noise_m * float(self._random.standard_normal())
        depth_m = self._injection.number(since_s, noisy_m)
        if depth_m is None:
            return None
        return self._errors.surface_pa + self._errors.density_kgm3 * gravity_mps2(motion.down_m) * depth_m


def scaled_pressure2(boot_s: float, pressure_pa: float) -> Any:
    """SCALED_PRESSURE2, in which a BlueROV2 tells the pressure of the water."""
    return mavlink.MAVLink_scaled_pressure2_message(
        round(1e3 * boot_s), 1e-2 * pressure_pa, 0.0, WATER_TEMPERATURE_CENTI_DEG
    )

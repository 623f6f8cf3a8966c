"""Faults put into what one sensor of the rig measures, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

from detectors.navigation import Sensor
from hil_tests.rig.kinematics import Vector
from hil_tests.sensor_faults import Injector, SensorFault


class Injection:
    """All faults of one sensor, one upon the other.

    Args:
        sensor: which.
        faults: of any sensors, in seconds since the start.
    """

    def __init__(self, sensor: Sensor, faults: Sequence[SensorFault]) -> None:
        self._injectors = [Injector(fault) for fault in faults if fault.sensor is sensor]

    def vector(self, since_s: float, value: Vector) -> Vector | None:
        """What the sensor says instead of three numbers; None for nothing."""
        said = self._said(since_s, value)
        return (said[0], said[1], said[2]) if said else None

    def number(self, since_s: float, value: float) -> float | None:
        """What it says instead of one."""
        said = self._said(since_s, (value,))
        return said[0] if said else None

    def _said(self, since_s: float, value: tuple[float, ...]) -> tuple[float, ...] | None:
        said: tuple[float, ...] | None = value
        for injector in self._injectors:
            if said is None:
                return None
            said = injector.sample(since_s, said)
        return said

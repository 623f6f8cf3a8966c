"""An acoustic positioning system (USBL, or short baseline) that tells the autopilot its fixes by GPS_INPUT.

It shows what such systems show in the field: echoes that put a fix far off, and the last fix told again while there
is no new one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.geodesy import degrees_e7
from hil_tests.rig.vehicle import Motion

COMPONENT_ID = 220  # MAV_COMP_ID_GPS, as Water Linked's extension for BlueOS sends
GPS_EPOCH_UNIX_S = 315_964_800
LEAP_S = 18
WEEK_S = 604_800
IGNORED = (
    mavlink.GPS_INPUT_IGNORE_FLAG_VEL_HORIZ
    | mavlink.GPS_INPUT_IGNORE_FLAG_VEL_VERT
    | mavlink.GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY
    | mavlink.GPS_INPUT_IGNORE_FLAG_VERTICAL_ACCURACY
)


@dataclass(frozen=True, slots=True, kw_only=True)
class AcousticErrors:
    """How often the system speaks, and how well it knows.

    Attributes:
        interval_s: from message to message.
        noise_m: standard deviation of a good fix, north and east each.
        outlier_share: probability of an echo.
        outlier_m: standard deviation of an echo's error.
        repeat_share: probability that the last fix is told again.

    Raises:
        ValueError: a number is out of its range.
    """

    interval_s: float = 1.0
    noise_m: float = 0.5
    outlier_share: float = 0.02
    outlier_m: float = 30.0
    repeat_share: float = 0.1

    def __post_init__(self) -> None:
        _want("interval_s", self.interval_s, isfinite(self.interval_s) and self.interval_s > 0.0, "seconds above 0")
        for name, value in (("noise_m", self.noise_m), ("outlier_m", self.outlier_m)):
            _want(name, value, isfinite(value) and value >= 0.0, "a standard deviation, 0 or more")
        for name, value in (("outlier_share", self.outlier_share), ("repeat_share", self.repeat_share)):
            _want(name, value, 0.0 <= value < 1.0, "a probability, 0 to below 1")


class AcousticSystem:
    """Makes the messages; someone else sends them.

    Args:
        errors: of its fixes.
        seed: of the noise.
    """

    def __init__(self, errors: AcousticErrors, seed: int) -> None:
        self._errors = errors
        self._random = np.random.default_rng(seed)
        self._next_s = 0.0
        self._told_m: tuple[float, float] | None = None

    def due(self, since_s: float, time_s: float, motion: Motion) -> Any | None:
        """The GPS_INPUT that is due, or None.

        Args:
            since_s: since the start.
            time_s: the same in unix seconds.
            motion: where the vehicle is.
        """
        if since_s < self._next_s:
            return None
        self._next_s = max(self._next_s + self._errors.interval_s, since_s)
        if self._told_m is None or self._random.random() >= self._errors.repeat_share:
            self._told_m = self._fix(motion)
        return self._message(time_s, *self._told_m, motion.down_m)

    def _fix(self, motion: Motion) -> tuple[float, float]:
        echo = self._random.random() < self._errors.outlier_share
        noise_m = self._errors.outlier_m if echo else self._errors.noise_m
        north_m, east_m = noise_m * self._random.standard_normal(2)
        return motion.north_m + float(north_m), motion.east_m + float(east_m)

    def _message(self, time_s: float, north_m: float, east_m: float, down_m: float) -> Any:
        week, of_week_s = divmod(time_s - GPS_EPOCH_UNIX_S + LEAP_S, WEEK_S)
        return mavlink.MAVLink_gps_input_message(
            round(1e6 * time_s), 0, IGNORED, round(1e3 * of_week_s), int(week), mavlink.GPS_FIX_TYPE_3D_FIX,
            *degrees_e7(north_m, east_m), -down_m, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, self._errors.noise_m, 0.0, 10,
        )  # fmt: skip


def _want(name: str, value: float, fulfilled: bool, wanted: str) -> None:
    if not fulfilled:
        raise ValueError(f"{name} = {value}: want {wanted}")

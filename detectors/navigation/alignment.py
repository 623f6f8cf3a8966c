"""Initial alignment: attitude, velocity and position from the first seconds of samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from math import hypot, inf, isfinite

from detectors.navigation.config import NavigationConfig
from detectors.navigation.earth import gravity_mps2
from detectors.navigation.levelling import Levelling, at_imu, roll_and_pitch
from detectors.navigation.rotation import from_euler, rotate
from detectors.navigation.sample import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationSample,
    NavigationState,
    Vector,
)

LEVELLING_S = 10.0
PATIENCE_S = 5.0  # for a DVL and a depth sensor, where the attitude is known
FRESH_S = 1.5  # a velocity or attitude that is older is not the present one any more; a DVL at 1 Hz is never older
# The specific force of a healthy accelerometer, less the vehicle's own acceleration, is gravity within its bias.
GRAVITY_ERROR_MAX_MPS2 = 0.5
_STILL: Vector = (0.0, 0.0, 0.0)


class Alignment:
    """Finds the state that a navigation detector begins with.

    With another system's attitude (the autopilot's): roll, pitch and heading are its newest, and the velocity is the
    DVL's. Without one: roll, pitch and velocity by `Levelling` over ten seconds, on the move if need be; the heading
    is what it is told. What is not heard within some seconds is taken as nothing: a velocity of 0, a depth of 0. The
    position is the newest fix, or as told.

    The biases are not estimated here: on the move they cannot be told from motion, and the filter finds them. Each
    alignment is good for one state; it is the beginning of the samples that counts.

    Args:
        config: lever arm, mounting and delay of the DVL.
        latitude_rad, longitude_rad: roughly where, for gravity and the earth's rate.
        heading_rad: roughly, where no other system's is heard.

    Raises:
        ValueError: a position or heading that is not finite.
    """

    def __init__(
        self,
        config: NavigationConfig,
        *,
        latitude_rad: float = 0.0,
        longitude_rad: float = 0.0,
        heading_rad: float = 0.0,
    ) -> None:
        given = {"latitude_rad": latitude_rad, "longitude_rad": longitude_rad, "heading_rad": heading_rad}
        for name, value in given.items():
            if not isfinite(value):
                raise ValueError(f"{name} = {value}: want a finite number")
        self._config = config
        self._mounting = from_euler(config.dvl_mounting_rad)
        self._position = (latitude_rad, longitude_rad)
        self._heading_rad = heading_rad
        self._levelling = Levelling(config)
        self._newest_s = self._begun_s = -inf
        self._imu: ImuSample | None = None
        self._dvl: DvlSample | None = None
        self._depth: DepthSample | None = None
        self._attitude: AttitudeSample | None = None
        self._doubt = ""
        self._found = False

    @property
    def reason(self) -> str:
        """What is being waited for, in words; empty once the state was found."""
        if self._found:
            return ""
        if self._imu is None:
            return "waiting for the IMU"
        if self._attitude is not None and self._fresh(self._attitude):
            return f"waiting for the {self._missing() or 'next attitude'}"
        return self._doubt or f"levelling: {self._levelling.span_s:.0f} of {LEVELLING_S:.0f} s"

    def update(self, sample: NavigationSample) -> NavigationState | None:
        """Takes the next sample, in the order of time. One that is late or not finite is left out.

        Returns:
            The state at the time of this sample, once: as soon as it is known.
        """
        if self._found or not (sample.time_s >= self._newest_s and all(map(isfinite, _numbers(sample)))):
            return None
        self._newest_s = sample.time_s
        match sample:
            case ImuSample():
                return self._turn(sample)
            case AttitudeSample():
                self._attitude = sample
                return self._adopt(sample)
            case DvlSample():
                self._dvl = sample
                self._levelling.measure(sample)
            case DepthSample():
                self._depth = sample
            case FixSample():
                self._position = (sample.latitude_rad, sample.longitude_rad)
        return None

    def _fresh(self, sample: NavigationSample) -> bool:
        return self._newest_s - sample.time_s <= FRESH_S

    def _missing(self) -> str:
        """What is still waited for besides the IMU and the attitude; empty when it is all there, or will not come."""
        if self._imu is None or not self._fresh(self._imu):
            return "IMU"
        if self._newest_s - self._begun_s < PATIENCE_S:
            if self._dvl is None or not self._fresh(self._dvl):
                return "DVL"
            if self._depth is None:
                return "depth sensor"
        return ""

    def _adopt(self, sample: AttitudeSample) -> NavigationState | None:
        """By another system's attitude."""
        if self._missing() or self._imu is None:
            return None
        velocity_mps = _STILL
        if self._dvl is not None and self._fresh(self._dvl):
            rate, arm_m = self._imu.angular_rate_radps, self._config.dvl_lever_arm_m
            velocity_mps = at_imu(self._dvl.velocity_mps, rate, self._mounting, arm_m)
        return self._state(sample.time_s, sample.attitude_rad, velocity_mps)

    def _turn(self, sample: ImuSample) -> NavigationState | None:
        """By the IMU: the state at the end of a span of levelling."""
        if self._imu is None:
            self._begun_s = sample.time_s
        self._imu = sample
        self._levelling.turn(sample)
        if self._levelling.span_s < LEVELLING_S:
            return None
        level = self._levelling.level()
        excess_mps2 = hypot(*level.gravity_mps2) - gravity_mps2(self._position[0], 0.0)
        if abs(excess_mps2) > GRAVITY_ERROR_MAX_MPS2:
            self._doubt = f"specific force {excess_mps2:+.1f} m/s2 beside gravity"
            self._levelling.restart()
            return None
        roll_rad, pitch_rad = roll_and_pitch(level.gravity_mps2)
        return self._state(sample.time_s, (roll_rad, pitch_rad, self._heading_rad), level.velocity_mps or _STILL)

    def _state(self, time_s: float, attitude_rad: Vector, body_velocity_mps: Vector) -> NavigationState:
        latitude_rad, longitude_rad = self._position
        depth_m = 0.0 if self._depth is None else self._depth.depth_m
        velocity_mps = rotate(from_euler(attitude_rad), body_velocity_mps)
        self._found = True
        return NavigationState(time_s, latitude_rad, longitude_rad, depth_m, velocity_mps, attitude_rad)


def _numbers(sample: NavigationSample) -> Iterator[float]:
    for field in fields(sample):
        value = getattr(sample, field.name)
        yield from value if isinstance(value, tuple) else (value,)

"""Strapdown mechanisation: from specific force and angular rate to attitude, velocity and position."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, isfinite, pi, remainder

from detectors.navigation.earth import LocalEarth
from detectors.navigation.rotation import (
    Quaternion,
    cross,
    from_euler,
    from_rotation_vector,
    normalised,
    product,
    rotate,
    rotate_back,
    to_euler,
)
from detectors.navigation.sample import NavigationState, Vector

LONGEST_S = 1.0
# How often what depends on the latitude is computed anew. At 10 m/s it is 1 m behind: 2e-7 rad of latitude, and 1e-11
# rad/s of the earth's rate.
REFRESH_S = 0.1
_ZERO: Vector = (0.0, 0.0, 0.0)
_HALF_TURN: Quaternion = (0.0, 0.0, 0.0, 1.0)  # about down


@dataclass(frozen=True, slots=True)
class StrapdownError:
    """What the truth has more than a `Strapdown` says: true value minus its own.

    Attributes:
        attitude_rad: (3,) rotation vector in north-east-down that turns its attitude into the true one.
        velocity_mps, position_m: (3,) north, east, down.
        accelerometer_bias_mps2, gyroscope_bias_radps: (3,) in the body.
    """

    attitude_rad: Vector = _ZERO
    velocity_mps: Vector = _ZERO
    position_m: Vector = _ZERO
    accelerometer_bias_mps2: Vector = _ZERO
    gyroscope_bias_radps: Vector = _ZERO


class Strapdown:
    """Dead reckoning from an IMU on the rotating ellipsoid, in north-east-down (paper 003, equations 17 to 19).

    An angular rate and a specific force count as means over the interval that a sample ends; from one interval to the
    next they are taken to change evenly (coning and sculling, of the third order: at the 10 to 50 Hz of a telemetry
    link they matter). The frame turns with the earth and along its curvature; gravity goes by latitude and depth; the
    position is the trapezoid of the velocity.

    Args:
        state: where it begins.
        accelerometer_bias_mps2, gyroscope_bias_radps: (3,) subtracted from every sample.

    Attributes:
        latitude_rad, longitude_rad, depth_m: WGS 84; the longitude within +-pi.
        velocity_mps: (3,) north, east, down.
        attitude: of the body, to north-east-down.
        accelerometer_bias_mps2, gyroscope_bias_radps: as given, and since corrected.
        specific_force_mps2: (3,) newest, north, east, down, without bias; what a body at rest and level would feel
            before the first.

    Raises:
        ValueError: a state that is not finite, or has a latitude beyond a pole.
    """

    __slots__ = (
        "_earth",
        "_last_force",
        "_last_interval_s",
        "_last_rate",
        "_stale_s",
        "accelerometer_bias_mps2",
        "attitude",
        "depth_m",
        "gyroscope_bias_radps",
        "latitude_rad",
        "longitude_rad",
        "specific_force_mps2",
        "velocity_mps",
    )

    def __init__(
        self,
        state: NavigationState,
        *,
        accelerometer_bias_mps2: Vector = _ZERO,
        gyroscope_bias_radps: Vector = _ZERO,
    ) -> None:
        numbers = (state.latitude_rad, state.longitude_rad, state.depth_m, *state.velocity_mps, *state.attitude_rad)
        if not all(map(isfinite, numbers)) or abs(state.latitude_rad) > 0.5 * pi:
            raise ValueError(f"state = {state}: want finite numbers, and a latitude within +-pi/2")
        self.latitude_rad = state.latitude_rad
        self.longitude_rad = remainder(state.longitude_rad, 2.0 * pi)
        self.depth_m = state.depth_m
        self.velocity_mps = state.velocity_mps
        self.attitude = from_euler(state.attitude_rad)
        self.accelerometer_bias_mps2 = accelerometer_bias_mps2
        self.gyroscope_bias_radps = gyroscope_bias_radps
        self._last_rate, self._last_force, self._last_interval_s = _ZERO, _ZERO, inf  # none: for ever ago
        self._refresh()
        self.specific_force_mps2 = (0.0, 0.0, -self._gravity_mps2())

    @property
    def earth(self) -> LocalEarth:
        """Radii, gravity and rotation at this latitude."""
        return self._earth

    def advance(self, specific_force_mps2: Vector, angular_rate_radps: Vector, interval_s: float) -> None:
        """Goes on by one sample of finite numbers.

        Args:
            specific_force_mps2: (3,) of the body, mean over the interval.
            angular_rate_radps: (3,) of the body, the same.
            interval_s: since the sample before.

        Raises:
            ValueError: an interval not above 0 or longer than 1 s.
        """
        if not 0.0 < interval_s <= LONGEST_S:
            raise ValueError(f"interval_s = {interval_s}: want above 0, and {LONGEST_S} at most")
        self._stale_s += interval_s
        if self._stale_s >= REFRESH_S:
            self._refresh()
        transport = self._earth.transport_rate_radps(self.velocity_mps, self.depth_m)
        turn, push = self._increments(specific_force_mps2, angular_rate_radps, interval_s)
        push = self._turn(turn, push, transport, interval_s)
        self.specific_force_mps2 = _scaled(push, 1.0 / interval_s)
        self._move(push, transport, interval_s)

    def coast(self, interval_s: float) -> None:
        """Goes on as it went, for a time that no sample tells of."""
        north_mps, east_mps, down_mps = self.velocity_mps
        self._displace(interval_s * north_mps, interval_s * east_mps, interval_s * down_mps)
        self._last_interval_s = inf
        self._refresh()

    def locate(self, latitude_rad: float, longitude_rad: float) -> None:
        """Goes on from another place of the same depth."""
        self.latitude_rad, self.longitude_rad = latitude_rad, remainder(longitude_rad, 2.0 * pi)
        self._refresh()

    def state(self, time_s: float) -> NavigationState:
        """Where the vehicle is now, which is `time_s` as the caller knows."""
        return NavigationState(
            time_s, self.latitude_rad, self.longitude_rad, self.depth_m, self.velocity_mps, to_euler(self.attitude)
        )

    def body_velocity(self) -> Vector:
        """(3,) velocity over ground, forward, right, down."""
        return rotate_back(self.attitude, self.velocity_mps)

    def correct(self, error: StrapdownError) -> None:
        """Takes in what a filter found out, so that these errors are none from here on."""
        north_m, east_m, down_m = error.position_m
        self.attitude = product(from_rotation_vector(error.attitude_rad), self.attitude)
        self.velocity_mps = _sum(self.velocity_mps, error.velocity_mps)
        self._displace(north_m, east_m, down_m)
        self.accelerometer_bias_mps2 = _sum(self.accelerometer_bias_mps2, error.accelerometer_bias_mps2)
        self.gyroscope_bias_radps = _sum(self.gyroscope_bias_radps, error.gyroscope_bias_radps)
        self._refresh()

    def _refresh(self) -> None:
        """What changes slowly: the earth at this latitude, and the rounding of the attitude's length."""
        self._stale_s = 0.0
        self._earth = LocalEarth.at(self.latitude_rad)
        self.attitude = normalised(self.attitude)

    def _gravity_mps2(self) -> float:
        return self._earth.surface_gravity_mps2 + self._earth.gravity_gradient_ps2 * self.depth_m

    def _increments(self, specific_force: Vector, angular_rate: Vector, interval_s: float) -> tuple[Vector, Vector]:
        """Rotation vector, and change of velocity in the body as it lay at the beginning, of an interval.

        Of the third order, as if both rates changed evenly from the middle of the last interval to that of this one:
        with a and f the integrals of rate and force, d their changes over the interval, a + a x da / 12 (coning) and
        f + a x f / 2 + a x (a x f) / 6 + (a x df + f x da) / 12 (rotation and sculling).
        """
        share = interval_s * interval_s / (0.5 * (interval_s + self._last_interval_s))
        rate_change = _scaled(_difference(angular_rate, self._last_rate), share)
        force_change = _scaled(_difference(specific_force, self._last_force), share)
        self._last_rate, self._last_force, self._last_interval_s = angular_rate, specific_force, interval_s
        turn = _scaled(_difference(angular_rate, self.gyroscope_bias_radps), interval_s)
        push = _scaled(_difference(specific_force, self.accelerometer_bias_mps2), interval_s)
        coning, turned = cross(turn, rate_change), cross(turn, push)
        twice_turned = cross(turn, turned)
        sculling = _sum(cross(turn, force_change), cross(push, rate_change))
        return (
            _sum(turn, _scaled(coning, 1.0 / 12.0)),
            (
                push[0] + turned[0] / 2.0 + twice_turned[0] / 6.0 + sculling[0] / 12.0,
                push[1] + turned[1] / 2.0 + twice_turned[1] / 6.0 + sculling[1] / 12.0,
                push[2] + turned[2] / 2.0 + twice_turned[2] / 6.0 + sculling[2] / 12.0,
            ),
        )

    def _turn(self, body: Vector, push: Vector, transport: Vector, interval_s: float) -> Vector:
        """Attitude at the end of the interval; returns the change of velocity by specific force, north-east-down."""
        earth_north, _, earth_down = self._earth.earth_rate_radps
        about_north, about_east, about_down = transport
        quarter_s = 0.25 * interval_s
        # half an interval of the frame's own turn, backwards: so little that its cosine is 1
        frame = (
            1.0,
            -quarter_s * (earth_north + about_north),
            -quarter_s * about_east,
            -quarter_s * (earth_down + about_down),
        )
        framed = product(frame, self.attitude)
        self.attitude = product(frame, product(framed, from_rotation_vector(body)))
        return rotate(framed, push)

    def _move(self, push: Vector, transport: Vector, interval_s: float) -> None:
        """Velocity and position at the end of the interval (equations 17 and 18)."""
        earth_north, _, earth_down = self._earth.earth_rate_radps
        about_north, about_east, about_down = transport
        twice_earth = (2.0 * earth_north + about_north, about_east, 2.0 * earth_down + about_down)
        coriolis = cross(twice_earth, self.velocity_mps)
        was_north, was_east, was_down = self.velocity_mps
        north = was_north + push[0] - interval_s * coriolis[0]
        east = was_east + push[1] - interval_s * coriolis[1]
        down = was_down + push[2] - interval_s * (coriolis[2] - self._gravity_mps2())
        self.velocity_mps = (north, east, down)
        half_s = 0.5 * interval_s
        self._displace(half_s * (was_north + north), half_s * (was_east + east), half_s * (was_down + down))

    def _displace(self, north_m: float, east_m: float, down_m: float) -> None:
        earth = self._earth
        self.longitude_rad += east_m / ((earth.transverse_m - self.depth_m) * earth.cosine)
        self.latitude_rad += north_m / (earth.meridian_m - self.depth_m)
        self.depth_m += down_m
        if abs(self.longitude_rad) > pi:
            self.longitude_rad = remainder(self.longitude_rad, 2.0 * pi)
        if abs(self.latitude_rad) > 0.5 * pi:
            self._cross_pole()

    def _cross_pole(self) -> None:
        """Beyond a pole what was north is south: the same place, velocity and attitude in the axes there."""
        self.latitude_rad = copysign(pi, self.latitude_rad) - self.latitude_rad
        self.longitude_rad = remainder(self.longitude_rad + pi, 2.0 * pi)
        north, east, down = self.velocity_mps
        self.velocity_mps = (-north, -east, down)
        north, east, down = self.specific_force_mps2
        self.specific_force_mps2 = (-north, -east, down)
        self.attitude = product(_HALF_TURN, self.attitude)
        self._refresh()


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _difference(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _scaled(vector: Vector, factor: float) -> Vector:
    return vector[0] * factor, vector[1] * factor, vector[2] * factor

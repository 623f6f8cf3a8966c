"""The motion of the hull as instruments that are fixed to it feel it."""

from __future__ import annotations

from math import cos, pi, sin

from hil_tests.rig.geodesy import EARTH_RATE_NED_RADPS, gravity_mps2, transport_rate_radps
from hil_tests.rig.vehicle import Motion

Vector = tuple[float, float, float]


def to_body(vector: Vector, attitude_rad: Vector) -> Vector:
    """A vector given north, east, down: forward, right, down in a body turned by yaw, then pitch, then roll.

    Args:
        vector: of any unit.
        attitude_rad: roll, pitch, yaw.
    """
    north, east, down = vector
    roll_rad, pitch_rad, yaw_rad = attitude_rad
    ahead, right = cos(yaw_rad) * north + sin(yaw_rad) * east, cos(yaw_rad) * east - sin(yaw_rad) * north
    forward, down = cos(pitch_rad) * ahead - sin(pitch_rad) * down, sin(pitch_rad) * ahead + cos(pitch_rad) * down
    return forward, cos(roll_rad) * right + sin(roll_rad) * down, cos(roll_rad) * down - sin(roll_rad) * right


def to_earth(vector: Vector, attitude_rad: Vector) -> Vector:
    """The inverse of `to_body`: forward, right, down to north, east, down."""
    forward, right, below = vector
    roll_rad, pitch_rad, yaw_rad = attitude_rad
    right, down = cos(roll_rad) * right - sin(roll_rad) * below, sin(roll_rad) * right + cos(roll_rad) * below
    ahead, down = cos(pitch_rad) * forward + sin(pitch_rad) * down, cos(pitch_rad) * down - sin(pitch_rad) * forward
    return cos(yaw_rad) * ahead - sin(yaw_rad) * right, sin(yaw_rad) * ahead + cos(yaw_rad) * right, down


def body_rates(attitude_rad: Vector, attitude_rates_radps: Vector) -> Vector:
    """Angular rate about the body's axes from roll, pitch, yaw and their rates."""
    roll_rad, pitch_rad, _ = attitude_rad
    roll_rate, pitch_rate, yaw_rate = attitude_rates_radps
    return (
        roll_rate - yaw_rate * sin(pitch_rad),
        pitch_rate * cos(roll_rad) + yaw_rate * sin(roll_rad) * cos(pitch_rad),
        yaw_rate * cos(roll_rad) * cos(pitch_rad) - pitch_rate * sin(roll_rad),
    )


def velocity_at(motion: Motion, lever_arm_m: Vector) -> Vector:
    """Velocity over ground of a place in the body, forward, right, down in the body."""
    rates = body_rates(attitude_rad(motion), (motion.roll_rate_radps, motion.pitch_rate_radps, motion.yaw_rate_radps))
    return added(to_body(motion.velocity_ned_mps(), attitude_rad(motion)), cross(rates, lever_arm_m))


def felt(before: Motion, after: Motion, period_s: float) -> tuple[Vector, Vector]:
    """What an ideal inertial measurement unit measures from one instant to the next, on average.

    Returns:
        Specific force in m/s2 and angular rate in rad/s, both forward, right, down.
    """
    turned_rad = _turned_rad(before, after)
    halfway_rad = added(attitude_rad(before), scaled(0.5, turned_rad))
    velocities_mps = before.velocity_ned_mps(), after.velocity_ned_mps()
    mean_mps = scaled(0.5, added(*velocities_mps))
    acceleration_mps2 = scaled(1.0 / period_s, added(velocities_mps[1], scaled(-1.0, velocities_mps[0])))
    transport_radps = transport_rate_radps(mean_mps[0], mean_mps[1])
    # (2 earth rate + transport rate) x v: the north-east-down frame turns under the vehicle
    coriolis_mps2 = cross(added(scaled(2.0, EARTH_RATE_NED_RADPS), transport_radps), mean_mps)
    force_mps2 = added(acceleration_mps2, coriolis_mps2, (0.0, 0.0, -gravity_mps2(after.down_m)))
    frame_radps = to_body(added(EARTH_RATE_NED_RADPS, transport_radps), halfway_rad)
    rates_radps = body_rates(halfway_rad, scaled(1.0 / period_s, turned_rad))
    return to_body(force_mps2, halfway_rad), added(rates_radps, frame_radps)


def attitude_rad(motion: Motion) -> Vector:
    """Roll, pitch, yaw."""
    return motion.roll_rad, motion.pitch_rad, motion.yaw_rad


def _turned_rad(before: Motion, after: Motion) -> Vector:
    """Change of roll, pitch and yaw, the short way round."""
    yaw_rad = (after.yaw_rad - before.yaw_rad + pi) % (2.0 * pi) - pi
    return after.roll_rad - before.roll_rad, after.pitch_rad - before.pitch_rad, yaw_rad


def added(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    first = second = third = 0.0
    for vector in vectors:
        first += vector[0]
        second += vector[1]
        third += vector[2]
    return first, second, third


def scaled(factor: float, vector: Vector) -> Vector:
    """A vector so many times as long."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


def cross(one: Vector, other: Vector) -> Vector:
    """Vector product."""
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )

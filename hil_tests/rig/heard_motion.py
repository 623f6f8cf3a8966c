"""How a vehicle moves, as a real autopilot tells it: what sensors that a bench plays to it are to agree with.

A simulator tells the truth (SIM_STATE), and that is taken while it comes. Of a real autopilot there is only its own
estimate (ATTITUDE, LOCAL_POSITION_NED): a sensor that is made from it confirms whatever is believed there. On a bench
that is at rest it is at rest. Places count from where the first of them was: that is the origin of the rig.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, isfinite, radians, sin, tan

from drivers.mavlink.formats import ATTITUDE, LOCAL_POSITION_NED, generated
from drivers.mavlink.frames import Packet
from hil_tests.rig.geodesy import METRES_PER_DEGREE_NORTH
from hil_tests.rig.kinematics import Vector
from hil_tests.rig.vehicle import Motion

SIM_STATE = generated("SIM_STATE")
HEARD = frozenset({SIM_STATE.message_id, ATTITUDE.message_id, LOCAL_POSITION_NED.message_id})
STALE_S = 1.0  # what was told longer ago is no motion of now
UPRIGHT = 1e-3  # cosine of the pitch below which roll and yaw are about one axis
DEGREES_E7 = 1e-7


@dataclass(slots=True)
class _Told:
    """What one source has told: attitude and body rates, place and velocity north, east, down; None: not yet."""

    attitude_s: float = -inf
    attitude_rad: Vector = (0.0, 0.0, 0.0)
    rates_radps: Vector = (0.0, 0.0, 0.0)
    place_s: float = -inf
    place_m: Vector = (0.0, 0.0, 0.0)
    velocity_mps: Vector = (0.0, 0.0, 0.0)

    def motion(self, time_s: float) -> Motion | None:
        if time_s - min(self.attitude_s, self.place_s) > STALE_S:
            return None
        north, east, down = self.velocity_mps
        roll, pitch, yaw = self.attitude_rad
        roll_rate, pitch_rate, yaw_rate = _angle_rates(self.attitude_rad, self.rates_radps)
        ahead, aside = cos(yaw) * north + sin(yaw) * east, cos(yaw) * east - sin(yaw) * north
        return Motion(
            *self.place_m, yaw, ahead, aside, down, yaw_rate,
            roll_rad=roll, pitch_rad=pitch, roll_rate_radps=roll_rate, pitch_rate_radps=pitch_rate,
        )  # fmt: skip


class HeardMotion:
    """Packets of an autopilot in, motion out. Whatever they say, it does not raise."""

    def __init__(self) -> None:
        self._truth, self._estimate = _Told(), _Told()
        self._origin_deg: tuple[float, float] | None = None

    def take(self, packet: Packet, time_s: float) -> None:
        """A packet of the autopilot, one of `HEARD`."""
        match packet.message_id:
            case ATTITUDE.message_id:
                self._attitude(ATTITUDE.unpack(packet.payload), time_s)
            case LOCAL_POSITION_NED.message_id:
                self._position(LOCAL_POSITION_NED.unpack(packet.payload), time_s)
            case SIM_STATE.message_id:
                self._simulated(SIM_STATE.unpack(packet.payload), time_s)

    def motion(self, time_s: float) -> Motion | None:
        """How it moves now; None: nobody has told of late."""
        return self._truth.motion(time_s) or self._estimate.motion(time_s)

    def _attitude(self, values: tuple[float, ...], time_s: float) -> None:
        _boot_ms, roll, pitch, yaw, *rates = values
        if all(map(isfinite, (roll, pitch, yaw, *rates))):
            told = self._estimate
            told.attitude_s, told.attitude_rad, told.rates_radps = time_s, (roll, pitch, yaw), _vector(rates)

    def _position(self, values: tuple[float, ...], time_s: float) -> None:
        if all(map(isfinite, values)):
            told = self._estimate
            told.place_s, told.place_m, told.velocity_mps = time_s, _vector(values[1:4]), _vector(values[4:7])

    def _simulated(self, values: tuple[float, ...], time_s: float) -> None:
        angles, rates, velocity = values[4:7], values[10:13], values[18:21]
        altitude_m, latitude_e7, longitude_e7 = values[15], values[21], values[22]
        if not all(map(isfinite, (*angles, *rates, *velocity, altitude_m))):
            return
        told = self._truth
        told.attitude_s, told.attitude_rad, told.rates_radps = time_s, _vector(angles), _vector(rates)
        told.place_s, told.velocity_mps = time_s, _vector(velocity)
        told.place_m = (*self._metres(DEGREES_E7 * latitude_e7, DEGREES_E7 * longitude_e7), -altitude_m)

    def _metres(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """North and east of where it was first."""
        if self._origin_deg is None:
            self._origin_deg = latitude_deg, longitude_deg
        north_deg, east_deg = latitude_deg - self._origin_deg[0], longitude_deg - self._origin_deg[1]
        east_m = METRES_PER_DEGREE_NORTH * cos(radians(self._origin_deg[0])) * east_deg
        return METRES_PER_DEGREE_NORTH * north_deg, east_m


def _angle_rates(attitude_rad: Vector, rates_radps: Vector) -> Vector:
    """Rates of roll, pitch and yaw from those about the axes of the body; straight up, roll keeps its own."""
    roll, pitch, _ = attitude_rad
    about_forward, about_right, about_down = rates_radps
    level = sin(roll) * about_right + cos(roll) * about_down
    if abs(cos(pitch)) < UPRIGHT:
        return about_forward, cos(roll) * about_right - sin(roll) * about_down, 0.0
    return (
        about_forward + tan(pitch) * level,
        cos(roll) * about_right - sin(roll) * about_down,
        level / cos(pitch),
    )


def _vector(values: tuple[float, ...] | list[float]) -> Vector:
    first, second, third = values
    return first, second, third

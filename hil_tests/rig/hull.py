"""The hull of a simulated vehicle, and how its thrusters push it about; by default a BlueROV2 Heavy's.

The hull moves in the plane and in depth (surge, sway, heave, yaw). Roll and pitch are small: they are there for the
sensors that they tilt, and change nothing of the forces. That is enough for what a gateway sees of a vehicle: its
commands, its thrusters, its attitude and position. Drag is of the motion through the water; the track over ground is
that motion and the water's together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin

from hil_tests.rig.faults import HullFault, Pull, drag_factor
from hil_tests.rig.layout import Layout, Mount
from hil_tests.rig.tilt import LIGHT, Tilt, TiltParameters
from hil_tests.rig.water import AT_REST, STILL, Velocity, Water

HALF_SQRT2 = 0.5**0.5  # the horizontal thrusters stand at 45 degrees
YAW_ARM_M = 0.19  # lever arm of a horizontal thruster about the vertical axis
# Order and signs of forward, lateral and yaw as in ArduSub's frame "vectored 6DOF" (AP_Motors6DOF.cpp); the vertical
# ones push down when they turn ahead.
VERTICAL = Mount(down=1.0)
BLUEROV2_HEAVY = Layout(
    (
        Mount(ahead=-HALF_SQRT2, right=HALF_SQRT2, yaw_arm_m=YAW_ARM_M),
        Mount(ahead=-HALF_SQRT2, right=-HALF_SQRT2, yaw_arm_m=-YAW_ARM_M),
        Mount(ahead=HALF_SQRT2, right=HALF_SQRT2, yaw_arm_m=-YAW_ARM_M),
        Mount(ahead=HALF_SQRT2, right=-HALF_SQRT2, yaw_arm_m=YAW_ARM_M),
        VERTICAL,
        VERTICAL,
        VERTICAL,
        VERTICAL,
    )
)
MIXER = BLUEROV2_HEAVY.mixer
THRUSTERS = len(BLUEROV2_HEAVY)
mix = BLUEROV2_HEAVY.mix


@dataclass(frozen=True, slots=True)
class HullParameters:
    """Hull of a BlueROV2 Heavy along surge, sway, heave (kg, N s/m, N s2/m2) and yaw (kg m2, N m s, N m s2).

    Source: C. J. Wu, 6-DoF Modelling and Control of a Remotely Operated Vehicle, Flinders University 2018, chapter 4.
    """

    inertia: tuple[float, float, float, float] = (11.5, 11.5, 11.5, 0.16)
    added: tuple[float, float, float, float] = (5.5, 12.7, 14.57, 0.12)
    linear_damping: tuple[float, float, float, float] = (4.03, 6.22, 5.18, 0.07)
    quadratic_damping: tuple[float, float, float, float] = (18.18, 21.66, 36.99, 1.55)
    buoyancy_n: float = 2.0  # an ROV is ballasted to float up slowly


@dataclass(frozen=True, slots=True)
class Motion:
    """Where the vehicle is and how it moves.

    Attributes:
        north_m, east_m, down_m, yaw_rad: its place and heading.
        forward_mps, right_mps, down_mps: velocity through the water, in a level frame that turns with the heading.
        yaw_rate_radps: clockwise seen from above.
        water_mps: velocity of the water there, north, east, down.
        roll_rad, pitch_rad: starboard down, bow up.
        roll_rate_radps, pitch_rate_radps: of their change.
    """

    north_m: float = 0.0
    east_m: float = 0.0
    down_m: float = 5.0
    yaw_rad: float = 0.0
    forward_mps: float = 0.0
    right_mps: float = 0.0
    down_mps: float = 0.0
    yaw_rate_radps: float = 0.0
    water_mps: Velocity = AT_REST
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rate_radps: float = 0.0
    pitch_rate_radps: float = 0.0

    def velocity_ned_mps(self) -> Velocity:
        """Velocity over ground north, east, down."""
        cosine, sine = cos(self.yaw_rad), sin(self.yaw_rad)
        north, east, down = self.water_mps
        north += cosine * self.forward_mps - sine * self.right_mps
        return north, east + sine * self.forward_mps + cosine * self.right_mps, down + self.down_mps

    def over_ground_mps(self) -> Velocity:
        """Velocity over ground forward, right, down, in the level frame."""
        cosine, sine = cos(self.yaw_rad), sin(self.yaw_rad)
        north, east, down = self.velocity_ned_mps()
        return cosine * north + sine * east, cosine * east - sine * north, down


class Hull:
    """Moves under the thrusters' forces. Damping is taken implicitly, so that no step is too long for it.

    In a turn it slips outwards and slows down, by the Coriolis and centripetal forces on hull and added mass (T. I.
    Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, section 6.3). The yawing moment of the
    slip is left out: it is the first thing that a heading hold takes away. An open frame is a bluff body, with drag
    against the way it moves: in the plane the quadratic part goes with the whole speed, not with each component.

    Args:
        parameters: what hull it is.
        motion: to begin with.
        water: in which it moves.
        faults: what catches on it.
        layout: of its thrusters.
        tilt: how its thrusters tilt it.
    """

    def __init__(
        self,
        parameters: HullParameters | None = None,
        motion: Motion | None = None,
        water: Water = STILL,
        faults: Sequence[HullFault | Pull] = (),
        layout: Layout = BLUEROV2_HEAVY,
        tilt: TiltParameters = LIGHT,
    ) -> None:
        self._parameters = parameters or HullParameters()
        self._layout = layout
        self._water = water
        self._nets = [fault for fault in faults if isinstance(fault, HullFault)]
        self._pulls = [fault for fault in faults if isinstance(fault, Pull)]
        self._since_s = 0.0
        self.motion = motion or Motion()
        self._roll, self._pitch = (
            Tilt(tilt, angle_rad) for angle_rad in (self.motion.roll_rad, self.motion.pitch_rad)
        )

    def step(self, thrusts_n: Sequence[float], period_s: float) -> Motion:
        """Advance by one period under one thrust per thruster."""
        was = self.motion
        self._since_s += period_s
        velocities = (was.forward_mps, was.right_mps, was.down_mps, was.yaw_rate_radps)
        forces = self._forces(thrusts_n, was)
        drag = drag_factor(self._nets, self._since_s)
        in_plane_mps = hypot(was.forward_mps, was.right_mps)
        speeds = (in_plane_mps, in_plane_mps, abs(was.down_mps), abs(was.yaw_rate_radps))
        forward, right, down, yaw_rate = (
            self._velocity(axis, velocity, force, drag * self._damping(axis, speed), period_s)
            for axis, (velocity, force, speed) in enumerate(zip(velocities, forces, speeds, strict=True))
        )
        north_mps, east_mps, down_mps = was.velocity_ned_mps()
        place = (
            was.north_m + north_mps * period_s,
            was.east_m + east_mps * period_s,
            max(was.down_m + down_mps * period_s, 0.0),
        )
        if place[2] == 0.0:
            down = max(down, 0.0)
        yaw_rad = (was.yaw_rad + yaw_rate * period_s + pi) % (2.0 * pi) - pi
        water_mps = self._water.velocity_mps(self._since_s, place)
        tilt = self._tilt(forces[0], forces[1], period_s)
        self.motion = Motion(*place, yaw_rad, forward, right, down, yaw_rate, water_mps, *tilt)
        return self.motion

    def _tilt(self, ahead_n: float, aside_n: float, period_s: float) -> tuple[float, float, float, float]:
        """Roll, pitch and their rates after a step."""
        self._roll.step(aside_n, period_s)
        self._pitch.step(ahead_n, period_s)
        return self._roll.angle_rad, self._pitch.angle_rad, self._roll.rate_radps, self._pitch.rate_radps

    def _forces(self, thrusts_n: Sequence[float], motion: Motion) -> tuple[float, float, float, float]:
        forward, right, down, yaw = self._layout.forces(thrusts_n)
        ahead_n, aside_n = self._coriolis(motion)
        for pull in self._pulls:
            pulled_n = pull.force_n(self._since_s, motion.yaw_rad)
            ahead_n, aside_n = ahead_n + pulled_n[0], aside_n + pulled_n[1]
        buoyancy_n = self._parameters.buoyancy_n if motion.down_m > 0.0 else 0.0
        return forward + ahead_n, right + aside_n, down - buoyancy_n, yaw

    def _coriolis(self, motion: Motion) -> tuple[float, float]:
        surge_kg, sway_kg = (self._inertia(axis) for axis in (0, 1))
        rate = motion.yaw_rate_radps
        return sway_kg * motion.right_mps * rate, -surge_kg * motion.forward_mps * rate

    def _damping(self, axis: int, speed: float) -> float:
        return self._parameters.linear_damping[axis] + self._parameters.quadratic_damping[axis] * speed

    def _velocity(self, axis: int, velocity: float, force: float, damping: float, period_s: float) -> float:
        inertia = self._inertia(axis)
        return (velocity + period_s * force / inertia) / (1.0 + period_s * damping / inertia)

    def _inertia(self, axis: int) -> float:
        return self._parameters.inertia[axis] + self._parameters.added[axis]

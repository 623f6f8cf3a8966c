"""A simulated vehicle, a BlueROV2 Heavy by default: thrusters on one battery, and a hull that they push about.

The hull moves in the plane and in depth (surge, sway, heave, yaw). Roll and pitch are small: they are there for the
sensors that they tilt, and change nothing of the forces. That is enough for what a gateway sees of a vehicle: its
commands, its thrusters, its attitude and position. Drag is of the motion through the water; the track over ground is
that motion and the water's together.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin

from hil_tests.rig.faults import HullFault, InjectedFault, Pull, Sag, drag_factor
from hil_tests.rig.layout import Layout, Mount
from hil_tests.rig.thruster import T200, SimulatedThruster, ThrusterParameters
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
class BatteryParameters:
    """The 4-cell lithium-ion battery of a BlueROV2, 14.8 V nominal, 18 Ah (maker's data). The resistance, with wiring
    and power module, is assumed: a sag of 1.5 V at 60 A."""

    full_v: float = 16.6
    empty_v: float = 12.0
    capacity_ah: float = 18.0
    resistance_ohm: float = 0.025


class Battery:
    """Voltage that falls with the load at once, and with the charge drawn over time."""

    def __init__(self, parameters: BatteryParameters | None = None) -> None:
        self._parameters = parameters or BatteryParameters()
        self._drawn_ah = 0.0
        self.voltage_v = self._parameters.full_v

    def step(self, current_a: float, period_s: float, sag_v: float = 0.0) -> float:
        """Draw a current for a while; returns the terminal voltage, `sag_v` lower than charge and load make it."""
        parameters = self._parameters
        self._drawn_ah = min(self._drawn_ah + current_a * period_s / 3600.0, parameters.capacity_ah)
        drawn_share = self._drawn_ah / parameters.capacity_ah
        open_circuit_v = parameters.full_v + (parameters.empty_v - parameters.full_v) * drawn_share
        self.voltage_v = max(open_circuit_v - parameters.resistance_ohm * current_a - sag_v, 0.0)
        return self.voltage_v


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """What a vehicle is made of.

    Attributes:
        layout: of the thrusters.
        thrusters: what they are, one for each place in the layout, or one for all of them.
        hull, tilt, battery: see there.

    Raises:
        ValueError: there are more or fewer thrusters than places for them.
    """

    layout: Layout = BLUEROV2_HEAVY
    thrusters: tuple[ThrusterParameters, ...] = (T200,)
    hull: HullParameters = HullParameters()
    tilt: TiltParameters = LIGHT
    battery: BatteryParameters = BatteryParameters()

    def __post_init__(self) -> None:
        if len(self.thrusters) not in (1, len(self.layout)):
            raise ValueError(
                f"{len(self.thrusters)} thrusters: want one for each of {len(self.layout)} places, or one"
            )

    @property
    def each_thruster(self) -> tuple[ThrusterParameters, ...]:
        """One for each place."""
        return self.thrusters if len(self.thrusters) == len(self.layout) else self.thrusters * len(self.layout)


class Vehicle:
    """Thrusters, a battery and a hull, stepped together.

    Args:
        period_s: time from step to step.
        seed: of all sensor noise.
        faults: what happens to which thruster, by its number from 1.
        build: what it is made of.
        water: in which it moves.
        hull_faults: what catches on its hull, or pulls at it.
        sags: of the supply.
        motion: to begin with.

    Attributes:
        layout: of its thrusters.
        thrusters: by their order.
        battery: of all of them.
        hull: as it is.
        clean_hull: as it would move with nothing caught on it, from the same thrusts.

    Raises:
        ValueError: a fault names a thruster that is not there.
    """

    def __init__(
        self,
        period_s: float,
        seed: int,
        faults: Mapping[int, Sequence[InjectedFault]] | None = None,
        build: Build = Build(),
        water: Water = STILL,
        hull_faults: Sequence[HullFault | Pull] = (),
        sags: Sequence[Sag] = (),
        motion: Motion | None = None,
    ) -> None:
        by_thruster = dict(faults or {})
        count = len(build.layout)
        unknown = sorted(set(by_thruster) - set(range(1, count + 1)))
        if unknown:
            raise ValueError(f"faults on thrusters {unknown}: want numbers from 1 to {count}")
        self._period_s = period_s
        self.layout = build.layout
        self._sags = tuple(sags)
        self.thrusters = [
            SimulatedThruster(period_s, seed * count + index, parameters, by_thruster.get(index + 1, ()))
            for index, parameters in enumerate(build.each_thruster)
        ]
        self.battery = Battery(build.battery)
        self.hull = Hull(build.hull, motion, water, hull_faults, build.layout, build.tilt)
        self.clean_hull = Hull(build.hull, motion, water, (), build.layout, build.tilt) if hull_faults else self.hull

    def step(self, time_s: float, commands: Sequence[float], undriven: Collection[int] = ()) -> Motion:
        """Advance by one period.

        Args:
            time_s: since the start.
            commands: one of -1 to 1 per thruster.
            undriven: numbers, from 1, of the thrusters whose ESCs are down.
        """
        supply_v = self.battery.voltage_v
        for number, (thruster, command) in enumerate(zip(self.thrusters, commands, strict=True), start=1):
            thruster.step(time_s, command, supply_v, number not in undriven)
        sag_v = sum(sag.volts(time_s) for sag in self._sags)
        self.battery.step(sum(thruster.state.supply_a for thruster in self.thrusters), self._period_s, sag_v)
        thrusts_n = [thruster.thrust_n for thruster in self.thrusters]
        if self.clean_hull is not self.hull:
            self.clean_hull.step(thrusts_n, self._period_s)
        return self.hull.step(thrusts_n, self._period_s)

"""The whole simulated vehicle in real time: pilot, autopilot, ESCs on a CAN bus, thrusters, battery and hull."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from types import TracebackType
from typing import Any

import can

from hil_tests.rig import acoustic, dvl
from hil_tests.rig.acoustic import AcousticErrors, AcousticSystem
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.autopilot import AutopilotPeer
from hil_tests.rig.commander import Commander
from hil_tests.rig.esc import CommandNode, EscBank, raw_command_filter
from hil_tests.rig.esc_messages import ESC_STATUS_ID, EscReport
from hil_tests.rig.faults import HullFault, InjectedFault
from hil_tests.rig.helm import Course, steer
from hil_tests.rig.instruments import Equipment, Instruments
from hil_tests.rig.navigation import NavigationErrors, NavigationFilter
from hil_tests.rig.notes import Notes
from hil_tests.rig.pilot import WORKING, DrivingStyle, Pilot, Sticks
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Motion, Vehicle, mix
from hil_tests.rig.water import STILL, Water

STEP_S = 0.01
STEPS_PER_REPORT = 2  # commands and reports at 50 Hz
# A fault shows in the speed when it differs by this share from a healthy twin that is not near standstill.
SHOWING_SHARE = 0.05
SHOWING_RPM = 300.0
# What is caught on the hull shows when it has taken this share of the speed through the water.
SLOWED_SHARE = 0.2
SLOWED_MPS = 0.3
STEPS_PER_ESTIMATE = 5  # errors of the navigation filter are drawn anew at 20 Hz
STEPS_PER_MOMENT = 10  # the truth is kept at 10 Hz
# A filter that matches no frame of these nodes: the autopilot's CAN node only sends.
NOTHING = {"can_id": 0x1FFFFFFF, "can_mask": 0x1FFFFFFF, "extended": True}


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the vehicle drives in, and how well it knows where it is.

    Attributes:
        water: with its current.
        hull_faults: what catches on the hull, in seconds since the start.
        navigation: errors of the autopilot's position and heading.
        acoustic: of an acoustic positioning system that speaks GPS_INPUT; None: there is none.
        equipment: IMU, DVL and depth sensor; None: nothing is told of any.
    """

    water: Water = STILL
    hull_faults: Sequence[HullFault] = ()
    navigation: NavigationErrors = NavigationErrors()  # noqa: RUF009  frozen
    acoustic: AcousticErrors | None = None
    equipment: Equipment | None = None


@dataclass(frozen=True, slots=True)
class Moment:
    """How the vehicle really moved at one instant."""

    time_s: float
    motion: Motion


class EmbeddedVehicle:
    """A vehicle for a gateway under test: DroneCAN on a python-can bus, MAVLink over UDP.

    It runs in a thread of its own between `with ...:` and its end, or step by step through `advance`.

    Args:
        interface: python-can's name of the interface, "virtual" or "socketcan".
        channel: of that interface.
        gateway: host and port on which the gateway listens for MAVLink.
        now: clock, in unix seconds; every time that this class takes or gives is of this clock.
        seed: of the pilot and of all noise.
        faults: what happens to which thruster (from 1), in seconds since the start.
        style: how the pilot drives.
        course: headings that the pilot steers; None: the yaw stick is moved like the others.
        surroundings: water, hull and navigation.
        commander: the autopilot; None: an ArduSub.

    Attributes:
        vehicle: thrusters, battery and hull.
        shown_s: when a fault first showed in a thruster's speed, by its number.
        slowed_s: when what is caught on the hull first showed in the speed through the water; NaN: not yet.
        moments: the truth so far, ten times a second.

    Raises:
        ValueError: a fault names a thruster that is not there.
        can.CanError: there is no such bus.
    """

    def __init__(
        self,
        *,
        interface: str,
        channel: str,
        gateway: tuple[str, int],
        now: Callable[[], float],
        seed: int = 0,
        faults: Mapping[int, Sequence[InjectedFault]] | None = None,
        style: DrivingStyle = WORKING,
        course: Course | None = None,
        surroundings: Surroundings = Surroundings(),
        commander: Commander | None = None,
    ) -> None:
        self._now = now
        self._start_s = now()
        self._steps = 0
        self._commands = mix(Sticks())
        self._pilot = Pilot(seed, style)
        self._course = course
        self._commander = commander or ArduSub()
        self.vehicle = Vehicle(STEP_S, seed, faults, water=surroundings.water, hull_faults=surroundings.hull_faults)
        self._navigation = NavigationFilter(surroundings.navigation, seed)
        self._acoustic = AcousticSystem(surroundings.acoustic, seed) if surroundings.acoustic else None
        at_first = self.vehicle.hull.motion
        self._instruments = Instruments(surroundings.equipment, seed, at_first) if surroundings.equipment else None
        self.shown_s: dict[int, float] = {}
        self.slowed_s = nan
        self.moments: list[Moment] = []
        # A real ESC keeps its pace whatever this process does, and the kernel stamps what it sends. So that the
        # scheduler's pauses do not pass for jitter of the motors, frames on a virtual bus bear the rig's own time.
        options: dict[str, Any] = {"preserve_timestamps": True} if interface == "virtual" else {}
        self._buses = [
            can.Bus(channel=channel, interface=interface, can_filters=filters, **options)
            for filters in ([NOTHING], [raw_command_filter()])
        ]
        self._command_node = CommandNode(self._buses[0])
        self._escs = EscBank(self._buses[1], self.vehicle)
        self._autopilot = AutopilotPeer(gateway, self._commander)
        self._error: Exception | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="embedded vehicle", daemon=True)

    @property
    def start_s(self) -> float:
        """When the vehicle started, on the clock that it was given."""
        return self._start_s

    @property
    def notes(self) -> Notes:
        """What the autopilot has received."""
        return self._autopilot.notes

    @property
    def mode(self) -> str:
        """The autopilot's present mode."""
        return self._commander.mode_name

    def __enter__(self) -> EmbeddedVehicle:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop the thread if it runs, and let go of bus and socket.

        Raises:
            RuntimeError: the thread had ended before, by an error.
        """
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()
        self._autopilot.close()
        for bus in self._buses:
            bus.shutdown()
        if self._error is not None:
            raise RuntimeError("the simulated vehicle stopped by itself") from self._error

    def advance(self, time_s: float) -> None:
        """Make all steps that are due by `time_s`, and exchange MAVLink messages."""
        while self._start_s + self._steps * STEP_S <= time_s:
            self._step(self._steps * STEP_S)
        since_start_s, motion = max(self._steps - 1, 0) * STEP_S, self.vehicle.hull.motion
        self._autopilot.exchange(time_s, self._telemetry(since_start_s, motion))
        fix = self._acoustic and self._acoustic.due(since_start_s, time_s, motion)
        if fix:
            self._autopilot.relay(fix, acoustic.COMPONENT_ID)

    def _step(self, since_start_s: float) -> None:
        time_s = self._start_s + since_start_s
        self._commands = mix(self._commander.demand(self._sticks(since_start_s), self.vehicle.hull.motion))
        if self._steps % STEPS_PER_REPORT == 0:
            self._command_node.publish(time_s, self._commands)
        motion = self.vehicle.step(since_start_s, self._escs.commands(time_s))
        if self._steps % STEPS_PER_REPORT == 1:
            self._escs.report(time_s, STEPS_PER_REPORT * STEP_S)
        if self._steps % STEPS_PER_ESTIMATE == 0:
            self._navigation.advance(since_start_s)
        if self._steps % STEPS_PER_MOMENT == 0:
            self.moments.append(Moment(time_s, motion))
        if self._instruments:
            self._measure(self._instruments, time_s, since_start_s, motion)
        self._note_showing(time_s)
        self._steps += 1

    def _telemetry(self, since_start_s: float, motion: Motion) -> Telemetry:
        told = self._esc_reports() if ESC_STATUS_ID in self._commander.streams else ()
        return Telemetry(since_start_s, self._navigation.seen(motion), self._commands, self._instruments, told)

    def _esc_reports(self) -> Sequence[EscReport]:
        """What the ESCs tell the autopilot, which tells it on."""
        measured = [thruster.measure(STEPS_PER_REPORT * STEP_S) for thruster in self.vehicle.thrusters]
        return [EscReport(one.speed_rpm, self.vehicle.battery.voltage_v, one.supply_a) for one in measured]

    def _measure(self, instruments: Instruments, time_s: float, since_start_s: float, motion: Motion) -> None:
        """Let the instruments feel a step, and tell of it at the pace of their own clocks, however late this is."""
        instruments.step(motion, STEP_S)
        self._autopilot.sense(time_s, self._telemetry(since_start_s, motion))
        velocity = instruments.vision_position_delta(since_start_s)
        if velocity:
            self._autopilot.relay(velocity, dvl.COMPONENT_ID, dvl.SYSTEM_ID)

    def _sticks(self, since_start_s: float) -> Sticks:
        sticks = self._pilot.sticks(since_start_s)
        if self._course is None:
            return sticks
        return steer(self._course, since_start_s, sticks, self.vehicle.hull.motion)

    def _note_showing(self, time_s: float) -> None:
        for number, thruster in enumerate(self.vehicle.thrusters, start=1):
            state = thruster.state
            healthy_rpm = abs(state.healthy_rpm)
            off_rpm = abs(state.speed_rpm - state.healthy_rpm)
            if healthy_rpm > SHOWING_RPM and off_rpm > SHOWING_SHARE * healthy_rpm:
                self.shown_s.setdefault(number, time_s)
        if isnan(self.slowed_s) and self._is_slowed():
            self.slowed_s = time_s

    def _is_slowed(self) -> bool:
        clean_mps = self.vehicle.clean_hull.motion.forward_mps
        lost_mps = clean_mps - self.vehicle.hull.motion.forward_mps
        return clean_mps > SLOWED_MPS and lost_mps > SLOWED_SHARE * clean_mps

    def _run(self) -> None:
        try:
            while not self._stop.wait(STEP_S / 2.0):
                self.advance(self._now())
        except Exception as error:  # close() raises it, in the thread that can handle it
            self._error = error

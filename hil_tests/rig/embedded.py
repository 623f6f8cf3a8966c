"""The whole simulated vehicle in real time: pilot, autopilot, ESCs on a CAN bus, thrusters, battery and hull."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any

import can

from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.autopilot import AutopilotPeer, Notes, Telemetry
from hil_tests.rig.esc import CommandNode, EscBank, raw_command_filter
from hil_tests.rig.faults import InjectedFault
from hil_tests.rig.pilot import WORKING, DrivingStyle, Pilot, Sticks
from hil_tests.rig.vehicle import Vehicle, mix

STEP_S = 0.01
STEPS_PER_REPORT = 2  # commands and reports at 50 Hz
# A fault shows in the speed when it differs by this share from a healthy twin that is not near standstill.
SHOWING_SHARE = 0.05
SHOWING_RPM = 300.0
# A filter that matches no frame of these nodes: the autopilot's CAN node only sends.
NOTHING = {"can_id": 0x1FFFFFFF, "can_mask": 0x1FFFFFFF, "extended": True}


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
    ) -> None:
        self._now = now
        self._start_s = now()
        self._steps = 0
        self._commands = mix(Sticks())
        self._pilot = Pilot(seed, style)
        self._ardusub = ArduSub()
        self.vehicle = Vehicle(STEP_S, seed, faults)
        self.shown_s: dict[int, float] = {}
        # A real ESC keeps its pace whatever this process does, and the kernel stamps what it sends. So that the
        # scheduler's pauses do not pass for jitter of the motors, frames on a virtual bus bear the rig's own time.
        options: dict[str, Any] = {"preserve_timestamps": True} if interface == "virtual" else {}
        self._buses = [
            can.Bus(channel=channel, interface=interface, can_filters=filters, **options)
            for filters in ([NOTHING], [raw_command_filter()])
        ]
        self._command_node = CommandNode(self._buses[0])
        self._escs = EscBank(self._buses[1], self.vehicle)
        self._autopilot = AutopilotPeer(gateway, self._ardusub)
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
        return self._ardusub.mode.name

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
        boot_s = max(time_s - self._start_s, 0.0)
        self._autopilot.exchange(time_s, Telemetry(boot_s, self.vehicle.hull.motion, self._commands))

    def _step(self, since_start_s: float) -> None:
        time_s = self._start_s + since_start_s
        sticks = self._pilot.sticks(since_start_s)
        self._commands = mix(self._ardusub.demand(sticks, self.vehicle.hull.motion))
        if self._steps % STEPS_PER_REPORT == 0:
            self._command_node.publish(time_s, self._commands)
        self.vehicle.step(since_start_s, self._escs.commands(time_s))
        if self._steps % STEPS_PER_REPORT == 1:
            self._escs.report(time_s, STEPS_PER_REPORT * STEP_S)
        self._note_showing(time_s)
        self._steps += 1

    def _note_showing(self, time_s: float) -> None:
        for number, thruster in enumerate(self.vehicle.thrusters, start=1):
            state = thruster.state
            healthy_rpm = abs(state.healthy_rpm)
            off_rpm = abs(state.speed_rpm - state.healthy_rpm)
            if healthy_rpm > SHOWING_RPM and off_rpm > SHOWING_SHARE * healthy_rpm:
                self.shown_s.setdefault(number, time_s)

    def _run(self) -> None:
        try:
            while not self._stop.wait(STEP_S / 2.0):
                self.advance(self._now())
        except Exception as error:  # close() raises it, in the thread that can handle it
            self._error = error

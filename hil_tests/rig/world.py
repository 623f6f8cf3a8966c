"""One simulated vehicle with its autopilot and ESCs, in lockstep: told the time, it neither waits nor listens.

What it sends is kept until it is asked for, stamped with the simulation's time: CAN frames of the autopilot and of
the ESCs, one after the other as they fit on the bus, and MAVLink datagrams. What it is to receive is handed to it.
The same scenario, seed and calls give the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivers.can.frame import CanFrame
from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.bus_traffic import BusTraffic, taken
from hil_tests.rig.commander import Commander
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.mission_pilot import MissionPilot
from hil_tests.rig.notes import Notes
from hil_tests.rig.physical import PhysicalFaults, water
from hil_tests.rig.profile import Profile
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.rig.sensing import Sensing
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.truth import ModeChange, Truth, TruthLog
from hil_tests.rig.vehicle import Motion, Vehicle
from hil_tests.scenario.document import Mission, Scenario

ESTIMATE_S = 0.05  # errors of the navigation filter are drawn anew at 20 Hz
MOMENT_S = 0.1  # the truth is kept at 10 Hz
EARLY_S = 1e-6  # times are multiples of a step, and rounded


class World:
    """See the module's text.

    Args:
        scenario: mission, water, physical faults and seed are taken from it; faults on wires are not.
        profile: what the vehicle is.
        start_s: unix seconds; the simulation's time 0.
        autopilot: False: there is a real one. No command and no telemetry come from here then, only the ESCs' frames
            and the messages of sensors that speak for themselves, DVL and acoustic positioning.
        key: 32 bytes that the autopilot signs with; None: it does not.

    Raises:
        ValueError: scenario and profile do not go together: a mode or a thruster that there is not.
    """

    def __init__(
        self,
        scenario: Scenario,
        profile: Profile,
        start_s: float,
        *,
        autopilot: bool = True,
        key: bytes | None = None,
    ) -> None:
        seed, mission = scenario.seed, scenario.mission
        self._start_s, self._step_s, self._steps = start_s, profile.step_s, 0
        self._faults = PhysicalFaults(scenario.faults)
        at_first = Motion(down_m=mission.depth_m)
        self.vehicle = Vehicle(
            profile.step_s,
            seed,
            self._faults.thrusters,
            profile.build(),
            water(scenario.water, self._faults.gusts),
            self._faults.hull,
            self._faults.sags,
            at_first,
        )
        self._mixer = self.vehicle.layout
        self._pilot = MissionPilot(mission, seed, profile.helm)
        self._sensing = Sensing(profile, seed, at_first)
        self._commander = _commander(profile, mission)
        self._has_autopilot = autopilot
        self._datagrams: list[tuple[float, bytes]] = []
        self._now_s = start_s
        self._autopilot = MavlinkAutopilot(self._send, self._commander, key=key)
        self._traffic = BusTraffic(profile, self.vehicle)
        self._silent_until_s = -1.0
        self._commands = [0.0] * len(self.vehicle.thrusters)
        self._log = TruthLog(len(self.vehicle.thrusters))
        self.modes: list[ModeChange] = []
        self._note_mode(start_s)

    @property
    def notes(self) -> Notes:
        """What the autopilot has received."""
        return self._autopilot.notes

    def advance(self, time_s: float) -> None:
        """Make all steps that are due by `time_s`, unix seconds."""
        while (since_s := self._steps * self._step_s) <= time_s - self._start_s + EARLY_S:
            self._step(since_s)
            self._steps += 1

    def sent_by_autopilot(self) -> list[CanFrame]:
        """CAN frames that have been on the bus since this was last asked."""
        return taken(self._traffic.by_autopilot, self._now_s + EARLY_S)

    def sent_by_devices(self) -> list[CanFrame]:
        """The same of the ESCs."""
        return taken(self._traffic.by_devices, self._now_s + EARLY_S)

    def to_devices(self, frames: Sequence[CanFrame]) -> None:
        """CAN frames have come to the ESCs."""
        self._traffic.escs.take(self._now_s, frames)

    def datagrams(self) -> list[tuple[float, bytes]]:
        """MAVLink that has been sent since this was last asked, with its times."""
        sent, self._datagrams = self._datagrams, []
        return sent

    def to_autopilot(self, time_s: float, data: bytes) -> None:
        """MAVLink has come to the autopilot."""
        if self._has_autopilot:
            self._autopilot.receive(time_s, data)
            self._note_mode(time_s)

    def truth(self) -> Truth:
        """What the vehicle has really done so far, at 10 Hz."""
        return self._log.truth()

    def close(self) -> None:
        """There is nothing to let go of."""

    def _step(self, since_s: float) -> None:
        time_s = self._now_s = self._start_s + since_s
        before = self.vehicle.hull.motion
        if self._has_autopilot:
            self._reboot(since_s)
            demand = self._commander.demand(self._pilot.sticks(since_s, before, self._commander), before)
            self._commands = self._mixer.mix(demand)
            if since_s >= self._silent_until_s:
                self._traffic.command(self._steps, time_s, self._commands)
        obeyed = self._traffic.obeyed(time_s)
        down = self._traffic.restart(self._faults, since_s)
        motion = self.vehicle.step(since_s, obeyed, down)
        self._traffic.report(self._steps, time_s, down)
        self._sense(since_s, motion)
        if self._is_due(MOMENT_S):
            self._log.note(time_s, self._commands if self._has_autopilot else obeyed, self.vehicle)
        self._note_mode(time_s)

    def _sense(self, since_s: float, motion: Motion) -> None:
        """Sensors feel the step, and all that is due is told."""
        if self._is_due(ESTIMATE_S):
            self._sensing.filter.advance(since_s)
        for message, component_id, system_id in self._sensing.messages(since_s, self._now_s, motion, self._step_s):
            self._autopilot.relay(message, component_id, system_id)
        if self._has_autopilot:
            seen, escs = self._sensing.filter.seen(motion), self._traffic.reported
            telemetry = Telemetry(since_s, seen, self._commands, self._sensing.instruments, escs)
            self._autopilot.sense(self._now_s, telemetry)
            self._autopilot.advance(self._now_s, telemetry)

    def _reboot(self, since_s: float) -> None:
        while self._faults.reboots and since_s >= self._faults.reboots[0].at_s:
            silent_s = self._faults.reboots.pop(0).silent_s
            self._autopilot.restart(self._now_s, silent_s)
            self._traffic.autopilot.restart()
            self._silent_until_s = since_s + silent_s

    def _send(self, datagram: bytes) -> None:
        self._datagrams.append((self._now_s, bytes(datagram)))

    def _note_mode(self, time_s: float) -> None:
        mode, armed = self._commander.mode_name, self._commander.armed
        if not self.modes or (self.modes[-1].mode, self.modes[-1].armed) != (mode, armed):
            self.modes.append(ModeChange(time_s, mode, armed))

    def _is_due(self, period_s: float) -> bool:
        return self._steps % max(round(period_s / self._step_s), 1) == 0


def _commander(profile: Profile, mission: Mission) -> Commander:
    """The autopilot as the mission begins.

    Raises:
        ValueError: it has no such mode.
    """
    kind: type[ArduSub | Px4] = ArduSub if profile.autopilot == "ardusub" else Px4
    if mission.mode not in kind.modes():
        raise ValueError(f"mode = {mission.mode!r}: want one of {', '.join(kind.modes())}")
    if kind is ArduSub:
        return ArduSub(Mode[mission.mode], mission.armed)
    return Px4(MainMode[mission.mode], mission.armed)

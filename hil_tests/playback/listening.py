"""What is heard of an autopilot that is not simulated here, and what is said to it."""

from __future__ import annotations

from dataclasses import replace

from drivers.mavlink import formats
from drivers.mavlink.autopilot import AUTOPILOT_COMPONENT, AUTOPILOT_INVALID
from drivers.mavlink.frames import Packet
from drivers.mavlink.vehicle import MODE_FLAG_ARMED
from hil_tests.rig import ardusub, px4
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.commands import Result
from hil_tests.rig.conduct import SILENCE, Conduct, Reply
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.notes import Notes
from hil_tests.rig.truth import ModeChange


class HeardModes:
    """The autopilot's modes, as its HEARTBEATs tell them.

    Attributes:
        modes: one more with each change.
        system_id: the autopilot's; 1, which is usual, before it was heard.
    """

    def __init__(self) -> None:
        self.modes: list[ModeChange] = []
        self.system_id = 1

    def take(self, packet: Packet, time_s: float) -> None:
        """A packet of the link; any but an autopilot's HEARTBEAT is passed over."""
        if packet.message_id != formats.HEARTBEAT.message_id or packet.component_id != AUTOPILOT_COMPONENT:
            return
        custom_mode, _, autopilot, base_mode, _, _ = formats.HEARTBEAT.unpack(packet.payload)
        if autopilot == AUTOPILOT_INVALID:
            return
        self.system_id = packet.system_id
        mode, armed = mode_name(autopilot, custom_mode), bool(base_mode & MODE_FLAG_ARMED)
        if not self.modes or (self.modes[-1].mode, self.modes[-1].armed) != (mode, armed):
            self.modes.append(ModeChange(time_s, mode, armed))


class Listener:
    """Notes what is said to the autopilot, and answers nothing.

    Args:
        key: 32 bytes; what is not signed with it is not noted. None: everything is.
    """

    def __init__(self, key: bytes | None = None) -> None:
        self._key = key
        self._autopilot: MavlinkAutopilot | None = None

    @property
    def notes(self) -> Notes:
        """All so far. Results of commands are those that `answered` has told."""
        return Notes() if self._autopilot is None else self._autopilot.notes

    def hear(self, time_s: float, data: bytes, system_id: int) -> None:
        """Something was said to the autopilot of that system id; the first time decides which that is."""
        if self._autopilot is None:
            self._autopilot = MavlinkAutopilot(lambda _: None, ArduSub(), system_id, _Silent(), self._key)
        self._autopilot.receive(time_s, data)

    def answered(self, command: int, result: int) -> None:
        """The autopilot has answered the newest command of that kind; a result that is not known is none."""
        if result not in set(Result):
            return
        commands = self.notes.commands
        for place in range(len(commands) - 1, -1, -1):
            if commands[place].command == command:
                commands[place] = replace(commands[place], result=Result(result))
                return


class _Silent(Conduct):
    """Answers no command."""

    def reply(self, command: int, parameters: tuple[float, ...]) -> Reply | None:
        return SILENCE


def mode_name(autopilot: int, custom_mode: int) -> str:
    """In the autopilot's own words; of one that is not known, the number."""
    if autopilot == ArduSub.autopilot and custom_mode in set(ardusub.Mode):
        return ardusub.Mode(custom_mode).name
    if autopilot == px4.Px4.autopilot and custom_mode >> 16 & 0xFF in set(px4.MainMode):
        return px4.MainMode(custom_mode >> 16 & 0xFF).name
    return str(custom_mode)

"""What a command asks of the vehicle, in the words of scenario files: "hold", "surface", "disarm", ...

The numbers are those by which the simulated autopilots obey, not those by which the gateway asks: a gateway that
mixes up two modes is found out. ArduSub's and PX4's numbers of modes are in one table: 2 holds the depth on both, and
what is MANUAL (1) and POSCTL (3) to PX4 are ACRO and AUTO to ArduSub, which nobody asks for.
"""

from __future__ import annotations

from collections.abc import Mapping

from gateway.supervision.actions import Action
from hil_tests.rig.ardusub import Mode
from hil_tests.rig.commands import Command, whole
from hil_tests.rig.notes import ReceivedCommand
from hil_tests.rig.px4 import MainMode

ARM = "arm"
ANY = "*"

MODES: Mapping[int, Action] = {
    Mode.ALT_HOLD: Action.HOLD,
    Mode.POSHOLD: Action.HOLD,
    Mode.SURFACE: Action.SURFACE,
    Mode.MANUAL: Action.MANUAL,
    MainMode.MANUAL: Action.MANUAL,
    MainMode.ALTCTL: Action.HOLD,
    MainMode.POSCTL: Action.HOLD,
}
OTHERS: Mapping[int, Action] = {
    Command.NAV_LOITER_UNLIM: Action.HOLD,
    Command.NAV_RETURN_TO_LAUNCH: Action.RETURN,
    Command.NAV_LAND: Action.LAND,
    Command.DO_FLIGHTTERMINATION: Action.TERMINATE,
}


def acts(command: ReceivedCommand) -> bool:
    """Whether it is one that makes the vehicle do something; requests for messages are none."""
    return command.command in set(Command)


def word_of(command: ReceivedCommand) -> str:
    """What is asked, e.g. "hold"; "mode 5" or "MAV_CMD 511" where scenario files have no word for it."""
    first, second = (*command.parameters, 0.0, 0.0)[:2]
    match command.command:
        case Command.DO_SET_MODE:
            return MODES.get(whole(second), f"mode {second:g}")
        case Command.COMPONENT_ARM_DISARM:
            return ARM if first else Action.DISARM
        case other:
            return OTHERS.get(other, f"MAV_CMD {other}")


def told(command: ReceivedCommand) -> str:
    """The command and what became of it: "hold (DO_SET_MODE 2), answered ACCEPTED"."""
    answer = "not answered" if command.result is None else f"answered {command.result.name}"
    return f"{word_of(command)}{_in_protocol(command)}, {answer}"


def _in_protocol(command: ReceivedCommand) -> str:
    if not acts(command):
        return ""
    number = f" {command.parameters[1]:g}" if command.command == Command.DO_SET_MODE else ""
    return f" ({Command(command.command).name}{number})"

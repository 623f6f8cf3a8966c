"""Commands to us: an operator's three are taken, all others are answered, and nobody can make us a loud answerer.

Only what is addressed to exactly our system and component is looked at: a command to all components (0) is meant for
others, who have meanings of their own for MAV_CMD_USER_n. In this order:

| what came | what is done |
|---|---|
| the same packet by another route | dropped |
| another command | UNSUPPORTED |
| from a system that is no operator's; not signed where it must be; a parameter out of its range | DENIED |
| acknowledge, accept, mute | a reading, which the pipeline answers |
| of either kind more than `RATE_MAX` in a second | dropped |

A repetition, by a sender that missed the answer, is no other route: it is obeyed and answered again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from typing import Any

from drivers.mavlink.copies import RouteCopies
from drivers.mavlink.formats import COMMAND_INT, COMMAND_LONG
from drivers.mavlink.frames import Packet
from drivers.mavlink.messages import CommandAck, CommandResult
from drivers.mavlink.rate import RateLimit
from drivers.readings import OperatorAct, OperatorRequest

COMMANDS = {message.message_id: message for message in (COMMAND_LONG, COMMAND_INT)}

RATE_MAX = 10
CODE_MAX = 255
DURATION_MAX_S = 86_400.0


class OperatorCommands:
    """COMMAND_LONG and COMMAND_INT to our own component.

    Args:
        operators: system ids whose commands are taken.
        require_signed: True where only signed ones are.
        own_component: our component id.
        drops: counted here by cause.
    """

    def __init__(
        self, operators: Collection[int], require_signed: bool, own_component: int, drops: Counter[str]
    ) -> None:
        self._operators = frozenset(operators)
        self._require_signed = require_signed
        self._own_component = own_component
        self._drops = drops
        self._copies = RouteCopies()
        # apart from each other: strangers who send many must not keep the operator's from being heard
        self._requests, self._refusals = RateLimit(RATE_MAX), RateLimit(RATE_MAX)

    def take(self, packet: Packet, own_system: int | None, time_s: float) -> OperatorRequest | CommandAck | None:
        """What comes of a packet of `COMMANDS`: a request for the pipeline, an answer to send, or nothing."""
        values = COMMANDS[packet.message_id].unpack(packet.payload)
        # both layouts have these three in the same places
        command, system, component = values[7:10]
        if (system, component) != (own_system, self._own_component) or not self._is_news(packet, time_s):
            return None
        refusal = self._refusal(packet, command, values[0], values[1])
        if not (self._requests if refusal is None else self._refusals).admits(time_s):
            self._drops[f"commands beyond {RATE_MAX} a second"] += 1
            return None
        if refusal is None:
            return _request(packet, command, values, time_s)
        result, cause = refusal
        self._drops[cause] += 1
        return CommandAck(command, result, packet.system_id, packet.component_id)

    def _is_news(self, packet: Packet, time_s: float) -> bool:
        """False for what nobody sent, and for a second copy."""
        if packet.system_id == 0:
            self._drops["command from nobody"] += 1
            return False
        if self._copies.repeats(packet, time_s):
            self._drops["command by another route"] += 1
            return False
        return True

    def _refusal(
        self, packet: Packet, command: int, code: float, duration_s: float
    ) -> tuple[CommandResult, str] | None:
        if command not in set(OperatorAct):
            return CommandResult.UNSUPPORTED, "command not supported"
        if packet.system_id not in self._operators:
            return CommandResult.DENIED, "command from no operator"
        if self._require_signed and not packet.signed:
            return CommandResult.DENIED, "command not signed"
        muted = command == OperatorAct.MUTE
        if not (_whole(code) and (not muted or 0.0 <= duration_s <= DURATION_MAX_S)):  # False for NaN
            return CommandResult.DENIED, "command with implausible parameters"
        return None


def _whole(code: float) -> bool:
    return 0.0 <= code <= CODE_MAX and code == int(code)


def _request(packet: Packet, command: int, values: tuple[Any, ...], time_s: float) -> OperatorRequest:
    """Only a mute lasts for a time; the parameter that the other acts do not have may hold anything."""
    act = OperatorAct(command)
    duration_s = values[1] if act is OperatorAct.MUTE else 0.0
    return OperatorRequest(time_s, act, int(values[0]), duration_s, packet.system_id, packet.component_id)

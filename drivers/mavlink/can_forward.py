"""Asking an autopilot to forward one of its CAN buses over MAVLink: MAV_CMD_CAN_FORWARD, and what becomes of it.

ArduPilot forwards one of its buses at a time, to whoever asked last on whichever link, and stops five seconds after
the last request: so it is asked every second, as its own tools do. Times are passed in, nothing waits.

How the bus is follows from what came in the last five seconds, the first that holds:

| came | the bus is |
|---|---|
| no heartbeat of the autopilot, or it restarted | as it was, and asked for anew when there is one |
| a frame of the bus | up: a frame says more than an answer, which may have got lost |
| a refusal, be it older, and no grant since | down, with the reason |
| a grant, and frames of another bus | up, but another program has asked for its own |
| a grant | up, and silent if it ever spoke: another program may have it on another link |
| nothing | down: not answered |
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from drivers.can.frame import CanFrame
from drivers.mavlink.can_filter import filter_messages
from drivers.mavlink.command_exchange import RESULT_WORDS
from drivers.mavlink.forwarded_frames import ForwardedFrame
from drivers.mavlink.messages import CanFilterModify, CommandLong, CommandResult
from drivers.mavlink.streams import AUTOPILOT_PX4
from drivers.readings import (
    AutopilotHeartbeat,
    AutopilotReboot,
    CommandAcknowledgement,
    LinkState,
    Reading,
)

COMMAND_CAN_FORWARD = 32000
PERIOD_S = 1.0
# what was refused is hardly granted before the autopilot was set up anew, and ground stations show each refusal
REFUSED_PERIOD_S = 10.0
SILENCE_S = 5.0

_NOT_FINAL = (CommandResult.IN_PROGRESS, CommandResult.TEMPORARILY_REJECTED)


class CanForward:
    """Keeps one bus forwarded.

    Args:
        link: name of the bus in the configuration.
        bus: of the autopilot, from 1 as its users count.
        ids: what is wanted of it, as of `can_filter.forwarding_ids`; None: all.

    Attributes:
        drops: "frame of another bus".
        refused: MAV_RESULT of a refusal; None: it was granted, or not answered yet.
    """

    def __init__(self, link: str, bus: int, ids: Sequence[int] | None) -> None:
        self._link, self._bus, self._ids = link, bus, ids
        self.drops: Counter[str] = Counter()
        self._autopilot: AutopilotHeartbeat | None = None
        self._due_s = self._asked_s = self._granted_s = self._frame_s = -math.inf
        self._other_bus, self._other_s = 0, -math.inf
        self.refused: int | None = None
        self._anew = True
        self._told: tuple[bool, str] | None = None

    def update(self, readings: Iterable[Reading], time_s: float) -> list[CommandLong | CanFilterModify]:
        """Takes what came in over the MAVLink link, in order, and the time; call at least once a second.

        Returns:
            What to send now, in this order: the filter comes first, or all of a full bus would for a moment.
        """
        for reading in readings:
            self._take(reading)
        if self._autopilot is None or time_s < self._due_s:
            return []
        self._due_s = time_s + (PERIOD_S if self.refused is None else REFUSED_PERIOD_S)
        anew, self._anew = self._anew, False
        return [*self._filter(self._autopilot, self._ids, anew), _request(self._autopilot, self._bus)]

    def frames(self, forwarded: Iterable[ForwardedFrame]) -> list[CanFrame]:
        """Those of the bus; others are counted, and show that somebody else has asked for theirs."""
        ours: list[CanFrame] = []
        for one in forwarded:
            if one.bus == self._bus:
                self._frame_s = one.frame.time_s
                ours.append(one.frame)
            else:
                self._other_bus, self._other_s = one.bus, one.frame.time_s
                self.drops["frame of another bus"] += 1
        return ours

    def state(self, time_s: float) -> LinkState | None:
        """How the bus is, where that has changed since the last time."""
        condition = None if self._autopilot is None else self._condition(self._autopilot, time_s)
        if condition is None or condition == self._told:
            return None
        self._told = condition
        return LinkState(time_s, self._link, *condition)

    def stop(self, time_s: float) -> list[CommandLong | CanFilterModify]:
        """What ends the forwarding, and leaves no filter behind, which others would have, too.

        Nothing where it is not ours to end.
        """
        autopilot, self._autopilot = self._autopilot, None
        if autopilot is None or not self._is_ours(time_s):
            return []
        return [_request(autopilot, 0), *self._filter(autopilot, None, anew=True)]

    def _take(self, reading: Reading) -> None:
        match reading:
            case AutopilotHeartbeat():
                self._heartbeat(reading)
            case AutopilotReboot():
                self._begin(reading.time_s)
            case LinkState(up=False):
                self._autopilot = None
            case CommandAcknowledgement(command=command) if command == COMMAND_CAN_FORWARD:
                self._answered(reading)

    def _heartbeat(self, beat: AutopilotHeartbeat) -> None:
        before, self._autopilot = self._autopilot, beat
        if before is None or before.system_id != beat.system_id or beat.time_s - before.time_s > SILENCE_S:
            self._begin(beat.time_s)

    def _begin(self, time_s: float) -> None:
        self._due_s = self._granted_s = -math.inf
        self._asked_s, self.refused, self._anew = time_s, None, True

    def _answered(self, answer: CommandAcknowledgement) -> None:
        if self._autopilot is None or answer.system_id != self._autopilot.system_id or answer.result in _NOT_FINAL:
            return
        if answer.result == CommandResult.ACCEPTED:
            self._granted_s, self.refused = answer.time_s, None
            self._due_s = min(self._due_s, answer.time_s + PERIOD_S)
        else:
            self.refused = answer.result

    def _condition(self, autopilot: AutopilotHeartbeat, time_s: float) -> tuple[bool, str] | None:
        """(up, detail); None: not known, as it was before. See the module's table."""
        if time_s - autopilot.time_s > SILENCE_S:
            return None
        if time_s - self._frame_s <= SILENCE_S:
            return True, ""
        if self.refused is not None:
            return False, self._why_not(self.refused, autopilot)
        if time_s - self._granted_s <= SILENCE_S:
            return True, self._why_silent(time_s)
        if time_s - max(self._asked_s, self._granted_s) > SILENCE_S:
            return False, "autopilot does not answer"
        return None

    def _why_silent(self, time_s: float) -> str:
        if time_s - self._other_s <= SILENCE_S:
            return f"another program has CAN{self._other_bus} forwarded"
        return "no frames; has another program taken it?" if math.isfinite(self._frame_s) else ""

    def _why_not(self, result: int, autopilot: AutopilotHeartbeat) -> str:
        """Why the bus is not forwarded, in a few words, for whoever can mend it."""
        if result == CommandResult.UNSUPPORTED:
            return f"{'PX4' if autopilot.autopilot == AUTOPILOT_PX4 else 'autopilot'} does not forward CAN"
        if result == CommandResult.FAILED:  # ArduPilot's answer for a bus that it has not opened
            return f"autopilot has no CAN{self._bus} (CAN_P{self._bus}_DRIVER)"
        return f"forwarding {RESULT_WORDS.get(result, f'result {result}')}"

    def _is_ours(self, time_s: float) -> bool:
        return time_s - self._other_s > SILENCE_S >= time_s - max(self._frame_s, self._granted_s)

    def _filter(self, autopilot: AutopilotHeartbeat, ids: Sequence[int] | None, anew: bool) -> list[CanFilterModify]:
        return filter_messages(ids, self._bus, autopilot.system_id, autopilot.component_id, anew=anew)


def _request(autopilot: AutopilotHeartbeat, bus: int) -> CommandLong:
    parameters = (float(bus), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return CommandLong(COMMAND_CAN_FORWARD, parameters, autopilot.system_id, autopilot.component_id)

"""Asks the autopilot for a failsafe action, and sees to it that it answers.

By default nothing is asked: texts are advice. What can be asked of which autopilot is in `COMMANDS`; ArduSub's were
seen to be accepted within 8 ms from a companion (system = vehicle, component 192), PX4's are from its sources. All
can be repeated without harm, so a request that is not answered within 1 s is sent again, up to three times.

Nothing is asked of an autopilot that is not armed, that has not been heard for 5 s, that is in a failsafe of its own
(MAV_STATE_CRITICAL: advise, do not compete), or that was asked less than `interval_s` ago.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from detectors.verdict import Level
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway import texts
from gateway.findings import Finding
from gateway.severity import Severity
from gateway.supervision.autopilots import OWN_FAILSAFE, AutopilotKind, AutopilotWatch, kind_of

ANSWER_S = 1.0
TRIES = 3

MAV_CMD_DO_SET_MODE, MAV_CMD_COMPONENT_ARM_DISARM = 176, 400
CUSTOM_MODE_ENABLED = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
FORCE_DISARM = 21196.0  # PX4 refuses to disarm "in air" without it

# MAV_RESULT; 0 is accepted, 1 temporarily rejected, 5 in progress
RESULT_WORDS: Mapping[int, str] = {2: "denied", 3: "unsupported", 4: "failed", 6: "cancelled"}

JUST_NOW = "asked just now"

_Command = tuple[int, float, float]  # MAV_CMD, param1, param2

COMMANDS: Mapping[tuple[AutopilotKind, str], _Command] = {
    (AutopilotKind.ARDUSUB, "hold"): (MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, 2.0),  # ALT_HOLD
    (AutopilotKind.ARDUSUB, "surface"): (MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, 9.0),  # SURFACE
    (AutopilotKind.ARDUSUB, "manual"): (MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, 19.0),  # MANUAL
    (AutopilotKind.ARDUSUB, "disarm"): (MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 0.0),
    (AutopilotKind.PX4, "hold"): (MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, 2.0),  # ALTCTL
    (AutopilotKind.PX4, "manual"): (MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, 1.0),  # MANUAL
    (AutopilotKind.PX4, "disarm"): (MAV_CMD_COMPONENT_ARM_DISARM, 0.0, FORCE_DISARM),
}


# "none" and "warn" ask for nothing
ACTIONS = frozenset({"none", "warn", *(action for _, action in COMMANDS)})


@dataclass(frozen=True, slots=True)
class _Request:
    """A request under way."""

    label: str
    action: str
    command: CommandLong
    due_s: float


_Outcome = Finding | StatusText | CommandLong


class Failsafe:
    """One request at a time, whatever it is for. See the module's text.

    Args:
        interval_s: never ask again sooner than this.

    Raises:
        ValueError: a negative time.
    """

    def __init__(self, interval_s: float = 60.0) -> None:
        if not interval_s >= 0.0:
            raise ValueError(f"interval_s = {interval_s!r}: want 0 or more seconds")
        self._interval_s = interval_s
        self._request: _Request | None = None
        self._asked_s = -math.inf

    def request(self, time_s: float, label: str, action: str, autopilot: AutopilotWatch) -> list[_Outcome]:
        """Asks for an action because of `label`, or says why not."""
        if action in ("none", "warn"):
            return []
        heard = autopilot.present(time_s)
        obstacle = "autopilot not heard" if heard is None else self._obstacle(time_s, heard, action)
        if heard is None or obstacle is not None:
            # a disarmed vehicle, or one that was just asked, is as the pilot expects it: no text
            told = heard is not None and heard.armed and obstacle != JUST_NOW
            return self._not_sent(time_s, _text(label, action, f"not sent, {obstacle}"), told)
        code, first, second = COMMANDS[kind_of(heard), action]
        parameters = (first, second, 0.0, 0.0, 0.0, 0.0, 0.0)
        command = CommandLong(code, parameters, heard.system_id, heard.component_id)
        self._asked_s = time_s
        self._request = _Request(label, action, command, time_s + ANSWER_S)
        return [self._finding(time_s, Level.SUSPECT, _text(label, action, "asked"), Severity.INFO), command]

    def acknowledge(self, reading: CommandAcknowledgement) -> list[_Outcome]:
        """Takes a COMMAND_ACK: of another command or another system it means nothing."""
        request = self._request
        if request is None or (reading.command, reading.system_id) != (
            request.command.command,
            request.command.target_system,
        ):
            return []
        match reading.result:
            case 0:  # accepted
                return self._close(request, reading.time_s, "accepted", Level.NORMAL, Severity.WARNING)
            case 1:  # temporarily rejected: tried again when it is due
                return []
            case 5:  # in progress: its end is awaited
                self._request = replace(request, due_s=reading.time_s + ANSWER_S)
                return []
        word = RESULT_WORDS.get(reading.result, f"result {reading.result}")
        return self._close(request, reading.time_s, word, Level.SUSPECT, Severity.ERROR)

    def advance(self, time_s: float) -> list[_Outcome]:
        """Takes a tick: a request that is not answered is sent again, and at last given up."""
        request = self._request
        if request is None or time_s < request.due_s:
            return []
        if request.command.confirmation + 1 >= TRIES:
            return self._close(request, time_s, "no answer", Level.SUSPECT, Severity.ERROR)
        command = replace(request.command, confirmation=request.command.confirmation + 1)
        self._request = replace(request, command=command, due_s=time_s + ANSWER_S)
        return [command]

    def _obstacle(self, time_s: float, heard: AutopilotHeartbeat, action: str) -> str | None:
        """Why nothing may be asked now, the weightiest reason first."""
        kind = kind_of(heard)
        reasons = {
            "not armed": not heard.armed,
            f"autopilot {heard.autopilot} unknown": kind is AutopilotKind.OTHER,
            f"{kind} has none": (kind, action) not in COMMANDS,
            "own failsafe active": heard.system_status in OWN_FAILSAFE,
            JUST_NOW: time_s - self._asked_s < self._interval_s,
        }
        return next((reason for reason, stands in reasons.items() if stands), None)

    def _not_sent(self, time_s: float, text: str, told: bool) -> list[_Outcome]:
        finding = self._finding(time_s, Level.UNKNOWN, text, Severity.WARNING)
        return [finding, StatusText(Severity.WARNING, text)] if told else [finding]

    def _close(self, request: _Request, time_s: float, word: str, level: Level, severity: Severity) -> list[_Outcome]:
        self._request = None
        text = _text(request.label, request.action, word)
        return [self._finding(time_s, level, text, severity), StatusText(severity, text)]

    def _finding(self, time_s: float, level: Level, text: str, severity: Severity) -> Finding:
        return Finding(time_s, "failsafe", "vehicle", level, math.nan, text, severity)


def _text(label: str, action: str, word: str) -> str:
    return texts.fitted(f"{label} failsafe {action}: {word}")

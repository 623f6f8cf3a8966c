"""What an operator says of a subject, and the numbers by which he names it in param1 of MAV_CMD_USER_1 to 3.

| number | subject |
|---|---|
| 0 | all |
| 1 to 99 | thruster of that number |
| 101 | vehicle: its speed through the water |
| 102 to 105 | dvl, depth sensor, gyroscope, accelerometer |
| 106 | navigation: what no single sensor can be blamed for |
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import nan
from typing import Any

from detectors.verdict import Level
from drivers.mavlink.messages import CommandAck, CommandResult
from drivers.readings import OperatorAct, OperatorRequest
from gateway.channel import Channel
from gateway.findings import Finding
from gateway.severity import Severity
from gateway.supervisor import Outgoing, Supervisor

ALL = "all"
THRUSTER = "thruster "
THRUSTER_MAX = 99

_NAMED: Mapping[int, str] = {
    0: ALL,
    101: "vehicle",
    102: "dvl",
    103: "depth sensor",
    104: "gyroscope",
    105: "accelerometer",
    106: "navigation",
}
CODES: Mapping[int, str] = {**_NAMED, **{number: f"{THRUSTER}{number}" for number in range(1, THRUSTER_MAX + 1)}}
_CODE_OF: Mapping[str, int] = {subject: code for code, subject in CODES.items()}

MUTE_S = 600.0
MUTE_MAX_S = 86_400.0
# less is said in seconds
MINUTES_FROM_S = 120.0

# who has said it, where it was said on this machine
OWN_OPERATOR = " (gateway tell)"


def subject_of(code: int) -> str | None:
    """The subject of a number, None where no subject has it."""
    return CODES.get(code)


def code_of(subject: str) -> int:
    """The number of a subject as the findings call it, or of "all".

    Raises:
        ValueError: it has none.
    """
    try:
        return _CODE_OF[subject]
    except KeyError:
        wanted = ", ".join(_NAMED.values())
        raise ValueError(f"subject = {subject!r}: want one of {wanted} or thruster 1..99") from None


class OperatorDesk:
    """Does what operators say, and answers them.

    Args:
        channels: of the detectors, by subject.
        supervisor: of all subjects.
    """

    def __init__(self, channels: Mapping[str, Channel[Any]], supervisor: Supervisor) -> None:
        self._channels = channels
        self._supervisor = supervisor

    def take(self, request: OperatorRequest) -> Iterator[Outgoing | CommandAck]:
        """Does what is said; the answer comes last."""
        subjects = self._subjects(request.code)
        if subjects:
            said, outgoing = self._do(request, subjects)
            yield from outgoing
        else:
            said = f"{_name(request.code)} is not watched here"
        yield self._finding(request, said)
        yield from self._supervisor.inform(request.time_s, said)
        result = CommandResult.ACCEPTED if subjects else CommandResult.DENIED
        yield CommandAck(request.act, result, request.system_id, request.component_id)

    def accept(self, subjects: Sequence[str], time_s: float) -> Iterator[Outgoing]:
        """How these are now is their reference from now on."""
        for channel in self._channels.values():
            told = channel.told()
            if set(told) & set(subjects):
                channel.accept()
                yield from self._supervisor.accept(told, time_s)
        yield from self._supervisor.accept(subjects, time_s)

    def _subjects(self, code: int) -> tuple[str, ...]:
        """What a number means here: of all, also links and signals; empty where it is not watched."""
        watched = {one: None for channel in self._channels.values() for one in channel.told()}
        subject = subject_of(code)
        if subject == ALL:
            return tuple(watched | dict.fromkeys(self._supervisor.levels()))
        return (subject,) if subject in watched else ()

    def _do(self, request: OperatorRequest, subjects: Sequence[str]) -> tuple[str, list[Outgoing]]:
        """What was done, in words, and what comes of it. A mute of all is of what nags now, not of what may come."""
        time_s, name = request.time_s, _name(request.code)
        levels = self._supervisor.levels()
        bad = [one for one in subjects if levels.get(one, Level.UNKNOWN) >= Level.SUSPECT]
        match request.act:
            case OperatorAct.ACKNOWLEDGE:
                said = f"{name} acknowledged" if bad else f"{name}: nothing to acknowledge"
                return said, self._supervisor.acknowledge(bad, time_s)
            case OperatorAct.ACCEPT:
                return f"{name} accepted as it is", [*self.accept(subjects, time_s)]
            case OperatorAct.MUTE:
                muted = bad if subject_of(request.code) == ALL else subjects
                duration_s = min(request.duration_s or MUTE_S, MUTE_MAX_S)
                self._supervisor.mute(muted, time_s, duration_s)
                return f"{name} muted for {lasting(duration_s)}" if muted else f"{name}: nothing to mute", []

    def _finding(self, request: OperatorRequest, said: str) -> Finding:
        """Who said what is on record, too."""
        subject = subject_of(request.code) or ALL
        level = self._supervisor.levels().get(subject, Level.UNKNOWN)
        speaker = f" ({request.system_id}/{request.component_id})" if request.system_id else OWN_OPERATOR
        return Finding(request.time_s, "operator", subject, level, nan, said + speaker, Severity.INFO)


def lasting(duration_s: float) -> str:
    """A time in words: `10 min`, `12 s`."""
    return f"{duration_s:.0f} s" if duration_s < MINUTES_FROM_S else f"{duration_s / 60.0:.0f} min"


def _name(code: int) -> str:
    """As in the texts on the subject."""
    subject = subject_of(code)
    if subject is None:
        return f"Subject {code}"
    if subject.startswith(THRUSTER):
        return f"T{code}"
    return {"dvl": "DVL", "vehicle": "Speed"}.get(subject, subject.capitalize())

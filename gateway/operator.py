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
from typing import Any

from detectors.verdict import Level
from drivers.mavlink.messages import CommandAck
from drivers.readings import OperatorAct, OperatorRequest
from gateway.channel import Channel
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

RESULT_ACCEPTED, RESULT_DENIED = 0, 2  # MAV_RESULT


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
            yield from self._do(request, subjects)
        else:
            name = subject_of(request.code) or f"subject {request.code}"
            yield from self._supervisor.inform(request.time_s, f"{name.capitalize()} is not watched here")
        result = RESULT_ACCEPTED if subjects else RESULT_DENIED
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

    def _do(self, request: OperatorRequest, subjects: Sequence[str]) -> Iterator[Outgoing]:
        time_s, name = request.time_s, self._name(request.code)
        match request.act:
            case OperatorAct.ACKNOWLEDGE:
                yield from self._supervisor.acknowledge(subjects, time_s)
                yield from self._supervisor.inform(time_s, f"{name} acknowledged")
            case OperatorAct.ACCEPT:
                yield from self.accept(subjects, time_s)
                yield from self._supervisor.inform(time_s, f"{name} accepted as it is")
            case OperatorAct.MUTE:
                levels = self._supervisor.levels()
                if request.code == 0:  # what nags now, and not what may come
                    subjects = [one for one in subjects if levels.get(one, Level.UNKNOWN) >= Level.SUSPECT]
                duration_s = min(request.duration_s or MUTE_S, MUTE_MAX_S)
                self._supervisor.mute(subjects, time_s, duration_s)
                yield from self._supervisor.inform(time_s, f"{name} muted for {duration_s / 60.0:.0f} min")

    def _name(self, code: int) -> str:
        return (subject_of(code) or ALL).capitalize()

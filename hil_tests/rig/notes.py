"""What arrived at a simulated autopilot, with the time at which it did."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from hil_tests.rig.commands import Result


@dataclass(frozen=True, slots=True)
class ReceivedText:
    """A STATUSTEXT as it arrived at the autopilot."""

    time_s: float
    component_id: int
    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class ReceivedHeartbeat:
    """A HEARTBEAT of a companion as it arrived at the autopilot."""

    time_s: float
    component_id: int
    vehicle_type: int
    system_status: int


@dataclass(frozen=True, slots=True)
class ReceivedCommand:
    """A COMMAND_LONG as it arrived at the autopilot, and the result it was answered with; None: not answered."""

    time_s: float
    component_id: int
    command: int
    parameters: tuple[float, ...]
    result: Result | None
    confirmation: int = 0


@dataclass(frozen=True, slots=True)
class ReceivedValue:
    """A NAMED_VALUE_FLOAT as it arrived at the autopilot."""

    time_s: float
    value: float


@dataclass(slots=True)
class Notes:
    """Everything that was received, in order of arrival.

    Attributes:
        texts, heartbeats, commands: what these brought.
        values: NAMED_VALUE_FLOATs, by their names.
        counts: messages by name; BAD_DATA are those that were broken, or not rightly signed.
        clock_answers: answers to the autopilot's own TIMESYNC requests.
    """

    texts: list[ReceivedText] = field(default_factory=list)
    heartbeats: list[ReceivedHeartbeat] = field(default_factory=list)
    commands: list[ReceivedCommand] = field(default_factory=list)
    values: dict[str, list[ReceivedValue]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    clock_answers: int = 0

"""What the gateway says on a MAVLink link. These messages, and no others: what has no class here cannot be sent.

Never sent, on purpose: SYS_STATUS (ArduSub reads an unhealthy bit in it as a leak), SETUP_SIGNING, and a forced arm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

TEXT_MAX = 50  # STATUSTEXT.text; longer ones go out in chunks that ArduSub logs and forwards one by one, never joined
LONG_TEXT_MAX = 200
NAME_MAX = 10  # NAMED_VALUE_FLOAT.name
SEVERITY_MAX = 7  # MAV_SEVERITY_DEBUG
FLOAT32_MAX = 3.4028234663852886e38
UINT32_MAX = 2**32 - 1
FILTER_IDS_MAX = 16  # CAN_FILTER_MODIFY.ids
CAN_BUSES_MAX = 9  # of an autopilot; ArduPilot's boards have up to three

COMMAND_ARM_DISARM = 400  # MAV_CMD_COMPONENT_ARM_DISARM
FORCE_ARM = 2989.0  # its param2: arm whatever the checks say


class CommandResult(IntEnum):
    """MAV_RESULT: what becomes of a command."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6


class CompanionState(IntEnum):
    """MAV_STATE of this onboard computer."""

    BOOT = 1  # nothing is known of anything yet
    ACTIVE = 4
    CRITICAL = 5  # a fault lasts


@dataclass(frozen=True, slots=True)
class CompanionHeartbeat:
    """HEARTBEAT of this onboard computer."""

    state: CompanionState


@dataclass(frozen=True, slots=True)
class StatusText:
    """A line for the pilot.

    Attributes:
        severity: MAV_SEVERITY, 0 (emergency) to 7 (debug).
        text: 1 to 200 printable ASCII characters; beyond 50 it goes out in chunks. A trailing tab would make
            QGroundControl drop it as the twin of an event, so control characters are refused altogether.

    Raises:
        ValueError: severity or text out of these bounds.
    """

    severity: int
    text: str

    def __post_init__(self) -> None:
        if not 0 <= self.severity <= SEVERITY_MAX:
            raise ValueError(f"severity must lie in 0..{SEVERITY_MAX} (MAV_SEVERITY), got {self.severity}")
        if not 1 <= len(self.text) <= LONG_TEXT_MAX:
            raise ValueError(f"text must have 1..{LONG_TEXT_MAX} characters, got {len(self.text)}: {self.text!r}")
        if not (self.text.isascii() and self.text.isprintable()):
            raise ValueError(f"text must be printable ASCII, got {self.text!r}")


@dataclass(frozen=True, slots=True)
class CommandLong:
    """COMMAND_LONG to one component of one vehicle.

    Attributes:
        command: MAV_CMD.
        parameters: param1..param7; NaN is "not given" where the command says so.
        target_system: the vehicle, 1..254. Not 0: a broadcast could disarm a neighbour.
        target_component: 1 is the autopilot.
        confirmation: 0 at first, one more at each repetition.

    Raises:
        ValueError: out of these bounds, a parameter beyond a 32-bit float, or a forced arm.
    """

    command: int
    parameters: tuple[float, float, float, float, float, float, float]
    target_system: int
    target_component: int = 1
    confirmation: int = 0

    def __post_init__(self) -> None:
        for name, value, lowest, highest in (
            ("command", self.command, 1, 65535),
            ("target_system", self.target_system, 1, 254),
            ("target_component", self.target_component, 0, 255),
            ("confirmation", self.confirmation, 0, 255),
        ):
            if not lowest <= value <= highest:
                raise ValueError(f"{name} must lie in {lowest}..{highest}, got {value}")
        if len(self.parameters) != 7:
            raise ValueError(f"parameters must be seven numbers, got {self.parameters}")
        if any(abs(parameter) > FLOAT32_MAX for parameter in self.parameters):
            raise ValueError(f"parameters must be NaN or fit a 32-bit float, got {self.parameters}")
        if self.command == COMMAND_ARM_DISARM and self.parameters[1] == FORCE_ARM:
            raise ValueError(
                f"the gateway never forces an arm, got parameters[1] = {FORCE_ARM:.0f} with command {self.command}"
            )


@dataclass(frozen=True, slots=True)
class CommandAck:
    """COMMAND_ACK: the answer to a command that was sent to this component.

    Attributes:
        command: MAV_CMD.
        result: MAV_RESULT.
        target_system, target_component: who sent the command; 0, 0 is this machine's own operator (`gateway tell`),
            whose answers go nowhere over MAVLink.
    """

    command: int
    result: int
    target_system: int
    target_component: int


@dataclass(frozen=True, slots=True)
class NamedValue:
    """NAMED_VALUE_FLOAT: a number for ground stations to plot.

    Attributes:
        name: 1 to 10 printable ASCII characters.
        value: finite.
        boot_s: since the gateway began.

    Raises:
        ValueError: name or value out of these bounds.
    """

    name: str
    value: float
    boot_s: float

    def __post_init__(self) -> None:
        if not (1 <= len(self.name) <= NAME_MAX and self.name.isascii() and self.name.isprintable()):
            raise ValueError(f"name must be 1..{NAME_MAX} printable ASCII characters, got {self.name!r}")
        if not abs(self.value) <= FLOAT32_MAX:
            raise ValueError(f"value must be finite and fit a 32-bit float, got {self.value}")


@dataclass(frozen=True, slots=True)
class TimeSync:
    """TIMESYNC: asks for another clock, or answers who asked for ours.

    Attributes:
        answered_ns: the clock that answers; 0 in a question.
        asked_ns: the clock that asked, when it did.
        target_system, target_component: who is asked, or who asked.
    """

    answered_ns: int
    asked_ns: int
    target_system: int
    target_component: int


@dataclass(frozen=True, slots=True)
class ComputerStatus:
    """ONBOARD_COMPUTER_STATUS: how the machine is that we run on. None and empty: not known.

    Attributes:
        unix_s: now.
        uptime_s: since that machine booted.
        cpu_percent: load of each core, of the first eight.
        core_celsius: temperatures of its processor, of the first eight sensors.
        memory_mib, storage_mib: (used, in all).

    Raises:
        ValueError: a number that is not finite, or does not fit its field.
    """

    unix_s: float
    uptime_s: float
    cpu_percent: tuple[float, ...] = ()
    core_celsius: tuple[float, ...] = ()
    memory_mib: tuple[int, int] | None = None
    storage_mib: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        for name, value in (("unix_s", self.unix_s), ("uptime_s", self.uptime_s)):
            if not 0.0 <= value < math.inf:
                raise ValueError(f"{name} must be finite and not negative, got {value}")
        if not all(map(math.isfinite, (*self.cpu_percent, *self.core_celsius))):
            raise ValueError(f"loads and temperatures must be finite, got {self.cpu_percent}, {self.core_celsius}")
        for name, pair in (("memory_mib", self.memory_mib), ("storage_mib", self.storage_mib)):
            if pair is not None and not all(0 <= size < UINT32_MAX for size in pair):
                raise ValueError(f"{name} must lie in 0..{UINT32_MAX - 1}, got {pair}")


class FilterOperation(IntEnum):
    """CAN_FILTER_OP: what becomes of the ids that the autopilot has."""

    REPLACE = 0
    ADD = 1
    REMOVE = 2


@dataclass(frozen=True, slots=True)
class CanFilterModify:
    """CAN_FILTER_MODIFY: which frames the autopilot forwards of its CAN buses. It has one list for all of them.

    Attributes:
        bus: one of the autopilot's, from 1. Not 0: ArduPilot takes that for a bus before its first.
        operation: what becomes of the ids that it has.
        ids: at most 16, 16 bits each, see `drivers.mavlink.can_filter`; none, with REPLACE: all frames are forwarded.
        target_system, target_component: the autopilot.

    Raises:
        ValueError: out of these bounds.
    """

    bus: int
    operation: FilterOperation
    ids: tuple[int, ...]
    target_system: int
    target_component: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.bus <= CAN_BUSES_MAX:
            raise ValueError(f"bus must lie in 1..{CAN_BUSES_MAX}, got {self.bus}")
        if len(self.ids) > FILTER_IDS_MAX:
            raise ValueError(f"ids must be at most {FILTER_IDS_MAX}, got {len(self.ids)}")
        if not all(0 <= one <= 0xFFFF for one in self.ids):
            raise ValueError(f"ids must lie in 0..65535, got {self.ids}")


OutgoingMessage = (
    CompanionHeartbeat
    | StatusText
    | CommandLong
    | CommandAck
    | NamedValue
    | TimeSync
    | ComputerStatus
    | CanFilterModify
)

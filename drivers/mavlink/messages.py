"""What the gateway says on a MAVLink link. Three messages, and no others: what has no class here cannot be sent.

Never sent, on purpose: SYS_STATUS (ArduSub reads an unhealthy bit in it as a leak), SETUP_SIGNING, and a forced arm.
"""

from __future__ import annotations

from dataclasses import dataclass

TEXT_MAX = 50  # STATUSTEXT.text; longer ones go out in chunks that ArduSub logs and forwards one by one, never joined
SEVERITY_MAX = 7  # MAV_SEVERITY_DEBUG
FLOAT32_MAX = 3.4028234663852886e38

COMMAND_ARM_DISARM = 400  # MAV_CMD_COMPONENT_ARM_DISARM
FORCE_ARM = 2989.0  # its param2: arm whatever the checks say


@dataclass(frozen=True, slots=True)
class CompanionHeartbeat:
    """HEARTBEAT of this onboard computer.

    Attributes:
        critical: True while a fault lasts: MAV_STATE_CRITICAL instead of MAV_STATE_ACTIVE.
    """

    critical: bool


@dataclass(frozen=True, slots=True)
class StatusText:
    """A line for the pilot.

    Attributes:
        severity: MAV_SEVERITY, 0 (emergency) to 7 (debug).
        text: 1 to 50 printable ASCII characters. A trailing tab would make QGroundControl drop it as the twin of an
            event, so control characters are refused altogether.

    Raises:
        ValueError: severity or text out of these bounds.
    """

    severity: int
    text: str

    def __post_init__(self) -> None:
        if not 0 <= self.severity <= SEVERITY_MAX:
            raise ValueError(f"severity must lie in 0..{SEVERITY_MAX} (MAV_SEVERITY), got {self.severity}")
        if not 1 <= len(self.text) <= TEXT_MAX:
            raise ValueError(f"text must have 1..{TEXT_MAX} characters, got {len(self.text)}: {self.text!r}")
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


OutgoingMessage = CompanionHeartbeat | StatusText | CommandLong

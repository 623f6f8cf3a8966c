"""A thruster behind a DroneCAN ESC: what its commands and its speeds mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from drivers.can.dronecan.setpoints import COMMAND_MAX, RAW_COMMAND, SETPOINTS_MAX, Setpoints
from drivers.can.dronecan.transfer import NODE_ID_MAX
from drivers.command import CommandScale


@dataclass(frozen=True, slots=True)
class DroneCanThruster:
    """One thruster behind a DroneCAN ESC.

    Attributes:
        thruster: number of the thruster in the configuration, from 1.
        esc_index: place in RawCommand or RPMCommand, and esc_index in Status, from 0.
        bidirectional_command: True: -8191..8191 with neutral 0, or 0..8191 of a thruster that has one direction.
            False: 0..8191 with neutral at half scale, as ArduPilot sends it without the ESC's bit in
            CAN_Dx_UC_ESC_RV; there a RawCommand with nothing but zeros means disarmed and is read as neutral.
        reverse: True where positive commands and speeds drive astern.
        signed: False for an ESC that never reports a negative speed: the magnitude is reported.
        node_id: only Status from this node counts; None: from any, the first that claims the esc_index.
        maximum_rpm: the thruster is commanded by RPMCommand, and this speed is full thrust; None: by RawCommand.

    Raises:
        ValueError: a number out of range, or an RPMCommand that is not bidirectional.
    """

    thruster: int
    esc_index: int
    bidirectional_command: bool = True
    reverse: bool = False
    signed: bool = True
    node_id: int | None = None
    maximum_rpm: float | None = None

    def __post_init__(self) -> None:
        if self.thruster < 1:
            raise ValueError(f"thruster must be at least 1, got {self.thruster}")
        if not 0 <= self.esc_index < SETPOINTS_MAX:
            raise ValueError(f"esc_index must lie in 0..{SETPOINTS_MAX - 1}, got {self.esc_index}")
        if self.node_id is not None and not 1 <= self.node_id <= NODE_ID_MAX:
            raise ValueError(f"node_id must lie in 1..{NODE_ID_MAX}, got {self.node_id}")
        if self.maximum_rpm is not None and not self.maximum_rpm > 0.0:
            raise ValueError(f"maximum_rpm must be positive, got {self.maximum_rpm}")
        if self.maximum_rpm is not None and not self.bidirectional_command:
            raise ValueError("bidirectional_command must be True where maximum_rpm is given: 0 rpm is neutral")

    @property
    def scale(self) -> CommandScale:
        """Of the numbers in RawCommand or RPMCommand; of RawCommand while the vehicle is not disarmed."""
        if self.maximum_rpm is not None:
            return CommandScale(-self.maximum_rpm, 0.0, self.maximum_rpm, reverse=self.reverse)
        if self.bidirectional_command:
            return CommandScale(-COMMAND_MAX, 0.0, COMMAND_MAX, reverse=self.reverse)
        # Neutral 1500 us becomes 4095 of 0..8191 where the autopilot is not told that the ESC turns both ways.
        return CommandScale(0.0, COMMAND_MAX / 2.0, COMMAND_MAX, dead_band=1.0, reverse=self.reverse)

    def speed_rpm(self, reported_rpm: int) -> float:
        """Reported speed, positive ahead; the magnitude where the ESC knows no sign."""
        if not self.signed:
            return float(abs(reported_rpm))
        return float(-reported_rpm if self.reverse else reported_rpm)


@lru_cache(maxsize=8)
def raw_fractions(scale: CommandScale) -> list[float | None]:
    """What each of the 16384 words of a RawCommand means as -1.0..1.0; None: out of range."""
    return [scale.fraction(RAW_COMMAND.number(word)) for word in range(1 << RAW_COMMAND.bits)]


def commanded_by(thrusters: Sequence[DroneCanThruster], message: Setpoints) -> list[DroneCanThruster]:
    """Those whose commands come in this message, ascending by number."""
    raw = message is RAW_COMMAND
    return sorted(
        (one for one in thrusters if (one.maximum_rpm is None) == raw), key=lambda thruster: thruster.thruster
    )

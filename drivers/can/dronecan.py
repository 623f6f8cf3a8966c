"""DroneCAN ESCs: esc.RawCommand and esc.Status to readings, and back for the rig.

Listening only: the decoder has no node id, and nothing is sent unless the caller sends what the encoders return.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivers.can.dronecan_esc import (
    COMMAND_MAX,
    COMMANDS_MAX,
    ESC_STATUS,
    RAW_COMMAND,
    EscStatus,
    encode_esc_status,
    encode_raw_command,
    unpack_commands,
    unpack_status,
)
from drivers.can.dronecan_transfer import MESSAGE_MASK, NODE_ID_MAX, SOURCE_MASK, TransferReceiver
from drivers.can.frame import CanFilter, CanFrame
from drivers.command import CommandScale
from drivers.readings import Reading, ThrusterCommand, ThrusterReport

__all__ = ["DroneCanDecoder", "DroneCanThruster", "EscStatus", "encode_esc_status", "encode_raw_command"]

# No propeller in water turns nearly as fast: above are sentinels (65535 = unknown), ERPM taken for RPM, and garbage.
SPEED_LIMIT_RPM = 30_000.0
# A node is offline after this silence (DroneCAN NodeStatus.OFFLINE_TIMEOUT_MS), and another may take its place.
NODE_TIMEOUT_S = 3.0

_SIGNED = CommandScale(-COMMAND_MAX, 0.0, COMMAND_MAX)
# Neutral 1500 us becomes 4095 of 0..8191 where the autopilot is not told that the ESC turns both ways.
_HALF_SCALE = CommandScale(0.0, COMMAND_MAX / 2.0, COMMAND_MAX, dead_band=1.0)


@dataclass(frozen=True, slots=True)
class DroneCanThruster:
    """One thruster behind a DroneCAN ESC.

    Attributes:
        thruster: number of the thruster in the configuration, from 1.
        esc_index: place in RawCommand, and esc_index in Status, from 0.
        bidirectional_command: True: -8191..8191 with neutral 0, or 0..8191 of a thruster that has one direction.
            False: 0..8191 with neutral at half scale, as ArduPilot sends it without the ESC's bit in
            CAN_Dx_UC_ESC_RV; there a RawCommand with nothing but zeros means disarmed and is read as neutral.
        reverse: True where positive commands and speeds drive astern.
        signed: False for an ESC that never reports a negative speed: the magnitude is reported.
        node_id: only Status from this node counts; None: from any, the first that claims the esc_index.

    Raises:
        ValueError: a number out of range.
    """

    thruster: int
    esc_index: int
    bidirectional_command: bool = True
    reverse: bool = False
    signed: bool = True
    node_id: int | None = None

    def __post_init__(self) -> None:
        if self.thruster < 1:
            raise ValueError(f"thruster must be at least 1, got {self.thruster}")
        if not 0 <= self.esc_index < COMMANDS_MAX:
            raise ValueError(f"esc_index must lie in 0..{COMMANDS_MAX - 1}, got {self.esc_index}")
        if self.node_id is not None and not 1 <= self.node_id <= NODE_ID_MAX:
            raise ValueError(f"node_id must lie in 1..{NODE_ID_MAX}, got {self.node_id}")

    def fraction(self, command: int, disarmed: bool) -> float | None:
        """A raw command as -1.0..1.0; None where it is out of range. `disarmed`: its whole message is zeros."""
        if self.bidirectional_command:
            fraction = _SIGNED.fraction(command)
        else:
            fraction = 0.0 if disarmed else _HALF_SCALE.fraction(command)
        return -fraction if self.reverse and fraction else fraction

    def speed_rpm(self, reported_rpm: int) -> float:
        """Reported speed, positive ahead; the magnitude where the ESC knows no sign."""
        if not self.signed:
            return float(abs(reported_rpm))
        return float(-reported_rpm if self.reverse else reported_rpm)


class _Claims:
    """Who speaks for what: the first node, until it has been silent for long enough."""

    def __init__(self) -> None:
        self._owners: dict[int, tuple[int, float]] = {}

    def admits(self, claim: int, node: int, time_s: float) -> bool:
        owner, last_s = self._owners.get(claim, (node, time_s))
        if owner != node and 0.0 <= time_s - last_s < NODE_TIMEOUT_S:
            return False
        self._owners[claim] = (node, time_s)
        return True


class DroneCanDecoder:
    """Frames of a DroneCAN bus to commands and reports of its thrusters.

    Causes counted in `drops`, beside those of the transfer layer ("CRC", "toggle", "missing start", "transfer id",
    "repeated transfer", "repeated frame", "unfinished transfer", "timed out", "wrong length", "empty frame"):
    "CAN FD", "anonymous node", "unknown node" (not the node_id of the configuration), "unknown ESC" (an esc_index
    that is not in the configuration), "duplicate source" (a second node claims an esc_index or commands the
    thrusters), "command missing" (RawCommand too short for an ESC), "command out of range", "implausible speed",
    "non-finite" (an infinite voltage, current or temperature; NaN means unknown and is not counted). Of a Status with
    one bad field only that field is lost.

    Args:
        thrusters: what is wired to the bus.
        speed_limit_rpm: a faster report is implausible.

    Raises:
        ValueError: two thrusters with one number or one esc_index, or a limit that is not positive.
    """

    def __init__(self, thrusters: Sequence[DroneCanThruster], speed_limit_rpm: float = SPEED_LIMIT_RPM) -> None:
        if not speed_limit_rpm > 0.0:
            raise ValueError(f"speed_limit_rpm must be positive, got {speed_limit_rpm}")
        _refuse_twins("thruster", [thruster.thruster for thruster in thrusters])
        _refuse_twins("esc_index", [thruster.esc_index for thruster in thrusters])
        self.drops: Counter[str] = Counter()
        self._speed_limit_rpm = speed_limit_rpm
        self._by_index = {thruster.esc_index: thruster for thruster in thrusters}
        self._commanders = _Claims()
        self._reporters = _Claims()
        self._receivers: dict[int, TransferReceiver] = {}
        self._readers: dict[int, Callable[[bytes, int, float], Sequence[Reading]]] = {
            RAW_COMMAND.key: self._read_commands,
            ESC_STATUS.key: self._read_status,
        }

    def filters(self) -> list[CanFilter]:
        """esc.RawCommand and esc.Status."""
        return [RAW_COMMAND.filter(), ESC_STATUS.filter()]

    def decode(self, frame: CanFrame) -> Sequence[Reading]:
        """Readings of the transfer that this frame completes; empty otherwise."""
        key = frame.identifier & MESSAGE_MASK
        read = self._readers.get(key)
        if read is None or not frame.extended or frame.error:
            return ()
        source = frame.identifier & SOURCE_MASK
        if frame.fd or source == 0:
            return self._drop("CAN FD" if frame.fd else "anonymous node")
        payload = self._receiver(key, source).accept(frame)
        return () if payload is None else read(payload, source, frame.time_s)

    def _receiver(self, key: int, source: int) -> TransferReceiver:
        receiver = self._receivers.get(key | source)
        if receiver is None:
            data_type = RAW_COMMAND if key == RAW_COMMAND.key else ESC_STATUS
            receiver = self._receivers[key | source] = TransferReceiver(data_type, self.drops)
        return receiver

    def _drop(self, cause: str) -> Sequence[Reading]:
        self.drops[cause] += 1
        return ()

    def _read_commands(self, payload: bytes, source: int, time_s: float) -> Sequence[Reading]:
        commands = unpack_commands(payload)
        if commands is None:
            return self._drop("wrong length")
        if not self._commanders.admits(0, source, time_s):
            return self._drop("duplicate source")
        disarmed = not any(commands)
        readings: list[Reading] = []
        for index, thruster in self._by_index.items():
            fraction = thruster.fraction(commands[index], disarmed) if index < len(commands) else None
            if fraction is None:
                self.drops["command out of range" if index < len(commands) else "command missing"] += 1
            else:
                readings.append(ThrusterCommand(time_s, thruster.thruster, fraction))
        return readings

    def _read_status(self, payload: bytes, source: int, time_s: float) -> Sequence[Reading]:
        status = unpack_status(payload)
        if status is None:
            return self._drop("wrong length")
        thruster = self._by_index.get(status.esc_index)
        if thruster is None:
            return self._drop("unknown ESC")
        if thruster.node_id not in (None, source):
            return self._drop("unknown node")
        if not self._reporters.admits(status.esc_index, source, time_s):
            return self._drop("duplicate source")
        return (self._report(thruster, status, time_s),)

    def _report(self, thruster: DroneCanThruster, status: EscStatus, time_s: float) -> ThrusterReport:
        return ThrusterReport(
            time_s,
            thruster.thruster,
            speed_rpm=self._speed(thruster, status.speed_rpm),
            # An ESC that speaks has a supply and is warmer than 0 K: zero stands for "no sensor".
            voltage_v=self._measured(status.voltage_v, above=0.0),
            current_a=self._measured(status.current_a),
            temperature_k=self._measured(status.temperature_k, above=0.0),
            error_count=status.error_count,
        )

    def _speed(self, thruster: DroneCanThruster, reported_rpm: int) -> float | None:
        if abs(reported_rpm) > self._speed_limit_rpm or abs(reported_rpm) == 0xFFFF:
            self.drops["implausible speed"] += 1
            return None
        return thruster.speed_rpm(reported_rpm)

    def _measured(self, value: float, above: float = -math.inf) -> float | None:
        if math.isinf(value):
            self.drops["non-finite"] += 1
            return None
        return value if value > above else None  # None for NaN, too


def _refuse_twins(name: str, numbers: list[int]) -> None:
    twins = [number for number, count in Counter(numbers).items() if count > 1]
    if twins:
        raise ValueError(f"{name} must differ from thruster to thruster, got {twins[0]} more than once")

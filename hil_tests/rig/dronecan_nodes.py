"""Simulated DroneCAN nodes: ESCs, and the autopilot that commands them. Frames in, frames out; no bus, no clock.

They speak through the `dronecan` package, a stack that shares no line with the gateway's own decoder: what the two
understand of each other is the specification. Its `Node` and drivers are not used, for they want sockets and a thread
each; its data types and transfers are. To make a message takes the package longer than to send it, so that a node has
one of each kind and changes what has changed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from math import inf
from typing import Any

import dronecan
from dronecan import transport

from drivers.can.frame import CanFrame
from hil_tests.rig.bus_clock import Unsent
from hil_tests.rig.esc_messages import EscReport

RAW_COMMAND = dronecan.uavcan.equipment.esc.RawCommand
ESC_STATUS = dronecan.uavcan.equipment.esc.Status
NODE_STATUS = dronecan.uavcan.protocol.NodeStatus
RAW_FULL_SCALE = 8191  # int14, uavcan.equipment.esc.RawCommand
MESSAGE_PRIORITY = 20
# Bits of a message frame's identifier: priority 24-28, data type 8-23, service or message 7, source node 0-6.
MESSAGE_TYPE_MASK = 0x00FFFF80
RAW_COMMAND_BITS = RAW_COMMAND.default_dtid << 8
AUTOPILOT_NODE = 10
FIRST_ESC_NODE = 11
NODE_STATUS_PERIOD_S = 1.0
HOLD_S = 0.5
MOST_PERCENT = 127  # uint7, esc.Status.power_rating_pct
TRANSFER_IDS = 32
# What the package raises of wrong bytes: a payload that is too short, a frame without its last byte, and all else
BROKEN = (transport.TransferError, ValueError, IndexError)


class DroneCanNode:
    """What every node has: an id, transfer ids that it counts on, and a status that it tells once a second.

    Args:
        node_id: 1 to 127.
    """

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self._next_transfer_id: Counter[int] = Counter()
        self._status = NODE_STATUS()
        self._status.mode = self._status.MODE_OPERATIONAL
        self._started_s: float | None = None
        self._status_s = -inf

    def restart(self) -> None:
        """It forgets what it has counted; it is up again with the next thing that it says."""
        self._next_transfer_id.clear()
        self._started_s = None

    def frames(self, message: Any) -> list[Unsent]:
        """A message of the package, broadcast."""
        data_type_id = transport.get_dronecan_data_type(message).default_dtid
        transfer = transport.Transfer(
            payload=message,
            source_node_id=self.node_id,
            transfer_id=self._next_transfer_id[data_type_id],
            transfer_priority=MESSAGE_PRIORITY,
        )
        self._next_transfer_id[data_type_id] = (self._next_transfer_id[data_type_id] + 1) % TRANSFER_IDS
        return [Unsent(frame.message_id, bytes(frame.bytes)) for frame in transfer.to_frames()]

    def status(self, time_s: float) -> list[Unsent]:
        """uavcan.protocol.NodeStatus if it is due: once a second since the node has been up."""
        if self._started_s is None:
            self._started_s = self._status_s = time_s
        if time_s < self._status_s:
            return []
        self._status_s += NODE_STATUS_PERIOD_S
        self._status.uptime_sec = int(time_s - self._started_s)
        return self.frames(self._status)


class DroneCanCommander:
    """The autopilot's node: esc.RawCommand for all ESCs at once.

    Args:
        indexes: place of each thruster's command in the message.
        node_id: its own.
    """

    def __init__(self, indexes: Sequence[int], node_id: int = AUTOPILOT_NODE) -> None:
        self._node = DroneCanNode(node_id)
        self._indexes = tuple(indexes)
        self._raw = [0] * (max(indexes) + 1)
        self._message = RAW_COMMAND(cmd=self._raw)

    def publish(self, time_s: float, commands: Sequence[float]) -> list[Unsent]:
        """One command of -1 to 1 per thruster, and the node's own status when it is due."""
        for index, command in zip(self._indexes, commands, strict=True):
            raw = round(command * RAW_FULL_SCALE)
            if raw != self._raw[index]:
                self._raw[index] = self._message.cmd[index] = raw
        return self._node.frames(self._message) + self._node.status(time_s)

    def restart(self) -> None:
        """The autopilot has rebooted."""
        self._node.restart()


class DroneCanReceiver:
    """Puts frames together to the package's transfers.

    Attributes:
        dropped: transfers that were broken.
    """

    def __init__(self) -> None:
        self._transfers = transport.TransferManager()
        self.dropped = 0

    def take(self, identifier: int, data: bytes) -> Any | None:
        """A frame with 29-bit identifier; the transfer that it completes, or None."""
        try:
            frames = self._transfers.receive_frame(transport.Frame(identifier, data))
            return self._transfer(frames) if frames else None
        except BROKEN:
            self.dropped += 1
            return None

    def _transfer(self, frames: Sequence[transport.Frame]) -> Any:
        transfer = transport.Transfer()
        transfer.from_frames(frames)
        return transfer


class DroneCanEscs:
    """ESC nodes: obey the newest esc.RawCommand, report esc.Status each.

    Without a command for `HOLD_S` they stop, as real ESCs do.

    Args:
        indexes: each one's place in esc.RawCommand, and what it calls itself.
        node_ids: of each.
        rated_power_w: of each, what 100 % are of.
        hold_s: how long a command is good for.
    """

    def __init__(
        self, indexes: Sequence[int], node_ids: Sequence[int], rated_power_w: Sequence[float], hold_s: float = HOLD_S
    ) -> None:
        self._indexes = tuple(indexes)
        self._rated_power_w = tuple(rated_power_w)
        self._hold_s = hold_s
        self._nodes = [DroneCanNode(node_id) for node_id in node_ids]
        self._messages = [ESC_STATUS(esc_index=index) for index in indexes]
        self._told: list[dict[str, float]] = [{} for _ in indexes]
        self._receiver = DroneCanReceiver()
        self._commands = [0.0] * len(self._indexes)
        self._commanded_s = -inf

    @property
    def dropped(self) -> int:
        """Commands that were broken."""
        return self._receiver.dropped

    def take(self, time_s: float, frames: Iterable[CanFrame]) -> None:
        """Frames have come."""
        for frame in frames:
            if frame.identifier & MESSAGE_TYPE_MASK == RAW_COMMAND_BITS and frame.extended and not frame.error:
                transfer = self._receiver.take(frame.identifier, frame.data)
                if transfer is not None:
                    self._obey(time_s, list(transfer.payload.cmd))

    def commands(self, time_s: float) -> list[float]:
        """What they apply now, -1 to 1 each."""
        if time_s - self._commanded_s > self._hold_s:
            return [0.0] * len(self._indexes)
        return self._commands

    def report(self, time_s: float, place: int, report: EscReport) -> list[Unsent]:
        """esc.Status of the ESC at a place from 0, and the node's own status when it is due."""
        message, told = self._messages[place], self._told[place]
        for name, value in self._status(place, report).items():
            if told.get(name) != value:
                told[name] = value
                setattr(message, name, value)
        return self._nodes[place].frames(message) + self._nodes[place].status(time_s)

    def restart(self, place: int) -> None:
        """One of them restarts."""
        self._nodes[place].restart()

    def _obey(self, time_s: float, raw: list[int]) -> None:
        """A shorter command leaves the others at rest."""
        self._commands = [raw[index] / RAW_FULL_SCALE if index < len(raw) else 0.0 for index in self._indexes]
        self._commanded_s = time_s

    def _status(self, place: int, report: EscReport) -> dict[str, float]:
        power_w = max(report.current_a, 0.0) * report.voltage_v
        return {
            "error_count": report.error_count,
            "voltage": report.voltage_v,
            "current": report.current_a,
            "temperature": report.temperature_k,
            "rpm": round(report.speed_rpm),
            "power_rating_pct": min(round(100.0 * power_w / self._rated_power_w[place]), MOST_PERCENT),
        }

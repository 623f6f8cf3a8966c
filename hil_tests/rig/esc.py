"""Simulated DroneCAN nodes on any python-can bus: eight ESCs, and the autopilot that commands them.

They speak through the `dronecan` package, a stack that shares no line with the gateway's own decoder: what the two
understand of each other is the specification. Its `Node` and drivers are not used, for they do not know python-can's
virtual bus and want a thread each; its transfers and data types are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import can
import dronecan
from dronecan import transport

from hil_tests.rig.vehicle import THRUSTERS, Vehicle

RAW_COMMAND = dronecan.uavcan.equipment.esc.RawCommand
ESC_STATUS = dronecan.uavcan.equipment.esc.Status
NODE_STATUS = dronecan.uavcan.protocol.NodeStatus
RAW_FULL_SCALE = 8191  # int14, uavcan.equipment.esc.RawCommand
MESSAGE_PRIORITY = 20
# Bits of a message frame's identifier: priority 24-28, data type 8-23, service or message 7, source node 0-6.
MESSAGE_TYPE_MASK = 0x00FFFF80
AUTOPILOT_NODE = 10
FIRST_ESC_NODE = 11
NODE_STATUS_PERIOD_S = 1.0
RATED_POWER_W = 390.0  # T200 at 16 V


def raw_command_filter() -> dict[str, Any]:
    """A python-can filter that lets only esc.RawCommand through."""
    return {"can_id": RAW_COMMAND.default_dtid << 8, "can_mask": MESSAGE_TYPE_MASK, "extended": True}


class DroneCanPort:
    """Sends and receives whole DroneCAN messages on a python-can bus.

    Args:
        bus: open, owned and closed by the caller.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._transfers = transport.TransferManager()
        self._next_transfer_id: Counter[tuple[int, int]] = Counter()
        self.sent: Counter[str] = Counter()
        self.dropped = 0

    def broadcast(self, time_s: float, message: Any, source_node: int) -> None:
        """Send one message from a node, in as many frames as it takes, stamped where the bus keeps stamps."""
        data_type = transport.get_dronecan_data_type(message)
        key = source_node, data_type.default_dtid
        transfer = transport.Transfer(
            payload=message,
            source_node_id=source_node,
            transfer_id=self._next_transfer_id[key],
            transfer_priority=MESSAGE_PRIORITY,
        )
        self._next_transfer_id[key] = (self._next_transfer_id[key] + 1) % 32
        for frame in transfer.to_frames():
            self._bus.send(can.Message(timestamp=time_s, arbitration_id=frame.message_id, data=frame.bytes))
        self.sent[data_type.full_name] += 1

    def receive(self) -> list[Any]:
        """All messages that are complete by now, as `dronecan` transfers; never waits. Broken ones are counted."""
        complete = []
        while (message := self._bus.recv(timeout=0.0)) is not None:
            if not message.is_extended_id or message.is_error_frame:
                continue
            frames = self._transfers.receive_frame(transport.Frame(message.arbitration_id, message.data))
            if frames:
                complete.extend(self._transfer(frames))
        return complete

    def _transfer(self, frames: list[Any]) -> list[Any]:
        transfer = transport.Transfer()
        try:
            transfer.from_frames(frames)
        except transport.TransferError:
            self.dropped += 1
            return []
        return [transfer]


@dataclass(slots=True)
class NodeStatusClock:
    """When the nodes of a port say that they live, and since when they do."""

    started_s: float | None = None
    next_s: float = 0.0

    def due(self, time_s: float) -> bool:
        """Whether it is time again; a period after the last time it was."""
        if self.started_s is None:
            self.started_s, self.next_s = time_s, time_s
        if time_s < self.next_s:
            return False
        self.next_s += NODE_STATUS_PERIOD_S
        return True

    def message(self, time_s: float) -> Any:
        """NodeStatus of a node in operation."""
        message = NODE_STATUS()
        message.uptime_sec = 0 if self.started_s is None else int(time_s - self.started_s)
        message.mode = message.MODE_OPERATIONAL
        return message


class CommandNode:
    """The autopilot's side of the bus: broadcasts thruster commands.

    Args:
        bus: open, owned by the caller.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self.port = DroneCanPort(bus)
        self._status = NodeStatusClock()

    def publish(self, time_s: float, commands: Sequence[float]) -> None:
        """Send one command of -1 to 1 per thruster, and the node's own status when it is due."""
        self.port.broadcast(
            time_s, RAW_COMMAND(cmd=[round(command * RAW_FULL_SCALE) for command in commands]), AUTOPILOT_NODE
        )
        if self._status.due(time_s):
            self.port.broadcast(time_s, self._status.message(time_s), AUTOPILOT_NODE)


class EscBank:
    """Eight ESC nodes: obey the newest esc.RawCommand, report esc.Status each.

    Without a command for `hold_s` they stop, as real ESCs do.

    Args:
        bus: open, owned by the caller; give it `raw_command_filter()` to spare the rest.
        vehicle: whose thrusters they drive and watch.
        hold_s: how long a command is good for.
    """

    def __init__(self, bus: can.BusABC, vehicle: Vehicle, hold_s: float = 0.5) -> None:
        self.port = DroneCanPort(bus)
        self._vehicle = vehicle
        self._hold_s = hold_s
        self._commands = [0.0] * THRUSTERS
        self._commanded_s = float("-inf")
        self._status = NodeStatusClock()

    def commands(self, time_s: float) -> list[float]:
        """What the ESCs apply now, -1 to 1 each."""
        for transfer in self.port.receive():
            if transport.get_dronecan_data_type(transfer.payload) == RAW_COMMAND:
                raw = list(transfer.payload.cmd)[:THRUSTERS]
                self._commands = [value / RAW_FULL_SCALE for value in raw] + [0.0] * (THRUSTERS - len(raw))
                self._commanded_s = time_s
        if time_s - self._commanded_s > self._hold_s:
            return [0.0] * THRUSTERS
        return self._commands

    def report(self, time_s: float, window_s: float) -> None:
        """Send the esc.Status of every thruster, and each node's own status when it is due."""
        for index in range(THRUSTERS):
            self.port.broadcast(time_s, self._esc_status(index, window_s), FIRST_ESC_NODE + index)
        if self._status.due(time_s):
            for index in range(THRUSTERS):
                self.port.broadcast(time_s, self._status.message(time_s), FIRST_ESC_NODE + index)

    def _esc_status(self, index: int, window_s: float) -> Any:
        measured = self._vehicle.thrusters[index].measure(window_s)
        voltage_v = self._vehicle.battery.voltage_v
        return ESC_STATUS(
            error_count=0,
            voltage=voltage_v,
            current=measured.supply_a,
            temperature=300.0,
            rpm=round(measured.speed_rpm),
            power_rating_pct=min(round(100.0 * max(measured.supply_a, 0.0) * voltage_v / RATED_POWER_W), 127),
            esc_index=index,
        )

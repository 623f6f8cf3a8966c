"""What every node says of itself once a second: bits to frozen values and back.

Source: DSDL definition uavcan.protocol.NodeStatus (341).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.bus_readings import Health, NodeMode
from drivers.can.dronecan.transfer import DataType, check_range, split
from drivers.can.frame import CanFrame

NODE_STATUS = DataType(341, 0x0F0868D0C1A7C6F1, 7)
NODE_STATUS_PRIORITY = 16

# uptime; health (2 bits), mode (3) and sub mode (3); the vendor's own code
_STATUS = struct.Struct("<IBH")


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """uavcan.protocol.NodeStatus as it is on the wire.

    Attributes:
        uptime_s: whole seconds since the node's start.
        health, mode: as the node says.
        vendor_status: 16 bits, the maker's own.
    """

    uptime_s: int
    health: Health = Health.OK
    mode: NodeMode = NodeMode.OPERATIONAL
    vendor_status: int = 0


def pack_node_status(status: NodeStatus) -> bytes:
    """Serialise NodeStatus.

    Raises:
        ValueError: a field that does not fit the wire.
    """
    check_range("uptime_s", status.uptime_s, 0, 0xFFFF_FFFF)
    check_range("vendor_status", status.vendor_status, 0, 0xFFFF)
    return _STATUS.pack(status.uptime_s, status.health << 6 | status.mode << 3, status.vendor_status)


def unpack_node_status(payload: bytes) -> NodeStatus | None:
    """Fields of NodeStatus; None where the length is wrong."""
    if len(payload) != _STATUS.size:
        return None
    uptime_s, state, vendor_status = _STATUS.unpack(payload)
    return NodeStatus(uptime_s, Health(state >> 6), NodeMode(state >> 3 & 0b111), vendor_status)


def encode_node_status(
    status: NodeStatus,
    source_node: int,
    transfer_id: int,
    *,
    time_s: float = 0.0,
    priority: int = NODE_STATUS_PRIORITY,
) -> list[CanFrame]:
    """The frame of one uavcan.protocol.NodeStatus.

    Args:
        status: what the node says.
        source_node: 1..127.
        transfer_id: counts up from call to call.
        time_s: stamp of the frame.
        priority: 0 (first on the bus) .. 31.

    Raises:
        ValueError: an argument out of range.
    """
    return split(
        NODE_STATUS,
        pack_node_status(status),
        source_node=source_node,
        transfer_id=transfer_id,
        priority=priority,
        time_s=time_s,
    )

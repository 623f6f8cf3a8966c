"""What is seen of the nodes on a CAN bus beside what they say of thrusters: how they are, who should not be there.

What lasts is said once when it begins, and again every few seconds while it goes on; that it is over, nobody says.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Health(IntEnum):
    """How a DroneCAN node says that it is (uavcan.protocol.NodeStatus)."""

    OK = 0
    WARNING = 1
    ERROR = 2
    CRITICAL = 3


class NodeMode(IntEnum):
    """What a DroneCAN node says that it does (uavcan.protocol.NodeStatus); 4 to 6 are reserved."""

    OPERATIONAL = 0
    INITIALIZATION = 1
    MAINTENANCE = 2
    SOFTWARE_UPDATE = 3
    RESERVED_4 = 4
    RESERVED_5 = 5
    RESERVED_6 = 6
    OFFLINE = 7


@dataclass(frozen=True, slots=True)
class NodeHealth:
    """How a node is: on every change, and again every few seconds.

    Attributes:
        time_s: reception.
        node_id: 1 to 127.
        health, mode: as the node says.
        uptime_s: since its start, in whole seconds.
        thrusters: numbers of the thrusters whose ESC this node is, as far as it has spoken as one; ascending.
    """

    time_s: float
    node_id: int
    health: Health
    mode: NodeMode
    uptime_s: int
    thrusters: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class EscCondition:
    """What an ESC says of itself beside its speed: on every change of its flags, and again every few seconds.

    Attributes:
        time_s: reception.
        thruster: number of the thruster in the configuration, from 1.
        input_percent, output_percent: magnitude of the command as the ESC got it, and as it passes it to the motor.
        motor_temperature_k: of the motor, in whole degrees.
        status_flags: 19 bits, whose meaning is the maker's own.
    """

    time_s: float
    thruster: int
    input_percent: int
    output_percent: int
    motor_temperature_k: float
    status_flags: int


@dataclass(frozen=True, slots=True)
class EscConflict:
    """A node speaks as the ESC of a thruster that is not it, or more than one does.

    Attributes:
        time_s: reception of the frame that left no doubt.
        thruster: number of the thruster in the configuration, from 1.
        esc_index: that is claimed.
        node_ids: who claims it, ascending.
        node_id: who may, by the configuration; None: any node, and so the first.
    """

    time_s: float
    thruster: int
    esc_index: int
    node_ids: tuple[int, ...]
    node_id: int | None


@dataclass(frozen=True, slots=True)
class CommanderConflict:
    """More than one node commands the thrusters; `node_ids`: which, ascending."""

    time_s: float
    node_ids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class NodeIdConflict:
    """Two devices use one node id: there are two uptimes, or two counts of messages."""

    time_s: float
    node_id: int


@dataclass(frozen=True, slots=True)
class BabblingNode:
    """A node sends more than any should: `frames_per_s` at least, of those frames alone that are read."""

    time_s: float
    node_id: int
    frames_per_s: int


BusReading = NodeHealth | EscCondition | EscConflict | CommanderConflict | NodeIdConflict | BabblingNode

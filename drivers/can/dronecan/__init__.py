"""DroneCAN: ESCs, their commands and their nodes, to readings; and back for the rig.

Listening only: the decoder has no node id, and nothing is sent unless the caller sends what the encoders return.
"""

from drivers.can.dronecan.decoder import DroneCanDecoder
from drivers.can.dronecan.esc_status import EscStatus, EscStatusExtended, encode_esc_status, encode_status_extended
from drivers.can.dronecan.node_status import NodeStatus, encode_node_status
from drivers.can.dronecan.setpoints import COMMAND_MAX, encode_raw_command, encode_rpm_command
from drivers.can.dronecan.thruster import DroneCanThruster

__all__ = [
    "COMMAND_MAX",
    "DroneCanDecoder",
    "DroneCanThruster",
    "EscStatus",
    "EscStatusExtended",
    "NodeStatus",
    "encode_esc_status",
    "encode_node_status",
    "encode_raw_command",
    "encode_rpm_command",
    "encode_status_extended",
]

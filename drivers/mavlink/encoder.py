"""The gateway's messages to MAVLink bytes."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.messages import (
    CommandAck,
    CommandLong,
    CompanionHeartbeat,
    NamedValue,
    OutgoingMessage,
    StatusText,
)

COMPANION_COMPONENT = 192  # MAV_COMP_ID_ONBOARD_COMPUTER2


class MavlinkEncoder:
    """Outgoing messages to MAVLink 2 frames, numbered in sequence.

    Args:
        system_id: the vehicle's, 1..254. Never 255: ArduSub would take us for its ground station, and its failsafe
            for a lost ground station would never come.
        component_id: ours, 2..255; 1 is the autopilot itself.

    Raises:
        ValueError: an id out of these bounds.
    """

    def __init__(self, system_id: int, component_id: int = COMPANION_COMPONENT) -> None:
        if not 1 <= system_id <= 254:
            raise ValueError(f"system_id must be the vehicle's, 1..254, got {system_id}")
        check_component(component_id)
        self._link = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)

    def encode(self, message: OutgoingMessage) -> bytes:
        """One frame; each call takes the next sequence number.

        Raises:
            ValueError: not one of the messages that the gateway sends.
        """
        frame: bytes = _generated(message).pack(self._link)
        self._link.seq = (self._link.seq + 1) % 256
        return frame


def _generated(message: OutgoingMessage) -> Any:
    match message:
        case CompanionHeartbeat(state):
            return dialect.MAVLink_heartbeat_message(
                type=dialect.MAV_TYPE_ONBOARD_CONTROLLER,
                autopilot=dialect.MAV_AUTOPILOT_INVALID,
                base_mode=0,
                custom_mode=0,
                system_status=state,
                mavlink_version=3,
            )
        case StatusText(severity, text):
            return dialect.MAVLink_statustext_message(severity, text.encode("ascii"))
        case CommandLong(command, parameters, system, component, confirmation):
            return dialect.MAVLink_command_long_message(system, component, command, confirmation, *parameters)
        case CommandAck(command, result, system, component):
            return dialect.MAVLink_command_ack_message(
                command, result, target_system=system, target_component=component
            )
        case NamedValue(name, value, boot_s):
            return dialect.MAVLink_named_value_float_message(
                round(boot_s * 1000.0) % 2**32, name.encode("ascii"), value
            )
    raise ValueError(f"message must be one of {OutgoingMessage}, got {message!r}")


def check_component(component_id: int) -> None:
    """Refuses a component id that the gateway cannot have.

    Raises:
        ValueError: out of 2..255.
    """
    if not 2 <= component_id <= 255:
        raise ValueError(f"component id must lie in 2..255 (1 is the autopilot), got {component_id}")

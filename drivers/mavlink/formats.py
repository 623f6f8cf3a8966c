"""Payload layouts: pymavlink's generated ones, and PX4's two ESC messages that its dialect lacks.

Only the constants of the generated classes are used (`id`, `crc_extra`, `unpacker`): building a message object for
every packet costs ten times as much as unpacking the few fields that are read.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect


@dataclass(frozen=True, slots=True)
class MessageFormat:
    """One MAVLink message on the wire.

    Attributes:
        message_id: 24-bit message id.
        crc_extra: byte that closes the checksum, different for every layout.
        payload: fields in wire order, MAVLink 2 extensions at the end.
    """

    message_id: int
    crc_extra: int
    payload: struct.Struct

    def unpack(self, payload: bytes) -> tuple[Any, ...]:
        """Fields in wire order; zeros where MAVLink 2 cut them off or MAVLink 1 lacks the extension."""
        size = self.payload.size
        if len(payload) == size:
            return self.payload.unpack(payload)
        return self.payload.unpack(payload[:size].ljust(size, b"\0"))


def generated(name: str) -> MessageFormat:
    """The layout of a message of pymavlink's ardupilotmega dialect, by its MAVLink name."""
    message = getattr(dialect, f"MAVLink_{name.lower()}_message")
    return MessageFormat(message.id, message.crc_extra, message.unpacker)


HEARTBEAT = generated("HEARTBEAT")
SYSTEM_TIME = generated("SYSTEM_TIME")
ATTITUDE = generated("ATTITUDE")
LOCAL_POSITION_NED = generated("LOCAL_POSITION_NED")
GLOBAL_POSITION_INT = generated("GLOBAL_POSITION_INT")
GPS_RAW_INT = generated("GPS_RAW_INT")
GPS_INPUT = generated("GPS_INPUT")
SERVO_OUTPUT_RAW = generated("SERVO_OUTPUT_RAW")
ACTUATOR_OUTPUT_STATUS = generated("ACTUATOR_OUTPUT_STATUS")
ATTITUDE_QUATERNION = generated("ATTITUDE_QUATERNION")
RAW_IMU = generated("RAW_IMU")
SCALED_IMUS = tuple(generated(name) for name in ("SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3"))
HIGHRES_IMU = generated("HIGHRES_IMU")
SCALED_PRESSURES = tuple(generated(name) for name in ("SCALED_PRESSURE", "SCALED_PRESSURE2", "SCALED_PRESSURE3"))
VISION_POSITION_DELTA = generated("VISION_POSITION_DELTA")
VISION_SPEED_ESTIMATE = generated("VISION_SPEED_ESTIMATE")
ODOMETRY = generated("ODOMETRY")
COMMAND_LONG = generated("COMMAND_LONG")
COMMAND_INT = generated("COMMAND_INT")
COMMAND_ACK = generated("COMMAND_ACK")
RPM = generated("RPM")
# id with flags, target system and component, bus, length, and the data as bytes: pymavlink takes them one by one
CAN_FRAME = MessageFormat(386, generated("CAN_FRAME").crc_extra, struct.Struct("<IBBBB8s"))
CANFD_FRAME = MessageFormat(387, generated("CANFD_FRAME").crc_extra, struct.Struct("<IBBBB64s"))
ESC_TELEMETRY = tuple(generated(f"ESC_TELEMETRY_{first}_TO_{first + 3}") for first in range(1, 33, 4))

# PX4, common.xml: time_usec, error_count[4], counter, failure_flags[4], temperature[4] (0.01 degC),
# index, count, connection_type, info.
ESC_INFO = MessageFormat(290, 251, struct.Struct("<Q4IH4H4h4B"))
# PX4, common.xml: time_usec, rpm[4] (signed), voltage[4] (V), current[4] (A), index of the first of these four ESCs.
ESC_STATUS = MessageFormat(291, 10, struct.Struct("<Q4i4f4fB"))

# tc1, ts1 (ns), and the target system and component of 2022 that pymavlink does not have yet: zeros mean all.
TIMESYNC = MessageFormat(111, generated("TIMESYNC").crc_extra, struct.Struct("<qqBB"))

CRC_EXTRA: dict[int, int] = {message_id: message.crc_extra for message_id, message in dialect.mavlink_map.items()}
CRC_EXTRA |= {extra.message_id: extra.crc_extra for extra in (ESC_INFO, ESC_STATUS)}


def name_of(message_id: int) -> str:
    """MAVLink's name of a message, its number where the dialect lacks it."""
    message = dialect.mavlink_map.get(message_id)
    own = {ESC_INFO.message_id: "ESC_INFO", ESC_STATUS.message_id: "ESC_STATUS"}
    return own.get(message_id, str(message_id)) if message is None else str(message.msgname)


# pymavlink's compiled CRC-16/MCRF4XX without the object around it, a third of the time; None where it could not be
# loaded.
crc_16: Callable[[bytes], int] = getattr(dialect, "mcrf4xx", None) or (lambda data: int(dialect.x25crc(data).crc))

# the byte that closes the checksum, by message id
CLOSING = {message_id: bytes((crc_extra,)) for message_id, crc_extra in CRC_EXTRA.items()}


def checksum(data: bytes, crc_extra: int) -> int:
    """CRC-16/MCRF4XX of a frame without its magic byte and its checksum, closed with the layout's own byte."""
    return crc_16(data + bytes((crc_extra,)))

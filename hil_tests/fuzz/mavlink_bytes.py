"""MAVLink as bytes to be damaged: what an autopilot sends, and messages of any content with a right checksum."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from functools import cache
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.command import CommandScale
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.formats import CRC_EXTRA, checksum
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.frames import MAGIC_2, Gate
from drivers.mavlink.thrusters import MavlinkThruster

TOKENS = (b"\xfd", b"\xfe", b"\xfd\x00", b"\xfd\xff", b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f")
MESSAGE = struct.Struct("<BBBBB")  # place in `message_ids`, system, component, step in time, bytes of payload

_PULSES = CommandScale(1100.0, 1500.0, 1900.0, dead_band=25.0)
_THRUSTERS = (
    MavlinkThruster(1, servo_channel=1, command_scale=_PULSES, esc_index=0),
    MavlinkThruster(2, servo_channel=32, command_scale=_PULSES, esc_index=31),
    MavlinkThruster(3, actuator=3, command_scale=_PULSES, esc_index=5, signed=True, reverse=True),
    MavlinkThruster(4, rpm_sensor=2),
)
_GPS = (43.7e7, 7.3e7, -12.5, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.8, 1.0, 255)


def everything_decoder(gate: Gate | None = None, can_frames: ForwardedFrames | None = None) -> MavlinkDecoder:
    """Reads all that any configuration can ask for."""
    return MavlinkDecoder(_THRUSTERS, navigation=True, gate=gate, can_frames=can_frames)


def thrusters() -> tuple[MavlinkThruster, ...]:
    """Those of `everything_decoder`."""
    return _THRUSTERS


@cache
def message_ids() -> tuple[int, ...]:
    """Of the messages that are read, and one that is not."""
    return (*sorted(everything_decoder(can_frames=ForwardedFrames(Counter())).wanted), dialect.MAVLINK_MSG_ID_PING)


def packets() -> list[bytes]:
    """An autopilot's messages of all kinds, in turn, some of MAVLink 1; packed by pymavlink."""
    autopilot = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    packed = []
    for number, message in enumerate(_messages()):
        packed.append(message.pack(autopilot, force_mavlink1=number % 7 == 6 and message.get_msgId() < 256))
        autopilot.seq = (autopilot.seq + 1) % 256
    return packed


def signed_packets(key: bytes) -> list[bytes]:
    """Heartbeats and attitudes, rightly signed."""
    autopilot = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    autopilot.signing.secret_key, autopilot.signing.sign_outgoing = key, True
    packed = []
    for message in list(_messages())[:4]:
        packed.append(message.pack(autopilot))
        autopilot.seq += 1
    return packed


def _messages() -> Iterator[Any]:
    yield dialect.MAVLink_heartbeat_message(12, 3, 0xD1, 19, 4, 3)
    yield dialect.MAVLink_attitude_message(1000, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    yield dialect.MAVLink_servo_output_raw_message(1_000_000, 0, *[1600] * 16)
    yield dialect.MAVLink_system_time_message(1_700_000_000_000_000, 1000)
    yield dialect.MAVLink_attitude_quaternion_message(1000, 1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3)
    yield dialect.MAVLink_local_position_ned_message(1000, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    yield dialect.MAVLink_global_position_int_message(1000, 437_000_000, 73_000_000, -5000, -5000, 10, 20, 30, 9000)
    yield dialect.MAVLink_gps_raw_int_message(1_000_000, 3, 437_000_000, 73_000_000, 0, 100, 100, 10, 100, 9)
    yield dialect.MAVLink_gps_input_message(0, 0, 0, 0, 0, 3, 437_000_000, 73_000_000, *_GPS[2:])
    yield dialect.MAVLink_esc_telemetry_1_to_4_message(bytes(4), [1600] * 4, [150] * 4, [0] * 4, [900] * 4, [1] * 4)
    yield dialect.MAVLink_actuator_output_status_message(1_000_000, 4, [1500.0] * 32)
    yield dialect.MAVLink_rpm_message(900.0, 800.0)
    yield dialect.MAVLink_raw_imu_message(1_000_000, 0, 0, -1000, 1, 2, 3, 0, 0, 0, 1, 2500)
    yield dialect.MAVLink_scaled_pressure2_message(1000, 1500.0, 0.0, 2000)
    yield dialect.MAVLink_vision_position_delta_message(1_000_000, 100_000, [0.1] * 3, [0.2] * 3, 90.0)
    yield dialect.MAVLink_command_long_message(1, 192, 31010, 0, 1, 0, 0, 0, 0, 0, 0)
    yield dialect.MAVLink_command_ack_message(32000, 0)
    yield dialect.MAVLink_timesync_message(0, 123_456_789)
    yield dialect.MAVLink_can_frame_message(255, 0, 0, 8, 0x8000_0000 | 0x1003FE0A, list(range(8)))
    yield dialect.MAVLink_canfd_frame_message(255, 0, 1, 64, 0x123, list(range(64)))
    yield dialect.MAVLink_heartbeat_message(12, 3, 0x51, 2, 3, 3)


def contents() -> bytes:
    """Of each message that is read its usual content, as `framed` takes it."""
    ids = message_ids()
    known = {
        packet[7] | packet[8] << 8 | packet[9] << 16: packet[10:-2] for packet in packets() if packet[0] == MAGIC_2
    }
    parts = [(place, known.get(number, b"\x01" * 20)) for place, number in enumerate(ids)]
    heartbeat = (ids.index(0), known[0])
    return b"".join(
        MESSAGE.pack(place, 1, 1, 3, len(payload)) + payload for place, payload in (heartbeat, *parts, heartbeat)
    )


def framed(data: bytes) -> list[tuple[int, bytes]]:
    """Steps in time and packets with right checksums, of any bytes."""
    ids, place = message_ids(), 0
    found: list[tuple[int, bytes]] = []
    while place + MESSAGE.size <= len(data):
        number, system, component, step, size = MESSAGE.unpack_from(data, place)
        begin, message_id = place + MESSAGE.size, ids[number % len(ids)]
        place = begin + size
        payload = data[begin:place]
        head = struct.pack("<BBBBBB", len(payload), 0, 0, len(found) % 256, system, component)
        body = head + message_id.to_bytes(3, "little") + payload
        crc = checksum(body, CRC_EXTRA[message_id]).to_bytes(2, "little")
        found.append((step, bytes([MAGIC_2]) + body + crc))
    return found

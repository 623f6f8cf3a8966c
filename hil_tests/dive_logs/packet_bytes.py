"""Recorded packets as bytes again: MAVLink 2, unsigned, however they came.

(A signature of then would be refused today as a replayed one, and MAVLink 1 has nothing that MAVLink 2 has not.)
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.formats import CRC_EXTRA, ESC_INFO, ESC_STATUS, checksum
from drivers.mavlink.frames import MAGIC_2, Packet

_HEADER = struct.Struct("<BBBBBBBHB")  # magic, length, two bytes of flags, sequence, system, component, message
# fields that tell the sender's time, by their ticks a second
TICKS_PER_S: Mapping[str, int] = {"time_boot_ms": 1000, "time_usec": 10**6, "time_unix_usec": 10**6}
_WIDTHS = {"I": 4, "Q": 8}


def packet_bytes(packet: Packet) -> bytes:
    """The packet as it goes over a link; zeros at its end are cut off, as MAVLink 2 wants it."""
    payload = packet.payload.rstrip(b"\0") or packet.payload[:1]
    header = _HEADER.pack(
        MAGIC_2, len(payload), 0, 0, packet.sequence, packet.system_id, packet.component_id,
        packet.message_id & 0xFFFF, packet.message_id >> 16,
    )  # fmt: skip
    check = checksum(header[1:] + payload, CRC_EXTRA[packet.message_id])
    return header + payload + check.to_bytes(2, "little")


def later(packet: Packet, by_s: float, sequence: int) -> Packet:
    """The same packet, sent that much later: the times in it count on; 0, which is "not known", stays."""
    payload = packet.payload
    for start, width, ticks_per_s in _CLOCKS.get(packet.message_id, ()):
        payload = payload.ljust(start + width, b"\0")
        ticks = int.from_bytes(payload[start : start + width], "little")
        if ticks:
            ticks = (ticks + round(by_s * ticks_per_s)) % (1 << 8 * width)
            payload = payload[:start] + ticks.to_bytes(width, "little") + payload[start + width :]
    return Packet(packet.message_id, packet.system_id, packet.component_id, payload, sequence)


def _clocks_of(message: Any) -> list[tuple[int, int, int]]:
    """Where in a message times are: start, width in bytes, ticks a second."""
    found, start = [], 0
    for name, code in zip(message.ordered_fieldnames, _codes(message), strict=True):
        if name in TICKS_PER_S:
            found.append((start, _WIDTHS[code[-1]], TICKS_PER_S[name]))
        start += struct.calcsize("<" + code)
    return found


def _codes(message: Any) -> list[str]:
    """The part of the message's format that each field has: "Q", "4f", ..."""
    letters = message.native_format.decode().lstrip("<")
    counts = [max(int(length), 1) for length in message.array_lengths]
    return [f"{count}{letter}" for count, letter in zip(counts, letters, strict=True)]


_CLOCKS: dict[int, list[tuple[int, int, int]]] = {
    **{message_id: found for message_id, message in dialect.mavlink_map.items() if (found := _clocks_of(message))},
    ESC_INFO.message_id: [(0, 8, 10**6)],
    ESC_STATUS.message_id: [(0, 8, 10**6)],
}

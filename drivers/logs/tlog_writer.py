"""Packets as ground stations write them into their logs (.tlog): each behind the time of its reception."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from drivers.mavlink.encoder import frames_of
from drivers.mavlink.formats import CLOSING
from drivers.mavlink.frames import MAGIC_1, MAGIC_2, Frame, frame_at, has_right_checksum

_STAMP = struct.Struct(">Q")  # microseconds since 1970
_MAGICS = (MAGIC_1, MAGIC_2)
_NONE = Frame(-1, 0, 0, 0, 0, 0, 0)


def tlog_record(time_s: float, packet: bytes) -> bytes:
    """The record of a packet."""
    return _STAMP.pack(round(1e6 * time_s)) + packet


def tlog_records(time_s: float, data: bytes) -> Iterator[bytes]:
    """One record for each packet in what came at once; what is none stands in a record of its own."""
    packets = list(frames_of(data)) if data[:1] in (bytes([magic]) for magic in _MAGICS) else []
    if b"".join(packets) != data:
        packets = [data]
    for packet in packets:
        yield tlog_record(time_s, packet)


class PacketCutter:
    """Cuts what came over a link, in pieces of any size, into whole packets.

    Attributes:
        outside: bytes that belong to none.
    """

    def __init__(self) -> None:
        self._pending = b""
        self._in_step = True
        self.outside = 0

    def cut(self, data: bytes) -> list[bytes]:
        """The packets that these bytes complete."""
        buffer, start, packets = self._pending + data, 0, []
        while start < len(buffer):
            frame = frame_at(buffer, start) if buffer[start] in _MAGICS else _NONE
            if frame is None or frame.end > len(buffer):
                break
            self._in_step = self._is_packet(buffer, start, frame)
            if self._in_step:
                packets.append(buffer[start : frame.end])
                start = frame.end
            else:
                start, self.outside = start + 1, self.outside + 1
        self._pending = buffer[start:]
        return packets

    def rest(self) -> list[bytes]:
        """The packets in what is left at the end, when nothing comes any more that could complete another."""
        packets: list[bytes] = []
        while self._pending:
            self._pending, self._in_step = self._pending[1:], False
            self.outside += 1
            packets += self.cut(b"")
        return packets

    def _is_packet(self, buffer: bytes, start: int, frame: Frame) -> bool:
        """By its checksum; a message that is not known has none to test, and is one between two others."""
        if frame.message_id in CLOSING:
            return has_right_checksum(buffer, start, frame)
        follows = frame.end == len(buffer) or buffer[frame.end] in _MAGICS
        return frame is not _NONE and self._in_step and follows

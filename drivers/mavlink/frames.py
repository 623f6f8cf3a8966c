"""MAVLink 1 and 2 framing: a byte stream, damaged or not, into frames whose checksum is right.

Rules of the search:
- A frame that starts where the last good one ended is *in step*: it is waited for until it is whole.
- Out of step (garbage was seen, or the rest of a frame did not come for a while), every magic byte is only a guess,
  and the search looks on behind an unfinished guess: a good frame is found in the same call that completes it.
- A bad frame costs one byte, not its stated length: the length may be the very byte that is wrong.
- A message whose layout is not known has no checksum to test. In step it is skipped if a magic byte or the end of the
  data follows; out of step it is no evidence of anything.
"""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from drivers.mavlink.formats import CLOSING, crc_16
from drivers.mavlink.sequence_numbers import LOST, SequenceNumbers

MAGIC_1, MAGIC_2 = 0xFE, 0xFD
FLAG_SIGNED = 0x01
SIGNATURE_SIZE = 13
CHECKSUM_SIZE = 2
# The rest of a frame that is under way comes within milliseconds; after this it was cut off.
PATIENCE_S = 0.5

UNKNOWN = "unknown message"

_MAGIC = re.compile(b"[\xfd\xfe]")
_HEADER_1 = struct.Struct("<xBBBBB")  # length, sequence, system, component, message
_HEADER_2 = struct.Struct("<xBBxBBBHB")  # length, flags, sequence, system, component, message (low 16, high 8 bits)
# The same at speed: magic byte, length, flags, sequence, system and component in one, message and the byte behind it.
_read_run = struct.Struct("<BBBxBHI").unpack_from
MESSAGE_ID_MASK = 0xFFFFFF
FRAME_MIN_2 = _HEADER_2.size + CHECKSUM_SIZE


class Frame(NamedTuple):
    """One frame in a buffer: `payload_start`, `payload_end` and `end` are offsets from the buffer's start."""

    message_id: int
    system_id: int
    component_id: int
    sequence: int
    payload_start: int
    payload_end: int
    end: int


@dataclass(slots=True)
class Packet:
    """A checked frame that was wanted. `signed`: with a signature, which the gate found right.

    (Not frozen only because that costs five times the time, and there is one for every frame.)
    """

    message_id: int
    system_id: int
    component_id: int
    payload: bytes
    sequence: int = 0
    signed: bool = False


class Gate(Protocol):
    """Decides who is let in: see `drivers.mavlink.signing`."""

    def refusal(self, frame: Frame, packet: bytes, time_s: float) -> str:
        """Why a packet must not be read, "" where it may; asked once for each."""
        ...


def is_signed(packet: bytes) -> bool:
    """Whether a packet carries a signature, right or wrong. MAVLink 1 has none."""
    return packet[0] == MAGIC_2 and bool(packet[2] & FLAG_SIGNED)


def frame_at(buffer: bytes, start: int) -> Frame | None:
    """Read the header of the frame whose magic byte is at `start`; None while the header is not complete."""
    if buffer[start] == MAGIC_2:
        if len(buffer) - start < _HEADER_2.size:
            return None
        length, flags, sequence, system, component, low, high = _HEADER_2.unpack_from(buffer, start)
        payload_end = start + _HEADER_2.size + length
        end = payload_end + CHECKSUM_SIZE + (SIGNATURE_SIZE if flags & FLAG_SIGNED else 0)
        return Frame(low | high << 16, system, component, sequence, payload_end - length, payload_end, end)
    if len(buffer) - start < _HEADER_1.size:
        return None
    length, sequence, system, component, message_id = _HEADER_1.unpack_from(buffer, start)
    payload_end = start + _HEADER_1.size + length
    return Frame(
        message_id, system, component, sequence, payload_end - length, payload_end, payload_end + CHECKSUM_SIZE
    )


def has_right_checksum(buffer: bytes, start: int, frame: Frame) -> bool:
    """Whether a whole frame whose magic byte is at `start` has a known layout and the right checksum."""
    closing = CLOSING.get(frame.message_id)
    stated = buffer[frame.payload_end] | buffer[frame.payload_end + 1] << 8
    return closing is not None and crc_16(buffer[start + 1 : frame.payload_end] + closing) == stated


def flags_supported(buffer: bytes, start: int) -> bool:
    """False where a MAVLink 2 header asks for something that we do not know: such a frame must not be read."""
    return buffer[start] != MAGIC_2 or len(buffer) - start < 3 or not buffer[start + 2] & ~FLAG_SIGNED


class FrameScanner:
    """Finds the wanted frames in a stream, whatever else is in it.

    Args:
        wanted: ids of the messages to return; the others are checked and skipped.
        drops: counted here by cause: "checksum", "unsupported flags", "unknown message", "bytes outside frames" and
            "lost in transit" (gaps in the senders' sequence numbers), and the gate's.
        gate: is asked about every frame that is found, wanted or not; None: all are let in.
    """

    def __init__(self, wanted: Iterable[int], drops: Counter[str], gate: Gate | None = None) -> None:
        self._wanted = frozenset(wanted)
        self._drops = drops
        self._gate = gate
        self._pending = b""
        self._in_step = True
        self._fed_s = 0.0
        self._sequences = SequenceNumbers()
        self._expected = self._sequences.expected

    @property
    def pending(self) -> int:
        """Bytes kept because a frame may not be complete yet; never more than the longest frame."""
        return len(self._pending)

    def feed(self, data: bytes, time_s: float) -> list[Packet]:
        """Take the next bytes of the stream.

        Args:
            data: as received, cut anywhere.
            time_s: reception.

        Returns:
            The wanted frames that these bytes complete, in the order of the stream.
        """
        if self._pending:
            if time_s - self._fed_s > PATIENCE_S:
                self._in_step = False
            data, self._pending = self._pending + data, b""
        self._fed_s = time_s
        packets: list[Packet] = []
        done = 0
        while done < len(data):
            if self._in_step and self._gate is None:
                done = self._run(data, done, packets)
            if done < len(data):
                done = self._search(data, done, packets)
        return packets

    def _run(self, buffer: bytes, start: int, packets: list[Packet]) -> int:
        """Take good frames of the usual kind for as long as one follows the other; return where the last one ends.

        The usual kind is MAVLink 2, not signed, of a known layout. All others are `_search`'s, which is slower.
        A frame that is not whole yet is kept, as there.
        """
        expected = self._expected
        size = len(buffer)
        while size - start >= FRAME_MIN_2:
            magic, length, flags, sequence, sender, message_id = _read_run(buffer, start)
            message_id &= MESSAGE_ID_MASK  # the byte above it is not the header's any more
            closing = CLOSING.get(message_id)
            if magic != MAGIC_2 or flags or closing is None:
                return start
            end = start + length + FRAME_MIN_2
            if end > size:
                self._pending = buffer[start:]
                return size
            crc = end - CHECKSUM_SIZE
            if crc_16(buffer[start + 1 : crc] + closing) != buffer[crc] | buffer[crc + 1] << 8:
                return start
            if expected.get(sender) == sequence:
                expected[sender] = (sequence + 1) & 0xFF
            else:
                self._count_lost(sender, sequence)
            if message_id in self._wanted:
                payload = buffer[start + _HEADER_2.size : crc]
                packets.append(Packet(message_id, sender & 0xFF, sender >> 8, payload, sequence))
            start = end
        return start

    def _search(self, buffer: bytes, done: int, packets: list[Packet]) -> int:
        """Take the first good frame behind `done` and return where it ends; without one, keep what may become one."""
        search = done
        unfinished: int | None = None  # first guess that later bytes may still complete
        while match := _MAGIC.search(buffer, search):
            start = match.start()
            search = start + 1
            self._in_step = self._in_step and start == done
            frame = frame_at(buffer, start)
            fault = self._fault(buffer, start, frame)
            if fault is None:
                unfinished = start if unfinished is None else unfinished
                if self._in_step:
                    break
            elif fault:
                self._in_step = False
                if unfinished is None:  # else these bytes are scanned, and would be counted, again
                    self._drops[fault] += 1
            elif frame is not None:
                self._count_outside(start - done)
                self._take(buffer, start, frame, packets)
                self._in_step = True
                return frame.end
        keep = len(buffer) if unfinished is None else unfinished
        self._count_outside(keep - done)
        self._in_step = self._in_step and keep == done
        self._pending = buffer[keep:]
        return len(buffer)

    def _fault(self, buffer: bytes, start: int, frame: Frame | None) -> str | None:
        """What is wrong with the frame at `start`: a cause, "" for nothing, None while it is not complete."""
        if not flags_supported(buffer, start):
            return "unsupported flags"
        if frame is None or frame.end > len(buffer):
            return None
        if frame.message_id not in CLOSING:
            return self._unknown(buffer, frame)
        return "" if has_right_checksum(buffer, start, frame) else "checksum"

    def _unknown(self, buffer: bytes, frame: Frame) -> str:
        if not (self._in_step and _boundary(buffer, frame.end)):
            return UNKNOWN
        self._drops[UNKNOWN] += 1
        return ""

    def _take(self, buffer: bytes, start: int, frame: Frame, packets: list[Packet]) -> None:
        signed = False
        if self._gate is not None:
            whole = buffer[start : frame.end]
            if refusal := self._gate.refusal(frame, whole, self._fed_s):
                self._drops[refusal] += 1
                return
            signed = is_signed(whole)
        self._count_lost(frame.system_id | frame.component_id << 8, frame.sequence)
        if frame.message_id in self._wanted:
            payload = buffer[frame.payload_start : frame.payload_end]
            packets.append(
                Packet(frame.message_id, frame.system_id, frame.component_id, payload, frame.sequence, signed)
            )

    def _count_outside(self, size: int) -> None:
        if size:
            self._drops["bytes outside frames"] += size

    def _count_lost(self, source: int, sequence: int) -> None:
        if gap := self._sequences.gap(source, sequence):
            self._drops[LOST] += gap


def _boundary(buffer: bytes, end: int) -> bool:
    """Whether a frame may well end here."""
    return end == len(buffer) or buffer[end] in (MAGIC_1, MAGIC_2)

"""The records of a MAVLink log, through whatever damage."""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Callable, Collection, Sequence

from drivers.logs.damage import DamageReport
from drivers.logs.tlog_times import LOOKAHEAD, STAMP_END, STAMP_SIZE, USUAL_MAX_US, RecordTimes
from drivers.mavlink.formats import CLOSING, crc_16
from drivers.mavlink.frames import (
    CHECKSUM_SIZE,
    FRAME_MIN_2,
    MAGIC_1,
    MAGIC_2,
    Frame,
    Packet,
    flags_supported,
    frame_at,
    has_right_checksum,
)
from drivers.mavlink.sequence_numbers import LOST, SequenceNumbers
from drivers.readings import Reading

HEADER_SIZE = STAMP_SIZE + FRAME_MIN_2 - CHECKSUM_SIZE

OUTSIDE = "bytes outside records"
CUT_OFF = "last record cut off"
CHECKSUM = "checksum"
UNKNOWN = "unknown message"

_MAGIC = re.compile(b"[\xfd\xfe]")
# Stamp, magic byte, length, flags, sequence, component + 256 * system, message and the byte behind it: with the
# highest byte first, as the stamp is, though packets have the lowest first. So the message's number comes out turned.
_read_header = struct.Struct(">QBBBxBHI").unpack_from

Take = Callable[[Packet, float], Sequence[Reading]]


class RecordWalk:
    """From record to record.

    Args:
        take: is given the packets that are wanted, and the times of their reception.
        wanted: ids of these messages.
        drops: counted here: packets that did not reach who wrote the log.
        damage: told what is lost.
    """

    def __init__(self, take: Take, wanted: Collection[int], drops: Counter[str], damage: DamageReport) -> None:
        self._take = take
        self._wanted = {_turned(message_id): message_id for message_id in wanted}
        self._closing = {_turned(message_id): closing for message_id, closing in CLOSING.items()}
        self._drops = drops
        self._damage = damage
        self._sequences = SequenceNumbers()
        self._times = RecordTimes(damage)
        self._in_step = True

    def read(self, buffer: bytes, begin: int, readings: list[Reading], last: bool) -> int:
        """Read the records in a part of the log.

        Args:
            buffer: from the first byte on that was not done before.
            begin: its offset in the log.
            readings: what comes of the records is put here.
            last: True where the log ends with this part.

        Returns:
            How much is done. The rest, less than a kilobyte, is to be given again with what follows it.
        """
        done = 0
        while done < len(buffer):
            done = self._run(buffer, done, readings)
            further = self._step(buffer, done, begin, readings, last)
            if further == done:
                break
            done = further
        return done

    def _run(self, buffer: bytes, start: int, readings: list[Reading]) -> int:
        """Read records of the usual kind while one follows the other; return where the last one ends.

        The usual kind has a packet of MAVLink 2 that is whole, not signed and of a known layout, and its time is
        that of the record before it or a little later.
        """
        previous = self._times.newest
        if previous is None:
            return start
        closings, expected, size, count = self._closing, self._sequences.expected, len(buffer), 0
        while size - start >= STAMP_SIZE + FRAME_MIN_2:
            stamp, magic, length, flags, sequence, sender, message = _read_header(buffer, start)
            message >>= 8
            closing = closings.get(message)
            crc = start + HEADER_SIZE + length
            if magic != MAGIC_2 or flags or closing is None or crc + CHECKSUM_SIZE > size:
                break
            if not 0 <= stamp - previous <= USUAL_MAX_US:
                break
            if crc_16(buffer[start + STAMP_SIZE + 1 : crc] + closing) != buffer[crc] | buffer[crc + 1] << 8:
                break
            if expected.get(sender) == sequence:
                expected[sender] = (sequence + 1) & 0xFF
            else:
                self._count_lost(sender, sequence)
            if message in self._wanted:
                payload = buffer[start + HEADER_SIZE : crc]
                packet = Packet(self._wanted[message], sender >> 8, sender & 0xFF, payload, sequence)
                readings += self._take(packet, stamp / 1e6)
            previous, start, count = stamp, crc + CHECKSUM_SIZE, count + 1
        self._times.newest = previous
        self._damage.records += count
        return start

    def _step(self, buffer: bytes, start: int, begin: int, readings: list[Reading], last: bool) -> int:
        """Read one record the careful way, or pass over what is none; `start` where that takes what follows."""
        found, frame = self._is_record(buffer, start, last, self._in_step), _frame(buffer, start)
        if found is None:
            return start
        if not found or frame is None:
            return self._pass_over(buffer, start, begin, last)
        self._in_step = True
        time_s = self._times.judged(buffer, start, frame.end, begin)
        if time_s is not None:
            self._read(buffer, frame, time_s, readings)
        return frame.end

    def _read(self, buffer: bytes, frame: Frame, time_s: float, readings: list[Reading]) -> None:
        self._damage.records += 1
        self._count_lost(frame.component_id | frame.system_id << 8, frame.sequence)
        if _turned(frame.message_id) in self._wanted:
            payload = buffer[frame.payload_start : frame.payload_end]
            packet = Packet(frame.message_id, frame.system_id, frame.component_id, payload, frame.sequence)
            readings += self._take(packet, time_s)

    def _pass_over(self, buffer: bytes, start: int, begin: int, last: bool) -> int:
        """Count what is there until the next record; return where that begins, or may begin."""
        self._in_step = False
        for match in _MAGIC.finditer(buffer, start + STAMP_SIZE + 1):
            at = match.start() - STAMP_SIZE
            if self._is_record(buffer, at, last, in_step=False) is not False:
                return self._count_passed(buffer, start, at, begin, last=False)
        end = len(buffer) if last else max(start, len(buffer) - STAMP_SIZE)
        return self._count_passed(buffer, start, end, begin, last)

    def _is_record(self, buffer: bytes, start: int, last: bool, in_step: bool) -> bool | None:
        """Whether a record begins at `start`: its checksum is right, and its time fits unless it is in step.

        None where that takes what follows; its time is judged by those of the next ones.
        """
        frame = _frame(buffer, start)
        if frame is None or frame.end > len(buffer):
            return None if not last and _may_become(buffer, start) else False
        if not has_right_checksum(buffer, start + STAMP_SIZE, frame):
            return False
        if not last and len(buffer) - frame.end < LOOKAHEAD:
            return None
        return in_step or self._times.fits(buffer, start, frame.end) or (last and frame.end == len(buffer))

    def _count_passed(self, buffer: bytes, start: int, end: int, begin: int, last: bool) -> int:
        """Records whose packets are wrong or not known are counted one by one, the rest as bytes."""
        while (frame := _frame(buffer, start)) is not None and frame.end <= end:
            cause = CHECKSUM if frame.message_id in CLOSING else UNKNOWN
            self._damage.add(cause, f"offset {begin + start}")
            start = frame.end
        if last and start < end and _may_become(buffer, start):
            self._damage.add(CUT_OFF, f"offset {begin + start}")
        elif start < end:
            self._damage.add(OUTSIDE, f"offset {begin + start}", end - start)
        return end

    def _count_lost(self, sender: int, sequence: int) -> None:
        if gap := self._sequences.gap(sender, sequence):
            self._drops[LOST] += gap


def begins_as_record(head: bytes) -> bool:
    """Whether a file begins with a record, if only with a part of one, or has one further on."""
    if _may_become(head, 0) and int.from_bytes(head[:STAMP_SIZE].ljust(STAMP_SIZE, b"\0"), "big") < STAMP_END:
        return True
    walk = RecordWalk(lambda packet, time_s: (), (), Counter(), DamageReport())
    starts = (match.start() - STAMP_SIZE for match in _MAGIC.finditer(head, STAMP_SIZE))
    return any(walk._is_record(head, start, last=True, in_step=False) for start in starts)


def is_bare_stream(head: bytes) -> bool:
    """Whether packets follow each other here without times between them."""
    end = _packet_end(head, 0)
    return end is not None and _packet_end(head, end) is not None


def _packet_end(buffer: bytes, start: int) -> int | None:
    """Where the good packet at `start` ends; None if there is none."""
    if start >= len(buffer) or buffer[start] not in (MAGIC_1, MAGIC_2) or not flags_supported(buffer, start):
        return None
    frame = frame_at(buffer, start)
    whole = frame is not None and frame.end <= len(buffer) and has_right_checksum(buffer, start, frame)
    return frame.end if frame is not None and whole else None


def _frame(buffer: bytes, start: int) -> Frame | None:
    """The packet of the record at `start`, perhaps not whole; None if there is none, or not its whole header."""
    at = start + STAMP_SIZE
    if at >= len(buffer) or buffer[at] not in (MAGIC_1, MAGIC_2) or not flags_supported(buffer, at):
        return None
    return frame_at(buffer, at)


def _may_become(buffer: bytes, start: int) -> bool:
    """Whether further bytes may make a record of what begins at `start`."""
    at = start + STAMP_SIZE
    if at >= len(buffer):
        return True
    frame = _frame(buffer, start)
    if frame is None:
        return buffer[at] in (MAGIC_1, MAGIC_2) and len(buffer) - at < FRAME_MIN_2 and flags_supported(buffer, at)
    return frame.end > len(buffer)


def _turned(message_id: int) -> int:
    """A message's number as `_read_header` reads it."""
    return int.from_bytes(message_id.to_bytes(3, "little"), "big")

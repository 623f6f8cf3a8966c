"""The times in a MAVLink log: which can be right, and where the clock of the machine that wrote it was set."""

from __future__ import annotations

import struct

from drivers.logs.damage import DamageReport
from drivers.mavlink.frames import MAGIC_1, MAGIC_2, frame_at

STAMP_SIZE = 8
LOOKAHEAD = 320  # beyond the time of the record after the next one
US_PER_S = 1_000_000
STAMP_END = 4_102_444_800 * US_PER_S  # 2100-01-01
# Threads that write one log overtake each other by so much at most; and a log may have such pauses.
BACK_MAX_US, PAUSE_MAX_US = US_PER_S, 3600 * US_PER_S
# Later than the one before by no more than this, a time is not looked at any closer.
USUAL_MAX_US = 10 * US_PER_S

WRONG_TIME = "record with a wrong time"
TIME_JUMPS = "time jumps"

_read_stamp = struct.Struct(">Q").unpack_from


def stamp_at(buffer: bytes, start: int) -> int:
    """Microseconds of unix time that the record at `start` begins with."""
    return int(_read_stamp(buffer, start)[0])


class RecordTimes:
    """Judges the time of a record by those of its neighbours.

    Args:
        damage: told of times that are wrong, and of jumps.

    Attributes:
        newest: time of the last record, microseconds; None before the first.
    """

    def __init__(self, damage: DamageReport) -> None:
        self._damage = damage
        self.newest: int | None = None

    def judged(self, buffer: bytes, start: int, end: int, begin: int) -> float | None:
        """Seconds of unix time of a record whose place in the log is beyond doubt.

        A time that fits neither to the record before it nor to one of the two after it is wrong: the record came when
        the one before it did. One that fits to those after it only is believed: the clock was set.

        Args:
            buffer: a part of the log, with `LOOKAHEAD` bytes of what follows the record if there are as many.
            start, end: of the record in it.
            begin: offset of that part.

        Returns:
            None for a wrong time with no record before it.
        """
        stamp, newest = stamp_at(buffer, start), self.newest
        if newest is None or not 0 <= stamp - newest <= USUAL_MAX_US:
            following = _following(buffer, end)
            expected = any(follows(stamp, one) for one in following) if following else newest is None
            steady = newest is not None and follows(newest, stamp)
            if not (expected or (steady and not following)):
                self._damage.add(WRONG_TIME, f"offset {begin + start}")
                return None if newest is None else newest / 1e6
            if newest is not None and not steady:
                self._damage.add(TIME_JUMPS, f"offset {begin + start} by {(stamp - newest) / 1e6:+.0f} s")
        self.newest = stamp
        return stamp / 1e6

    def fits(self, buffer: bytes, start: int, end: int) -> bool:
        """Whether what looks like a record has a time that fits to a neighbour's."""
        stamp = stamp_at(buffer, start)
        if self.newest is not None and follows(self.newest, stamp):
            return True
        return any(follows(stamp, following) for following in _following(buffer, end))


def follows(before: int, stamp: int) -> bool:
    """Whether a record with this time can come behind one with that."""
    return stamp < STAMP_END and -BACK_MAX_US <= stamp - before <= PAUSE_MAX_US


def _following(buffer: bytes, end: int) -> list[int]:
    """Times of the next two records, as far as they are there: one of them may be wrong itself."""
    stamps: list[int] = []
    while len(stamps) < 2 and end + STAMP_SIZE < len(buffer) and buffer[end + STAMP_SIZE] in (MAGIC_1, MAGIC_2):
        stamps.append(stamp_at(buffer, end))
        frame = frame_at(buffer, end + STAMP_SIZE)
        end = len(buffer) if frame is None else frame.end
    return stamps

"""Cuts one direction of a link into whole packets, wherever a serial line or a TCP stream has cut it.

The rules are those of `drivers.mavlink.frames`: a packet whose checksum is right is one; where one ends the next
begins; out of step every magic byte is only a guess. Here nothing is thrown away: what lies between packets, or is
damaged, is passed on as it is. Bytes of a packet that is not whole yet are passed on too, unless they must be held.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from math import inf
from typing import NamedTuple

from drivers.mavlink.formats import CRC_EXTRA
from drivers.mavlink.frames import (
    MAGIC_1,
    MAGIC_2,
    PATIENCE_S,
    Frame,
    flags_supported,
    frame_at,
    has_right_checksum,
)

_MAGIC = re.compile(bytes((ord("["), MAGIC_1, MAGIC_2, ord("]"))))

# Whether the bytes of a packet that is not whole yet must wait for the rest; None: not even its header is there.
Holds = Callable[[Frame | None], bool]


class Stretch(NamedTuple):
    """Neighbouring bytes of a stream.

    Attributes:
        data: what has not been passed on yet.
        packet: the whole packet that ends here, with what of it was passed on before; None: these bytes end none.
        frame: header of that packet, with offsets from somewhere before it.
    """

    data: bytes
    packet: bytes | None = None
    frame: Frame | None = None

    @property
    def whole(self) -> bool:
        """Whether nothing of its packet has been passed on yet."""
        return self.packet is not None and len(self.data) == len(self.packet)


class PacketStream:
    """One direction of a link."""

    def __init__(self) -> None:
        self._tail = b""  # begins with what may become a packet
        self._passed = 0  # bytes of it that were given out
        self._in_step = True
        self._fed_s = -inf

    @property
    def begun(self) -> bool:
        """Whether a packet has begun of which the rest is to come."""
        return bool(self._tail)

    @property
    def holding(self) -> bool:
        """Whether something waits to become whole."""
        return self._passed < len(self._tail)

    @property
    def release_s(self) -> float:
        """When what waits has waited long enough; infinity: nothing does."""
        return self._fed_s + PATIENCE_S if self.holding else inf

    def feed(self, data: bytes, time_s: float, holds: Holds) -> list[Stretch]:
        """Take the next bytes; what can be passed on now, in the order of the stream.

        Args:
            data: as received, cut anywhere.
            time_s: reception.
            holds: asked about a packet that has begun.
        """
        if self._tail and time_s - self._fed_s > PATIENCE_S:
            self._in_step = False
        self._fed_s = time_s
        buffer = self._tail + data if self._tail else data
        done, stretches = 0, list[Stretch]()
        while (found := self._search(buffer, done)) is not None:
            start, frame = found
            if start > done:
                stretches.append(Stretch(self._unpassed(buffer, done, start)))
            packet = buffer[start : frame.end] if start or frame.end < len(buffer) else buffer
            stretches.append(Stretch(self._unpassed(buffer, start, frame.end, packet), packet, frame))
            done, self._in_step = frame.end, True
        if done < len(buffer):
            stretches.append(Stretch(self._keep(buffer, done, holds)))
        else:
            self._tail, self._passed = b"", 0
        return stretches

    def release(self) -> bytes:
        """What waits, now that the rest of it has not come in its time."""
        held, self._passed = self._tail[self._passed :], len(self._tail)
        return held

    def _search(self, buffer: bytes, done: int) -> tuple[int, Frame] | None:
        """The first whole packet behind `done`; `_in_step` is then whether one may go on at `done`."""
        place = done
        while (match := _MAGIC.search(buffer, place)) is not None:
            start = match.start()
            in_step = self._in_step and start == done
            frame = frame_at(buffer, start) if flags_supported(buffer, start) else None
            if frame is not None and frame.end <= len(buffer):
                if _good(buffer, start, frame, in_step):
                    return start, frame
            elif in_step and flags_supported(buffer, start):
                return None
            self._in_step = False
            place = start + 1
        return None

    def _keep(self, buffer: bytes, done: int, holds: Holds) -> bytes:
        """Keep from the first guess on that later bytes may complete; what is to be passed on behind `done`."""
        keep = next(
            (at.start() for at in _MAGIC.finditer(buffer, done) if _may_become_whole(buffer, at.start())), None
        )
        if keep is None:
            given = self._unpassed(buffer, done, len(buffer))
            self._tail, self._passed = b"", 0
            self._in_step = False
            return given
        end = keep if holds(frame_at(buffer, keep)) and keep >= self._passed else len(buffer)
        given = self._unpassed(buffer, done, end)
        self._in_step = self._in_step and keep == done
        self._tail, self._passed = buffer[keep:], max(end, self._passed) - keep
        return given

    def _unpassed(self, buffer: bytes, start: int, end: int, cut: bytes | None = None) -> bytes:
        """The part of a stretch that has not been passed on: the very object `cut` where that is all of it."""
        first = max(start, self._passed)
        if first == start and cut is not None:
            return cut
        return buffer[first:end]


def _good(buffer: bytes, start: int, frame: Frame, in_step: bool) -> bool:
    """Whether a packet is to be believed: unknown ones have no checksum, and are where they fit in between others."""
    if frame.message_id in CRC_EXTRA:
        return has_right_checksum(buffer, start, frame)
    return in_step and (frame.end == len(buffer) or buffer[frame.end] in (MAGIC_1, MAGIC_2))


def _may_become_whole(buffer: bytes, start: int) -> bool:
    frame = frame_at(buffer, start)
    return flags_supported(buffer, start) and (frame is None or frame.end > len(buffer))

"""What waits to be written, in memory: the event loop and the judging put it in, the recorder's thread empties it."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Lock

from drivers.can.frame_block import FrameBlock
from drivers.readings import Reading
from gateway.pipeline import Outcome
from gateway.recording.entries import Heard, Spoken, Tick, Told
from gateway.recording.items import Came, Decoded, Gap, Item, Received, frames_size, lost_of, size_of

WAITING_MAX_BYTES = 64_000_000
# what can be worked out again from the rest gives way first
DECODED_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class Batch:
    """Items in their order, and the bytes of memory that they take."""

    items: tuple[Item, ...]
    size: int


class Waiting:
    """The `Journal` of a run. Nothing here waits for anything but a moment of the other threads.

    Args:
        now: the time, unix seconds.
        most_bytes: of memory for what waits; what finds no room is counted, and the gap is written down.

    Attributes:
        lost: what found no room, by what it was.
    """

    def __init__(self, now: Callable[[], float], most_bytes: int = WAITING_MAX_BYTES) -> None:
        self._now, self._most_bytes = now, most_bytes
        self._place = self._bytes = 0
        self._waiting: deque[tuple[Item, int]] = deque()
        self._missing: Counter[str] = Counter()
        self._lock = Lock()
        self.lost: Counter[str] = Counter()

    @property
    def place(self) -> int:
        """Of what was written down last; 0 before the first."""
        return self._place

    @property
    def waiting_bytes(self) -> int:
        """Of memory, for what is not written yet."""
        return self._bytes

    def frames(self, bus: str, frames: FrameBlock) -> None:
        """See `Journal`."""
        first = self._place + 1
        self._place += len(frames)
        self._put(Received(bus, frames, first), frames_size(frames))

    def heard(self, data: bytes, time_s: float) -> None:
        """See `Journal`."""
        self._place += 1
        self._put(Heard(self._place, time_s, data))

    def said(self, data: bytes, time_s: float) -> None:
        """See `Journal`."""
        self._place += 1
        self._put(Spoken(self._place, time_s, data))

    def reading(self, link: str, reading: Reading, before: int | None = None) -> None:
        """See `Journal`."""
        self._place += 1
        self._put(Told(self._place, link, reading, before))

    def now(self, time_s: float) -> None:
        """See `Journal`."""
        self._place += 1
        self._put(Tick(self._place, time_s))

    def decoded(self, link: str, readings: Sequence[Reading]) -> None:
        """See `Journal`."""
        self._put(Decoded(link, readings), share=DECODED_SHARE)

    def outcomes(self, outcomes: Sequence[Outcome], time_s: float) -> None:
        """See `Journal`."""
        if outcomes:
            self._put(Came(self._place, time_s, outcomes))

    def take(self, most_bytes: int) -> Batch | None:
        """What has waited longest, about so much of it; None: nothing waits. Its room is free after `release`."""
        with self._lock:
            items: list[Item] = self._gaps()
            size = 0
            while self._waiting and size < most_bytes:
                item, item_size = self._waiting.popleft()
                items.append(item)
                size += item_size
        return Batch(tuple(items), size) if items else None

    def release(self, batch: Batch) -> None:
        """A batch is written."""
        with self._lock:
            self._bytes -= batch.size

    def give_up(self, batch: Batch) -> None:
        """A batch will not be written."""
        with self._lock:
            self._bytes -= batch.size
            for item in batch.items:
                if isinstance(item, Gap):
                    self._missing[item.cause] += item.count
                else:
                    self._miss(item)

    def _put(self, item: Item, size: int | None = None, share: float = 1.0) -> None:
        size = size_of(item) if size is None else size
        with self._lock:
            if self._bytes + size > share * self._most_bytes:
                self._miss(item)
                return
            self._bytes += size
            self._waiting.append((item, size))

    def _miss(self, item: Item) -> None:
        what, count = lost_of(item)
        self.lost[what] += count
        self._missing[what] += count

    def _gaps(self) -> list[Item]:
        """What found no room since the last time, in front of what waits, though some of that came before it."""
        time_s = self._now()
        gaps: list[Item] = [Gap(self._place, time_s, what, count) for what, count in self._missing.items()]
        self._missing.clear()
        return gaps

"""From the links to the judging: all that comes in or goes out is written down in the order in which it is judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.can.frame_block import FrameBlock
from drivers.readings import Reading
from gateway.judging import Work
from gateway.pipeline import Arrival
from gateway.recording.journal import Journal, NoJournal


class Intake:
    """What links, operator and ticker hand their news to, all in the event loop.

    After `close`, what still comes in is neither judged nor written down; what goes out is.

    Args:
        put: takes work for the judging; False where it takes none.
        journal: where it is written down.
        show: is shown each reading that no decoder has made.
    """

    def __init__(
        self,
        put: Callable[[Work], bool],
        journal: Journal | None = None,
        show: Callable[[Reading], None] = lambda _: None,
    ) -> None:
        self._put, self._journal, self._show = put, journal or NoJournal(), show
        self._closed = False
        self._first = 1

    @property
    def first(self) -> int:
        """Place in the journal of the first of what is being handed over."""
        return self._first

    def close(self) -> None:
        """From now on nothing is judged any more."""
        self._closed = True

    def frames(self, bus: str, frames: FrameBlock) -> None:
        """Frames of a bus, as received; what they complete is given to `decoded` next."""
        if not self._closed:
            self._first = self._journal.place + 1
            self._journal.frames(bus, frames)

    def heard(self, data: bytes, time_s: float) -> None:
        """Bytes of the autopilot's link, as received; what they complete is given to `decoded` next."""
        if not self._closed:
            self._first = self._journal.place + 1
            self._journal.heard(data, time_s)

    def said(self, data: bytes, time_s: float) -> None:
        """A MAVLink packet of ours."""
        self._journal.said(data, time_s)

    def decoded(self, link: str, readings: Sequence[Reading]) -> None:
        """What a decoder has made of what was received last."""
        if readings and not self._closed:
            self._journal.decoded(link, readings)
            self._put(Arrival(link, readings))

    def reading(self, link: str, reading: Reading) -> bool:
        """One that no decoder has made; False where nothing is judged any more."""
        if self._closed:
            return False
        self._first = self._journal.place + 1
        self._journal.reading(link, reading)
        self._show(reading)
        return self._put(Arrival(link, [reading]))

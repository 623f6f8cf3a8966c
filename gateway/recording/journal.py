"""Where a run writes down all that comes in and goes out, in the order in which it is judged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Protocol

from drivers.can.frame_block import FrameBlock
from drivers.readings import Reading
from gateway.pipeline import Outcome


class Journal(Protocol):
    """What the running gateway tells its recorder.

    All but `outcomes` is called in the event loop, and never waits nor raises. Each of `frames` (one place for each
    frame), `heard`, `said`, `reading` and `now` takes the next place; a replay goes by these places.
    """

    @property
    def place(self) -> int:
        """Of what was written down last; 0 before the first."""
        ...

    @property
    def lost(self) -> Counter[str]:
        """What was not written down, by what it was."""
        ...

    @property
    def recorded_bytes(self) -> int | None:
        """That are on disk by now; None: nothing is written down."""
        ...

    def state_words(self) -> str:
        """How it goes; empty where nothing is written down."""
        ...

    def begin(self, state: bytes, resumed: bool) -> None:
        """The run begins. See `entries.About` for what it begins with."""
        ...

    def remember(self, state: bytes) -> None:
        """What has been learnt by now."""
        ...

    def close(self, within_s: float) -> bool:
        """The run is over; False where not all could be written down in this time."""
        ...

    def frames(self, bus: str, frames: FrameBlock) -> None:
        """Of a bus that is read directly, as received, before they are decoded."""
        ...

    def heard(self, data: bytes, time_s: float) -> None:
        """Came over the MAVLink link, as received, before it is decoded."""
        ...

    def said(self, data: bytes, time_s: float) -> None:
        """One MAVLink packet of ours."""
        ...

    def reading(self, link: str, reading: Reading, before: int | None = None) -> None:
        """One that no decoder has made: state of a link, load of a bus, an operator's word, our own lateness.

        `before`: it is judged in front of what stands at this place; None: in its turn.
        """
        ...

    def now(self, time_s: float) -> None:
        """The pipeline is told the time."""
        ...

    def decoded(self, link: str, readings: Sequence[Reading]) -> None:
        """What the decoders made of it: to be looked at, and not to be replayed."""
        ...

    def outcomes(self, outcomes: Sequence[Outcome], time_s: float) -> None:
        """What came of it, with the time; called in the judging's thread."""
        ...


class NoJournal:
    """Nothing is recorded."""

    @property
    def place(self) -> int:
        """There is none."""
        return 0

    @property
    def lost(self) -> Counter[str]:
        """Nothing that should have been written down."""
        return Counter()

    @property
    def recorded_bytes(self) -> int | None:
        """None."""
        return None

    def state_words(self) -> str:
        """None."""
        return ""

    def begin(self, state: bytes, resumed: bool) -> None:
        """Nothing."""

    def remember(self, state: bytes) -> None:
        """Nothing."""

    def close(self, within_s: float) -> bool:
        """There is nothing to write."""
        return True

    def frames(self, bus: str, frames: FrameBlock) -> None:
        """Nothing."""

    def heard(self, data: bytes, time_s: float) -> None:
        """Nothing."""

    def said(self, data: bytes, time_s: float) -> None:
        """Nothing."""

    def reading(self, link: str, reading: Reading, before: int | None = None) -> None:
        """Nothing."""

    def now(self, time_s: float) -> None:
        """Nothing."""

    def decoded(self, link: str, readings: Sequence[Reading]) -> None:
        """Nothing."""

    def outcomes(self, outcomes: Sequence[Outcome], time_s: float) -> None:
        """Nothing."""

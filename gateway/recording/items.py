"""What waits to be written: what is replayed (`gateway.recording.entries`), and what is only looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from drivers.can.frame_block import FrameBlock
from drivers.readings import Reading
from gateway.pipeline import Outcome
from gateway.recording.entries import Found, Heard, Spoken, Tick, Told


class Received(NamedTuple):
    """Frames of a bus, in order. `first`: place of the first of them; there may be thousands of these in a second."""

    bus: str
    frames: FrameBlock
    first: int


@dataclass(frozen=True, slots=True)
class Decoded:
    """Readings of a link, as a decoder made them."""

    link: str
    readings: Sequence[Reading]


@dataclass(frozen=True, slots=True)
class Came:
    """Outcomes of the judging, when `place` was what had been written down last."""

    place: int
    time_s: float
    outcomes: Sequence[Outcome]


@dataclass(frozen=True, slots=True)
class Gap:
    """Something is missing behind this place: there was no room for it, or no disk to write it to."""

    place: int
    time_s: float
    cause: str
    count: int


Item: TypeAlias = Received | Heard | Spoken | Told | Tick | Found | Decoded | Came | Gap

# bytes in memory, roughly, of one item and of one in it
_ITEM_BYTES, _FRAME_BYTES, _READING_BYTES, _OUTCOME_BYTES = 600, 24, 200, 700


def size_of(item: Item) -> int:
    """Bytes of memory that it takes, roughly."""
    match item:
        case Received(_, frames):
            return frames_size(frames)
        case Heard(data=data) | Spoken(data=data):
            return _ITEM_BYTES + len(data)
        case Decoded(readings=readings):
            return _ITEM_BYTES + _READING_BYTES * len(readings)
        case Came(outcomes=outcomes):
            return _ITEM_BYTES + _OUTCOME_BYTES * len(outcomes)
        case _:
            return _ITEM_BYTES


def frames_size(frames: FrameBlock) -> int:
    """Bytes of memory that such an item takes, roughly."""
    return _ITEM_BYTES + _FRAME_BYTES * len(frames) + int(frames.data.size)


def lost_of(item: Item) -> tuple[str, int]:
    """What is missing without it, in words, and how many of it."""
    match item:
        case Received(_, frames):
            return "frames", len(frames)
        case Heard() | Spoken():
            return "MAVLink packets", 1
        case Told():
            return "events", 1
        case Decoded(readings=readings):
            return "decoded readings", len(readings)
        case Came(outcomes=outcomes):
            return "outcomes", len(outcomes)
        case _:
            return "ticks", 1


def first_place(items: Sequence[Item]) -> int:
    """The first place in these items; of those that have none, what comes next."""
    for item in items:
        match item:
            case Received(first=place):
                return place
            case Heard(place=place) | Spoken(place=place) | Told(place=place) | Tick(place=place):
                return place
    return 1 + max((item.place for item in items if isinstance(item, Came | Gap | Found)), default=0)

"""Frames of several buses and single entries, brought into the order of their places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from drivers.can.frame_block import FD, FrameBlock
from gateway.recording.entries import Entry, Found, Frames, Heard, Spoken, Tick, Told
from gateway.recording.frame_rows import Placed

Single = Heard | Spoken | Told | Tick | Found


def in_order(buses: Mapping[str, Placed], singles: Sequence[Single]) -> list[Entry]:
    """One after the other: of frames, as long runs of one bus as nothing else comes between.

    A finding stands behind what has its place.
    """
    names, placed = list(buses), list(buses.values())
    places = [place for place, _ in placed] + [np.array([one.place for one in singles], dtype=np.int64)]
    late = np.zeros(sum(map(len, places)), dtype=np.int64)
    late[len(late) - len(singles) :] = [isinstance(one, Found) for one in singles]
    source = np.repeat(
        np.arange(len(placed) + len(singles)), [*(len(place) for place, _ in placed), *(1 for _ in singles)]
    )
    order = np.lexsort((late, np.concatenate(places)))
    source = source[order]
    return list(_runs(source, names, placed, singles))


def _runs(
    source: np.ndarray[tuple[int], np.dtype[np.int64]],
    names: Sequence[str],
    placed: Sequence[Placed],
    singles: Sequence[Single],
) -> Iterator[Entry]:
    """Of each run of one source, its entry; the frames of a bus are in order already."""
    starts = np.flatnonzero(np.diff(source, prepend=-1))
    lengths = np.diff(starts, append=len(source))
    done = [0] * len(names)
    for number, length in zip(source[starts].tolist(), lengths.tolist(), strict=True):
        if number >= len(names):
            yield singles[number - len(names)]
            continue
        place, block = placed[number]
        rows = slice(done[number], done[number] + length)
        done[number] += length
        yield Frames(names[number], _narrow(block.part(rows)), place[rows])


def _narrow(block: FrameBlock) -> FrameBlock:
    """Without room for long data where no frame is of CAN FD."""
    if block.data.shape[1] == 8 or (block.kind & FD).any():
        return block
    return FrameBlock(block.time_s, block.identifier, block.kind, block.length, block.data[:, :8])

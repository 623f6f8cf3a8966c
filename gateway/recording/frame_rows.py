"""Frames of the buses, from the rows that they are recorded as."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CLASSIC_DATA_BYTES, EXTENDED_MASK, FD_DATA_BYTES, STANDARD_MASK
from drivers.can.frame_block import ERROR, EXTENDED, FD, FrameBlock
from gateway.recording.times import seconds

Placed: TypeAlias = tuple[NDArray[np.int64], FrameBlock]


class FrameRows:
    """Rows of several buses, by bus."""

    def __init__(self) -> None:
        self._parts: defaultdict[str, list[Placed]] = defaultdict(list)

    def add(self, bus: str, fd: bool, rows: NDArray[Any], place: NDArray[np.int64]) -> int:
        """Takes rows of a bus; returns how many of them are no frames.

        Args:
            bus: its name.
            fd: they are of CAN FD.
            rows: (N,) of `record_row(can_layout(bus, fd))`.
            place: (N,) of each.
        """
        good = _are_frames(rows, fd)
        if not good.all():
            rows, place = rows[good], place[good]
        if len(rows):
            self._parts[bus].append((place, _block(rows, fd)))
        return int((~good).sum())

    def placed(self) -> dict[str, Placed]:
        """All frames of each bus, in the order of their places."""
        return {bus: _in_place_order(parts) for bus, parts in self._parts.items()}


def _are_frames(rows: NDArray[Any], fd: bool) -> NDArray[np.bool_]:
    most = FD_DATA_BYTES if fd else CLASSIC_DATA_BYTES
    wide = rows["message.is_extended"] | rows["message.is_error"]
    good: NDArray[np.bool_] = rows["message.id"] <= np.where(wide, EXTENDED_MASK, STANDARD_MASK)
    return good & (rows["message.length"] <= most)


def _block(rows: NDArray[Any], fd: bool) -> FrameBlock:
    extended, error = rows["message.is_extended"], rows["message.is_error"]
    kind = extended * np.uint8(EXTENDED) | error * np.uint8(ERROR) | np.uint8(FD if fd else 0)
    return FrameBlock(
        seconds(rows["log_time"]),
        rows["message.id"].astype(np.uint32),
        kind.astype(np.uint8),
        rows["message.length"].copy(),
        rows["message.data"].copy(),
    )


def _in_place_order(parts: Sequence[Placed]) -> Placed:
    place = np.concatenate([one for one, _ in parts])
    block = _joined([one for _, one in parts])
    if (place[1:] > place[:-1]).all():
        return place, block
    order = np.argsort(place, kind="stable")
    return place[order], block.part(order)


def _joined(blocks: Sequence[FrameBlock]) -> FrameBlock:
    if len(blocks) == 1:
        return blocks[0]
    width = max(one.data.shape[1] for one in blocks)
    return FrameBlock(
        np.concatenate([one.time_s for one in blocks]),
        np.concatenate([one.identifier for one in blocks]),
        np.concatenate([one.kind for one in blocks]),
        np.concatenate([one.length for one in blocks]),
        np.concatenate([np.pad(one.data, ((0, 0), (0, width - one.data.shape[1]))) for one in blocks]),
    )

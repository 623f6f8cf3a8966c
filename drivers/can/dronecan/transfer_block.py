"""Transfers of one data type put together from many frames at once: exactly what `TransferReceiver` makes of them.

A transfer whose frames all came, in their order and with a right CRC, is taken by whatever state its receiver is in,
if the one before it was such a transfer, too, with another transfer id: then nothing was open, and it is no
repetition. Those are put together by numpy. All other frames, with the first transfer after them, go through the
receiver of their node one by one.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.dronecan.transfer import (
    CRC_BYTES,
    END_OF_TRANSFER,
    SOURCE_MASK,
    START_OF_TRANSFER,
    TOGGLE,
    TRANSFER_ID_MASK,
    TRANSFER_TIMEOUT_S,
    DataType,
    TransferReceiver,
)
from drivers.can.frame import CLASSIC_DATA_BYTES
from drivers.can.frame_block import FrameBlock

Integers: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]
Bytes: TypeAlias = NDArray[np.uint8]
Bools: TypeAlias = NDArray[np.bool_]

STEP = CLASSIC_DATA_BYTES - 1  # bytes of payload in a frame


@dataclass(frozen=True, slots=True)
class Transfers:
    """N complete transfers of one data type, in the order in which they were completed.

    Attributes:
        row: (N,) ascending, of the frame that completed it, in its block.
        source: (N,) node ids.
        time_s: (N,) of that frame.
        size: (N,) bytes of payload.
        payload: (N, most bytes of the type), zero behind `size`.
    """

    row: Integers
    source: Integers
    time_s: Floats
    size: Integers
    payload: Bytes

    def __len__(self) -> int:
        return len(self.row)

    def part(self, which: Bools | Integers) -> Transfers:
        """Some of them."""
        return Transfers(
            self.row[which], self.source[which], self.time_s[which], self.size[which], self.payload[which]
        )


class _Frames:
    """Frames of one data type, node after node, and of a node in their order; cut before every start of a transfer.

    Attributes:
        row, source, time_s, length, data: (M,) columns of the frames; data (M, 8).
        tail: (M,) last byte of each; 0 of an empty one.
        first: (G,) place of the first frame of each group.
        count: (G,) frames of each group.
        last: (G,) place of the last frame of each group.
        size: (G,) bytes in all frames of each group, where all but the last are full.
    """

    def __init__(self, block: FrameBlock, rows: Integers) -> None:
        source = (block.identifier[rows] & SOURCE_MASK).astype(np.uint8)
        order = np.argsort(source, kind="stable")
        self.row = rows[order]
        self.source = source[order]
        self.time_s = block.time_s[self.row]
        self.length = block.length[self.row].astype(np.int64)
        self.data = np.ascontiguousarray(block.data[self.row, :CLASSIC_DATA_BYTES])
        self.tail = self.data[np.arange(len(rows)), np.maximum(self.length, 1) - 1]
        begins = (self.tail & START_OF_TRANSFER != 0) & (self.length > 0)
        begins[1:] |= self.source[1:] != self.source[:-1]
        begins[:1] = True
        self.first = np.flatnonzero(begins)
        self.last = np.append(self.first[1:], len(rows)) - 1
        self.count = self.last - self.first + 1
        self.size = STEP * (self.count - 1) + self.length[self.last] - 1
        self._bytes = b""

    def frame(self, place: int) -> tuple[bytes, float]:
        """Data and time of one."""
        if not self._bytes:
            self._bytes = self.data.tobytes()
        begin = CLASSIC_DATA_BYTES * place
        return self._bytes[begin : begin + self.length[place]], float(self.time_s[place])

    def whole(self, data_type: DataType) -> Bools:
        """(G,) whether the frames of a group make a transfer, but for its CRC."""
        place = np.arange(len(self.row)) - np.repeat(self.first, self.count)
        ends = np.zeros(len(self.row), np.bool_)
        ends[self.last] = True
        expected = np.where(place == 0, START_OF_TRANSFER, 0) | np.where(ends, END_OF_TRANSFER, 0)
        expected |= np.where(place & 1, TOGGLE, 0) | np.repeat(self.tail[self.first] & TRANSFER_ID_MASK, self.count)
        passed_s = self.time_s - np.repeat(self.time_s[self.first], self.count)
        fits = (self.tail == expected) & (passed_s >= 0.0) & (passed_s < TRANSFER_TIMEOUT_S)
        fits &= np.where(ends, self.length > 0, self.length == CLASSIC_DATA_BYTES)
        whole: Bools = np.logical_and.reduceat(fits, self.first) & (self.size <= data_type.payload_max + CRC_BYTES)
        return whole


def receive(
    data_type: DataType, block: FrameBlock, rows: Integers, receiver_of: Callable[[int], TransferReceiver]
) -> Transfers:
    """Takes the next frames of a data type.

    Args:
        data_type: what the frames are of.
        block: frames; of these, `rows`, ascending: classic ones with a source node.
        receiver_of: the receiver of a node, for this type.

    Returns:
        what is completed by them.
    """
    if not len(rows):
        nothing = np.empty(0, np.int64)
        return Transfers(nothing, nothing, np.empty(0), nothing, np.empty((0, data_type.payload_max), np.uint8))
    frames = _Frames(block, rows)
    whole = np.flatnonzero(frames.whole(data_type))
    payload, right = _payloads(data_type, frames, whole)
    place_of = np.full(len(frames.first), -1)
    place_of[whole[right]] = np.flatnonzero(right)
    at_once = _follow_each_other(frames, place_of >= 0)
    late = _one_by_one(frames, at_once, receiver_of)
    groups = np.flatnonzero(at_once)
    return _join(data_type, frames, groups, payload[place_of[groups]], late)


def _payloads(data_type: DataType, frames: _Frames, groups: Integers) -> tuple[Bytes, Bools]:
    """(N, most bytes) payloads of whole groups, and (N,) whether their CRC is right."""
    count, size = frames.count[groups], frames.size[groups]
    width = -(-(data_type.payload_max + CRC_BYTES) // STEP) * STEP
    packed = np.zeros((len(groups), width), np.uint8)
    for place in range(width // STEP):
        having = np.flatnonzero(count > place)
        packed[having, STEP * place : STEP * (place + 1)] = frames.data[frames.first[groups[having]] + place, :STEP]
    tailed = np.flatnonzero(size < STEP * count)  # a last frame that is not full: its tail is no payload
    packed[tailed, size[tailed]] = 0
    several = count > 1
    shifted = packed[:, CRC_BYTES : CRC_BYTES + data_type.payload_max]
    payload = np.where(several[:, None], shifted, packed[:, : data_type.payload_max])
    received = packed[:, 0].astype(np.uint16) | packed[:, 1].astype(np.uint16) << 8
    right = ~several
    for one in np.unique(size[several]).tolist():
        same = np.flatnonzero(several & (size == one))
        right[same] = crc(data_type, payload[same, : one - CRC_BYTES]) == received[same]
    return payload, right


def crc(data_type: DataType, payload: Bytes) -> NDArray[np.uint16]:
    """(N,) CRC of (N, size) payloads: it is linear, so that every byte has its share by its distance from the end."""
    size = payload.shape[1]
    total = np.full(len(payload), data_type.crc(bytes(size)), np.uint16)
    for place in range(size):
        total ^= _share(size - 1 - place)[payload[:, place]]
    return total


@lru_cache(maxsize=64)
def _share(distance: int) -> NDArray[np.uint16]:
    """(256,) what a byte with so many behind it does to a CRC."""
    return np.array([crc_hqx(bytes([byte]) + bytes(distance), 0) for byte in range(256)], np.uint16)


def _follow_each_other(frames: _Frames, good: Bools) -> Bools:
    """(G,) good groups right behind a good group of the same node that has another transfer id."""
    source, transfer_id = frames.source[frames.first], frames.tail[frames.first] & TRANSFER_ID_MASK
    follows = np.zeros(len(good), np.bool_)
    follows[1:] = good[1:] & good[:-1] & (source[1:] == source[:-1]) & (transfer_id[1:] != transfer_id[:-1])
    return follows


def _one_by_one(
    frames: _Frames, at_once: Bools, receiver_of: Callable[[int], TransferReceiver]
) -> list[tuple[int, bytes]]:
    """Gives all other groups to their receivers, and brings these up to date; (place of last frame, payload) each.

    Where a receiver does not take what comes right before a group that is taken at once, `at_once` is corrected.
    """
    completed: list[tuple[int, bytes]] = []
    first, last = frames.first.tolist(), frames.last.tolist()
    source = frames.source[frames.first].tolist()
    groups = len(first)
    for begin in np.flatnonzero(~at_once).tolist():
        group, receiver = begin, receiver_of(source[begin])
        if group and source[group - 1] == source[group] and at_once[group - 1]:
            receiver.resume(*frames.frame(last[group - 1]))
        while True:
            completed += _feed(frames, range(first[group], last[group] + 1), receiver)
            if group + 1 == groups or not at_once[group + 1]:
                break
            data, time_s = frames.frame(last[group])
            if receiver.completed(data[-1] & TRANSFER_ID_MASK, time_s):
                break
            group += 1
            at_once[group] = False
    newest = np.append(np.flatnonzero(np.diff(frames.source[frames.first])), groups - 1)  # of each node
    for group in newest[at_once[newest]].tolist():
        receiver_of(source[group]).resume(*frames.frame(last[group]))
    return completed


def _feed(frames: _Frames, places: range, receiver: TransferReceiver) -> list[tuple[int, bytes]]:
    payloads = ((place, receiver.accept(*frames.frame(place))) for place in places)
    return [(place, payload) for place, payload in payloads if payload is not None]


def _join(
    data_type: DataType, frames: _Frames, groups: Integers, payload: Bytes, late: list[tuple[int, bytes]]
) -> Transfers:
    """What was put together at once and what was one by one, in the order of the last frames."""
    places = np.concatenate([frames.last[groups], np.array([place for place, _ in late], np.int64)])
    packed = b"".join(one.ljust(data_type.payload_max, b"\0") for _, one in late)
    payloads = np.concatenate([payload, np.frombuffer(packed, np.uint8).reshape(-1, data_type.payload_max)])
    several = frames.count[groups] > 1
    sizes = frames.size[groups] - np.where(several, CRC_BYTES, 0)
    size = np.concatenate([sizes, np.array([len(one) for _, one in late], np.int64)])
    order = np.argsort(frames.row[places], kind="stable")
    places = places[order]
    return Transfers(
        frames.row[places],
        frames.source[places].astype(np.int64),
        frames.time_s[places],
        size[order],
        payloads[order],
    )

"""How much of its time a CAN bus carries frames, from what was counted on it.

Bits of a classic frame: R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien, "Controller Area Network (CAN)
schedulability analysis: Refuted, revisited and revised", 2007, equations 1 to 3; of a CAN FD frame: ISO 11898-1.
How many bits are stuffed depends on the data: none to a fourth of those that can be. A tenth is assumed, so that
the share is right to some 8 % of itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CanFrame
from drivers.can.frame_block import EXTENDED, FD, FrameBlock

STUFFED = 0.1
# Bits that may have stuff bits among them, without data; and those that never have, with the pause after a frame.
CLASSIC_STUFFABLE = {False: 34, True: 54}
CLASSIC_FIXED = 13
# CAN FD at the nominal bit rate: as far as the bit rate switch; and acknowledgement, end of frame, pause
FD_STUFFABLE = {False: 17, True: 36}
FD_FIXED = 12
# ... and at that of the data: error state and length; the delimiter, and the checksum with its own stuff bits
FD_DATA_STUFFABLE = 5
FD_SHORT_DATA_BYTES = 16
FD_SHORT_CHECKSUM, FD_LONG_CHECKSUM = 28, 33


@dataclass(frozen=True, slots=True)
class BitRates:
    """How fast a bus is.

    Attributes:
        nominal: bit/s.
        data: bit/s of the data of CAN FD frames; None: as fast as the rest.

    Raises:
        ValueError: not above 0.
    """

    nominal: int
    data: int | None = None

    def __post_init__(self) -> None:
        if self.nominal <= 0 or (self.data is not None and self.data <= 0):
            raise ValueError(f"bit rates must be above 0 bit/s, got {self.nominal} and {self.data}")


@dataclass(frozen=True, slots=True)
class Traffic:
    """Frames and their data, counted from some instant on."""

    frames: int
    data_bytes: int

    def since(self, earlier: Traffic) -> Traffic:
        """What has come since then."""
        return Traffic(self.frames - earlier.frames, self.data_bytes - earlier.data_bytes)


def overhead_s(frame: CanFrame, rates: BitRates) -> float:
    """Time that a frame takes on the bus beside its data."""
    if not frame.fd:
        return (CLASSIC_STUFFABLE[frame.extended] * (1.0 + STUFFED) + CLASSIC_FIXED) / rates.nominal
    checksum = FD_SHORT_CHECKSUM if len(frame.data) <= FD_SHORT_DATA_BYTES else FD_LONG_CHECKSUM
    nominal_bits = FD_STUFFABLE[frame.extended] * (1.0 + STUFFED) + FD_FIXED
    data_bits = FD_DATA_STUFFABLE * (1.0 + STUFFED) + checksum
    return nominal_bits / rates.nominal + data_bits / (rates.data or rates.nominal)


def byte_s(frame: CanFrame, rates: BitRates) -> float:
    """Time that one byte of a frame's data takes on the bus."""
    rate = rates.data if frame.fd and rates.data is not None else rates.nominal
    return 8.0 * (1.0 + STUFFED) / rate


# What makes a difference to the time that a frame takes: one of each, in the order of `_sorts`
_SORTS = tuple(
    CanFrame(0.0, 0, bytes(data_bytes), extended=extended, fd=fd)
    for data_bytes, fd in ((0, False), (0, True), (FD_SHORT_DATA_BYTES + 4, True))
    for extended in (False, True)
)


def _sorts(frames: FrameBlock) -> NDArray[np.intp]:
    """(N,) of which sort of `_SORTS` each frame is."""
    fd = frames.kind & FD != 0
    long = fd & (frames.length > FD_SHORT_DATA_BYTES)
    sorts: NDArray[np.intp] = (frames.kind & EXTENDED != 0) + 2 * (fd + long.astype(np.intp))
    return sorts


class BusLoadMeter:
    """Share of the time in which a bus carries frames.

    What an interface counts are all frames, whatever is read of them, but it does not say of which kind they are:
    they are taken to be as those that were read.

    Args:
        rates: of the bus.
    """

    def __init__(self, rates: BitRates) -> None:
        self._overheads_s = np.array([overhead_s(frame, rates) for frame in _SORTS])
        self._bytes_s = np.array([byte_s(frame, rates) for frame in _SORTS])
        self._read = Traffic(0, 0)
        self._overhead_s = self._data_s = 0.0
        self._before: tuple[float, Traffic, Traffic] | None = None
        # as of a classic frame with a long identifier, until others were read
        usual = CanFrame(0.0, 0, b"")
        self._mean_overhead_s, self._mean_byte_s = overhead_s(usual, rates), byte_s(usual, rates)

    def read(self, frames: FrameBlock) -> None:
        """Takes frames that were read from the bus."""
        sorts = _sorts(frames)
        counts = np.bincount(sorts, minlength=len(_SORTS))
        data_bytes = np.bincount(sorts, weights=frames.length, minlength=len(_SORTS))
        self._read = Traffic(self._read.frames + len(frames), self._read.data_bytes + int(data_bytes.sum()))
        self._overhead_s += float(counts @ self._overheads_s)
        self._data_s += float(data_bytes @ self._bytes_s)

    def share(self, time_s: float, counted: Traffic | None = None) -> float | None:
        """Share of the time since the last call; None at the first, and where the interface counts anew.

        Args:
            time_s: now.
            counted: by the interface; None: it counts nothing, what was read is all that is known.
        """
        before, self._before = self._before, (time_s, self._read, self._read if counted is None else counted)
        if before is None or time_s <= before[0]:
            return None
        self._weigh(self._read.since(before[1]))
        new = self._before[2].since(before[2])
        if new.frames < 0 or new.data_bytes < 0:
            return None
        busy_s = new.frames * self._mean_overhead_s + new.data_bytes * self._mean_byte_s
        return busy_s / (time_s - before[0])

    def _weigh(self, read: Traffic) -> None:
        """What a frame and a byte take, by those that were read since the last time."""
        if read.frames:
            self._mean_overhead_s = self._overhead_s / read.frames
        if read.data_bytes:
            self._mean_byte_s = self._data_s / read.data_bytes
        self._overhead_s = self._data_s = 0.0

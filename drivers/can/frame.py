"""A CAN frame as it was received, and which frames are wanted: values that every CAN bus and decoder shares."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.construction import constructor

STANDARD_MASK = 0x7FF
EXTENDED_MASK = 0x1FFF_FFFF
CLASSIC_DATA_BYTES = 8
FD_DATA_BYTES = 64


def _check_identifier(name: str, identifier: int, extended: bool) -> None:
    limit = EXTENDED_MASK if extended else STANDARD_MASK
    if not 0 <= identifier <= limit:
        kind = "extended" if extended else "standard"
        raise ValueError(f"{name} of a frame with {kind} identifier must lie in 0..{limit:#x}, got {identifier:#x}")


@dataclass(frozen=True, slots=True)
class CanFrame:
    """One frame.

    Attributes:
        time_s: reception.
        identifier: 29 bits if extended, else 11; of an error frame, the error class bits.
        data: at most 8 bytes, 64 for CAN FD.
        extended: 29-bit identifier.
        fd: CAN FD frame.
        error: not a frame of the bus but the controller's report of an error.

    Raises:
        ValueError: identifier or data out of range, or a time that is no number.
    """

    time_s: float
    identifier: int
    data: bytes
    extended: bool = True
    fd: bool = False
    error: bool = False

    def __post_init__(self) -> None:
        # one look for all frames, thousands a second; what exactly is wrong is asked only where something is
        if not (
            0 <= self.identifier <= (EXTENDED_MASK if self.extended else STANDARD_MASK)
            and len(self.data) <= CLASSIC_DATA_BYTES
            and math.isfinite(self.time_s)
        ):
            self._check()

    def _check(self) -> None:
        _check_identifier("identifier", self.identifier, self.extended or self.error)
        if not math.isfinite(self.time_s):
            raise ValueError(f"time_s must be finite, got {self.time_s}")
        limit = FD_DATA_BYTES if self.fd else CLASSIC_DATA_BYTES
        if len(self.data) > limit:
            raise ValueError(f"data must be at most {limit} bytes, got {len(self.data)}")


# Of time_s, identifier, data, extended, fd and error that were checked before, as those of a block are: at a third of
# the time.
checked_frame = constructor(CanFrame, checked=True)


@dataclass(frozen=True, slots=True)
class CanFilter:
    """Wanted: frames of this kind with `frame.identifier & mask == identifier & mask`.

    Raises:
        ValueError: identifier or mask out of range.
    """

    identifier: int
    mask: int
    extended: bool

    def __post_init__(self) -> None:
        _check_identifier("identifier", self.identifier, self.extended)
        _check_identifier("mask", self.mask, self.extended)

    def matches(self, frame: CanFrame) -> bool:
        """True for a data frame that is wanted; an error frame never is."""
        return (
            not frame.error
            and frame.extended == self.extended
            and (frame.identifier ^ self.identifier) & self.mask == 0
        )

"""What every reader of a CAN wire format offers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Protocol

from drivers.can.frame import CanFilter, CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.reading_block import ReadingBlock
from drivers.readings import Reading


class CanDecoder(Protocol):
    """Frames in, readings out. Pure: it knows no bus and no clock, and no frame makes it raise.

    Attributes:
        drops: what was thrown away, counted by cause.
    """

    drops: Counter[str]

    def filters(self) -> list[CanFilter]:
        """The frames that this decoder reads: all others may be left to the kernel to discard."""
        ...

    def decode(self, frame: CanFrame) -> Sequence[Reading]:
        """Readings that this frame completes; empty for a foreign, unfinished or bad frame."""
        ...

    def decode_block(self, block: FrameBlock) -> ReadingBlock:
        """What `decode` gives of its frames one after the other, readings and drops, and much faster.

        Blocks and single frames may come in any turn: what is unfinished at the end of the one goes on in the next.
        """
        ...

"""Frames lost on the way: gaps in the sequence numbers, which each sender counts up by itself."""

from __future__ import annotations

LOST = "lost in transit"
_LATE = 128  # gaps from here on are steps back: late or repeated, by another route


class SequenceNumbers:
    """The sequence numbers of all senders.

    Attributes:
        expected: the number that comes next, of each sender: system id + 256 * component id.
    """

    def __init__(self) -> None:
        self.expected: dict[int, int] = {}

    def gap(self, sender: int, sequence: int) -> int:
        """Frames of this sender that are missing before this one; none where this one is itself late or repeated."""
        gap = (sequence - self.expected.get(sender, sequence)) & 0xFF
        if gap >= _LATE:
            return 0
        self.expected[sender] = (sequence + 1) & 0xFF
        return gap

"""PX4's ESC messages come in groups of four ESCs, and which groups are to be believed."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan


class EscGroups:
    """Knows PX4 versions that fill every group with the values of the first four ESCs, and only count the index up.

    Two groups of one instant that say the very same of four turning motors are such; what the later ones say is then
    no measurement of theirs, until two groups differ. (PX4's streams/ESC_STATUS.hpp and ESC_INFO.hpp: the index into
    its `esc_status` lacks the group's offset.)
    """

    def __init__(self) -> None:
        self._first: tuple[int, Sequence[float]] = (-1, ())
        self._copied = False

    def is_copy(self, index: int, time_us: int, values: Sequence[float], telling: bool) -> bool:
        """Whether this group has only the first one's values.

        Args:
            index: of its first ESC.
            time_us: the sender's; the same in all groups of an instant.
            values: what it says of its ESCs.
            telling: False where any two groups may say the same: motors at rest, nothing measured.
        """
        if index == 0:
            self._first = (time_us, values)
            return False
        if time_us == self._first[0]:
            same = _same(values, self._first[1])
            self._copied = same and (telling or self._copied)
        return self._copied


def _same(values: Sequence[float], others: Sequence[float]) -> bool:
    """Equal, and NaN where the others are."""
    return all(one == other or (isnan(one) and isnan(other)) for one, other in zip(values, others, strict=True))

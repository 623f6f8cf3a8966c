"""A signed bar of text cells: how far something is off, as a share of what it may be."""

from __future__ import annotations

# shares at both ends; the threshold, 1, stands half-way
FULL = 2.0
CENTRE, THRESHOLD, BLANK = "│", "┊", " "
WHOLE, HALF_RIGHT, HALF_LEFT, CROSSED = "█", "▌", "▐", "╂"
BEYOND_RIGHT, BEYOND_LEFT = "▶", "◀"


def bar(share: float, width: int) -> str:
    """The bar of a share, from the centre to its side; thresholds are marked, and crossed where it is beyond.

    Args:
        share: -1 and 1 are the thresholds; NaN: not known, and there is no bar. What is beyond 2 ends in an arrow.
        width: of the text, odd, 9 cells at least.

    Raises:
        ValueError: a width that has no centre, or no room.
    """
    if width < 9 or width % 2 == 0:
        raise ValueError(f"width = {width}: want an odd number of cells, 9 or more")
    side = width // 2
    right = _side(share, side, WHOLE, HALF_RIGHT, BEYOND_RIGHT)
    left = _side(-share, side, WHOLE, HALF_LEFT, BEYOND_LEFT)
    return left[::-1] + CENTRE + right


def _side(share: float, cells: int, whole: str, half: str, beyond: str) -> str:
    """One side, from the centre outwards."""
    mark = round(cells / FULL)
    halves = round(2 * cells * min(share, FULL) / FULL) if share > 0.0 else 0  # NaN neither
    text = [whole] * (halves // 2) + [half] * (halves % 2)
    text += [BLANK] * (cells - len(text))
    text[mark - 1] = THRESHOLD if halves < 2 * mark else CROSSED
    if share > FULL:
        text[-1] = beyond
    return "".join(text)

"""Frames whose time alone is damaged: one wrong digit, and a frame stands minutes or years from those around it.

What comes after a frame from the future would be late for as long; so such a frame is left out and told. A bus's
frames are logged in the order of their arrival: a clock that is set takes all that follow along, and a silence does
not end before it began. One frame apart from both its neighbours, which follow each other closely, has no other
explanation.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame_block import FloatArray, FrameBlock
from drivers.logs.damage import DamageReport

CAUSE = "time of a frame apart from those around it"
APART_S = 1.0  # far more than frames of one bus are ever mixed up by


def without_spikes(
    blocks: Iterator[tuple[str, FrameBlock]], damage: DamageReport
) -> Iterator[tuple[str, FrameBlock]]:
    """The same blocks without such frames. The last one of a block, whose follower is not known yet, is let pass."""
    before: dict[str, float] = {}
    for interface, block in blocks:
        spikes = _spikes(block.time_s, before.get(interface))
        before[interface] = float(block.time_s[-1])
        if not spikes.any():
            yield interface, block
            continue
        for time_s in block.time_s[spikes].tolist():
            damage.add(CAUSE, f"{interface} at {time_s} s")
        damage.records -= int(spikes.sum())
        yield interface, block.part(~spikes)


def _spikes(time_s: FloatArray, before_s: float | None) -> NDArray[np.bool_]:
    """(N,) which are apart from both neighbours, in the same direction."""
    padded = np.concatenate(([time_s[0] if before_s is None else before_s], time_s))
    step = np.diff(padded)
    up, down = step > APART_S, step < -APART_S
    close = np.abs(padded[2:] - padded[:-2]) <= APART_S
    spikes = np.zeros(len(time_s), dtype=np.bool_)
    spikes[:-1] = close & ((up[:-1] & down[1:]) | (down[:-1] & up[1:]))
    return spikes

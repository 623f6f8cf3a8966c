"""The greatest of all values so far, each forgotten with the same time constant."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CHUNK = 256  # samples after which the scale begins anew: no power of the decay leaves the range of numbers


@dataclass(frozen=True, slots=True)
class FadingMaximum:
    """m_t = max(v_t, decay m_(t-1)), in blocks of any length, bit for bit.

    m_t = decay^t max over s <= t of v_s decay^-s: a running maximum of scaled values, which rounds nothing.

    Attributes:
        decay: 0.7 to 1; from sample to sample.
        scaled: the running maximum, ...
        count: ... this many samples after its scale began.
    """

    decay: float
    scaled: float = 0.0
    count: int = 0

    @classmethod
    def after(cls, decay: float, level: float) -> FadingMaximum:
        """One whose maximum was at this level."""
        return cls(decay, decay * level)

    def over(self, values: FloatArray) -> tuple[FloatArray, FadingMaximum]:
        """(N,) maxima as these values come in, and the state after them; values 0 or more."""
        fade = _powers(self.decay)
        levels, state, start = np.empty_like(values), self, 0
        while start < len(values):
            size = min(CHUNK - state.count, len(values) - start)
            part = fade[state.count : state.count + size]
            scaled = np.maximum(np.maximum.accumulate(values[start : start + size] / part), state.scaled)
            levels[start : start + size] = scaled * part
            start, count = start + size, state.count + size
            state = FadingMaximum(self.decay, float(scaled[-1]), count)
            if count == CHUNK:
                state = self.after(self.decay, float(levels[start - 1]))
        return levels, state


@lru_cache(maxsize=64)
def _powers(decay: float) -> FloatArray:
    powers = decay ** np.arange(float(CHUNK))
    powers.flags.writeable = False
    return powers

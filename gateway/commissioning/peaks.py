"""How often a healthy score will exceed a threshold, from the peaks that it reached in recordings.

Time is cut into blocks, long enough for the greatest score of each to be independent of the others. Of those maxima
the greater part is left out; the excesses of the rest over the level `base` have, by the theorem of Pickands, Balkema
and de Haan, a generalised Pareto distribution: exponential but where the data clearly show a heavier tail. It says
how often scores come that no recording has shown yet, on the assumption that the tail goes on as it begins.

What needs no assumption is said beside: n events in T hours, with the exact (Garwood) 95 % bound of a Poisson rate,
3 / T where there was none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, log
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

BLOCK_S = 10.0
TAIL = 0.3  # share of the blocks that are taken for the tail
TAIL_MIN = 8  # of them, at least
HEAVY_SIGMAS = 2.0  # by which the excesses must scatter more than exponential ones to be taken for heavier
SHAPE_MAX = 0.4
SURE = 0.95


@dataclass(frozen=True, slots=True)
class RateBound:
    """A rate of events, and the one-sided bound that it is below with 95 % probability."""

    per_hour: float
    bound_per_hour: float


def counted(events: int, hours: float) -> RateBound:
    """The rate that so many events in a time stand for.

    Raises:
        ValueError: no time.
    """
    from scipy.special import gammaincinv

    if not hours > 0.0:
        raise ValueError(f"hours = {hours}: want more than none")
    return RateBound(events / hours, float(gammaincinv(events + 1.0, SURE)) / hours)


def block_maxima(time_s: FloatArray, score: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(B,) numbers of the blocks of time that have samples, ascending, and the greatest of (N,) scores in each."""
    number = np.floor(time_s / BLOCK_S)
    blocks, place = np.unique(number, return_inverse=True)
    greatest = np.zeros(len(blocks))
    np.maximum.at(greatest, place, score)
    return blocks, greatest


@dataclass(frozen=True, slots=True)
class Tail:
    """The tail of a score's peaks.

    Attributes:
        base: level that it begins at.
        blocks, over: how many blocks there are, and how many of them have a peak over that.
        scale: mean excess, or the generalised Pareto distribution's scale.
        shape: of it; 0.0 = exponential.
    """

    base: float
    blocks: int
    over: int
    scale: float
    shape: float = 0.0

    @property
    def hours(self) -> float:
        """That it is from."""
        return self.blocks * BLOCK_S / 3600.0

    def rate(self, threshold: float) -> RateBound:
        """How often peaks exceed a threshold at or above `base`, as fitted, and with scale and number bounded."""
        share = self._share(threshold, self.scale)
        likely = self._share(threshold, self.scale * self._scale_bound())
        over = counted(self.over, self.hours)
        return RateBound(over.per_hour * share, over.bound_per_hour * likely)

    def threshold(self, per_hour: float) -> float:
        """What peaks exceed so often, as fitted; `base` where that is oftener.

        Raises:
            ValueError: a rate that is not positive.
        """
        return self._threshold(per_hour, self.scale, self.over / self.hours)

    def sure_threshold(self, per_hour: float) -> float:
        """What peaks exceed so often at most, by the bound of `rate`."""
        scale = self.scale * self._scale_bound()
        return self._threshold(per_hour, scale, counted(self.over, self.hours).bound_per_hour)

    def _threshold(self, per_hour: float, scale: float, base_per_hour: float) -> float:
        if not per_hour > 0.0:
            raise ValueError(f"per_hour = {per_hour}: want a rate above 0")
        folds = log(max(base_per_hour / per_hour, 1.0))
        return self.base + scale * (float(np.expm1(self.shape * folds)) / self.shape if self.shape else folds)

    def _share(self, threshold: float, scale: float) -> float:
        """Of the peaks over `base`, how many exceed the threshold."""
        excess = max(threshold - self.base, 0.0) / scale
        return float((1.0 + self.shape * excess) ** (-1.0 / self.shape) if self.shape else np.exp(-excess))

    def _scale_bound(self) -> float:
        """By how much the scale may be larger: the sum of k exponential excesses has a gamma distribution."""
        from scipy.special import gammaincinv

        return self.over / float(gammaincinv(float(self.over), 1.0 - SURE))


def tail(peaks: Sequence[float] | FloatArray) -> Tail | None:
    """The tail of (B,) greatest scores of blocks; None where there are too few blocks for one."""
    ordered = np.sort(np.asarray(peaks, dtype=np.float64))[::-1]
    over = int(TAIL * len(ordered))
    if over < TAIL_MIN:
        return None
    base = float(ordered[over])
    excess = ordered[:over] - base
    mean = float(excess.mean())
    if not 0.0 < mean < inf:
        return None
    shape = _shape(excess)
    return Tail(base, len(ordered), over, mean * (1.0 - shape), shape)


def _shape(excess: FloatArray) -> float:
    """Of the generalised Pareto distribution, by moments; 0 unless the excesses scatter clearly more than that.

    The squared coefficient of variation is 1 for exponential excesses, with a standard deviation of 2 / sqrt(k), and
    1 / (1 - 2 shape) else.
    """
    squared = float(excess.var(ddof=1) / excess.mean() ** 2)
    if (squared - 1.0) * len(excess) ** 0.5 / 2.0 < HEAVY_SIGMAS:
        return 0.0
    return min((1.0 - 1.0 / squared) / 2.0, SHAPE_MAX)

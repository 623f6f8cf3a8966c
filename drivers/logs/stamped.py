"""Readings of several kinds, brought into one order of time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.logs.damage import DamageReport
from drivers.readings import Reading

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]

# Autopilots write what they stamped up to some tenths of a second ago.
DISORDER_S = 1.0
LEAP_S = 5.0
NEIGHBOURS = 2  # on either side
NEARLY_ALL = 0.98


@dataclass(frozen=True, slots=True)
class Stamped:
    """N readings of one kind.

    Attributes:
        time_s: (N,) of each.
        place: (N,) in the log; the earlier comes first where times are equal.
        readings: N.
    """

    time_s: FloatArray
    place: IndexArray
    readings: Sequence[Reading]


class TimeOrder:
    """Readings in any order in, in that of their times out: what may still be overtaken is held back.

    Args:
        damage: told what comes too late all the same.
    """

    def __init__(self, damage: DamageReport) -> None:
        self._damage = damage
        self._given_s = -np.inf
        self._held = Stamped(np.empty(0), np.empty(0, dtype=np.intp), [])

    def take(self, parts: Iterable[Stamped], until_s: float) -> list[Reading]:
        """Takes the next ones; gives out those up to `until_s`."""
        everything = [self._held, *parts]
        time_s = np.concatenate([one.time_s for one in everything])
        place = np.concatenate([one.place for one in everything])
        readings = [reading for one in everything for reading in one.readings]
        order = np.lexsort((place, time_s))
        time_s, place = time_s[order], place[order]
        readings = [readings[index] for index in order.tolist()]
        late = int(np.searchsorted(time_s, self._given_s))
        if late:
            self._damage.add("implausible time", f"{time_s[0]:.3f} s", late)
            time_s, place, readings = time_s[late:], place[late:], readings[late:]
        due = int(np.searchsorted(time_s, until_s, side="right"))
        self._held = Stamped(time_s[due:], place[due:], readings[due:])
        self._given_s = max(self._given_s, until_s)
        return readings[:due]

    def rest(self) -> list[Reading]:
        """What is still held back."""
        return self.take((), np.inf)


def reached_s(time_s: FloatArray) -> float:
    """How far (N,) stamps of a part of a log go, N > 0; a few that are wrong, but not by much, do not count."""
    return float(np.quantile(time_s, NEARLY_ALL))


def credible(time_s: FloatArray) -> Mask:
    """(N,) which stamps of a log fit to those written beside them: a damaged one would throw all into disorder.

    One fits that lies between its neighbours, or within `LEAP_S` of the median of the `NEIGHBOURS` on either side.
    """
    if len(time_s) <= NEIGHBOURS:
        return np.ones(len(time_s), dtype=np.bool_)
    beside = np.pad(time_s, NEIGHBOURS, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(beside, 2 * NEIGHBOURS + 1)
    before, after = windows[:, NEIGHBOURS - 1], windows[:, NEIGHBOURS + 1]
    between = (before <= time_s) & (time_s <= after)
    return between | (np.abs(time_s - np.median(windows, axis=1)) <= LEAP_S)


class Newest:
    """The newest of rarer values at given times.

    Args:
        width: how many values there are at a time.
    """

    def __init__(self, width: int) -> None:
        self._time_s = np.empty(0)
        self._values = np.empty((0, width))

    def take(self, time_s: FloatArray, values: FloatArray) -> None:
        """Takes (N,) times and (N, width) values, not older than those before the last call's newest."""
        order = np.argsort(time_s, kind="stable")
        self._time_s = np.concatenate([self._time_s[-1:], time_s[order]])
        self._values = np.concatenate([self._values[-1:], values[order]])

    def at(self, time_s: FloatArray, max_age_s: float = np.inf) -> FloatArray:
        """(N, width) at (N,) times; NaN where there is none yet, or none as young as that."""
        row = np.searchsorted(self._time_s, time_s, side="right") - 1
        values = np.full((len(time_s), self._values.shape[1]), np.nan)
        known = row >= 0
        known[known] = time_s[known] - self._time_s[row[known]] <= max_age_s
        values[known] = self._values[row[known]]
        return values

"""How a link did over a dive, second by second, collected while its readings are judged."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from drivers.reading_block import ReadingBlock
from drivers.readings import BusLoad, FrameLoss, Lateness, LinkState
from gateway.report.dive import LinkCourse
from gateway.report.thinning import FloatArray, Thinning
from gateway.timeline import STILL_S

# what the gateway says of a link: nothing that came over it
ABOUT = (LinkState, BusLoad, FrameLoss, Lateness)
VALUES = ("readings_per_s", "load", "lost")
# of one that flickers no more is drawn
DOWNS_MAX = 10_000
# what takes no longer to come up for the first time was never down
COMING_UP_S = 2.0

SecondArray = NDArray[np.int64]
Between = tuple[float, float]


class LinkCollecting:
    """Takes readings of one link, stretch by stretch.

    Args:
        name: of the link.
        silent_s: silence that counts as not being there.
    """

    def __init__(self, name: str, silent_s: float) -> None:
        self.name = name
        self._silent_s = silent_s
        self._counted: list[tuple[SecondArray, NDArray[np.intp]]] = []
        self._first_s, self._newest_s = inf, -inf
        self._silences: list[Between] = []
        self._downs: list[Between] = []
        self._down_since_s: float | None = None
        self._loads: dict[int, float] = {}
        self._lost: dict[int, float] = {}

    def take(self, readings: ReadingBlock) -> None:
        """The next stretch."""
        about = [(row, one) for row, one in readings.others if isinstance(one, ABOUT)]
        for _, one in about:
            self.told(one)
        rows, time_s = readings.times()
        if about:
            time_s = time_s[~np.isin(rows, [row for row, _ in about])]
        if len(time_s):
            self._hear(np.sort(time_s))

    def told(self, reading: object) -> None:
        """Something that was said of the link."""
        match reading:
            case LinkState(up=False):
                self._down_since_s = reading.time_s if self._down_since_s is None else self._down_since_s
            case LinkState() if self._down_since_s is not None:
                self._downs.append((self._down_since_s, reading.time_s))
                self._down_since_s = None
            case BusLoad():
                second = int(reading.time_s)
                self._loads[second] = max(self._loads.get(second, 0.0), reading.share)
            case FrameLoss():
                second = int(reading.time_s)
                self._lost[second] = self._lost.get(second, 0.0) + reading.frames

    def seconds(self) -> tuple[SecondArray, FloatArray]:
        """(N,) seconds in which something came, ascending, and how much."""
        if not self._counted:
            return np.empty(0, dtype=np.int64), np.empty(0)
        several, counts = (np.concatenate(part) for part in zip(*self._counted, strict=True))
        seconds, place = np.unique(several, return_inverse=True)
        return seconds.astype(np.int64), np.bincount(place, weights=counts).astype(np.float64)

    def course(self, begin_s: float, end_s: float, others: Iterable[SecondArray]) -> LinkCourse | None:
        """All of it, times since `begin_s`; None where nothing is known of it.

        Args:
            begin_s, end_s: of the dive.
            others: seconds in which other links were heard: where none was, it was the recording that paused.
        """
        seconds, counts = self.seconds()
        if not (len(seconds) or self._downs or self._down_since_s or self._loads or self._lost):
            return None
        going_on = [] if self._down_since_s is None else [(self._down_since_s, end_s)]
        downs = [one for one in self._downs if one[0] > self._first_s or one[1] - one[0] >= COMING_UP_S]
        paused = [*others]
        silences = [one for one in self._silences if not _is_pause(one, paused)]
        course = LinkCourse(
            name=self.name,
            **self._thinned(seconds, counts),
            down=_joined([*downs, *going_on, *silences]),
        )
        return replace(course, time_s=course.time_s - begin_s, down=course.down - begin_s)

    def _hear(self, time_s: FloatArray) -> None:
        seconds, counts = np.unique(np.floor(time_s).astype(np.int64), return_counts=True)
        self._counted.append((seconds, counts))
        self._first_s = min(self._first_s, float(time_s[0]))
        heard_s = np.append(self._newest_s, time_s) if np.isfinite(self._newest_s) else time_s
        for place in np.flatnonzero(np.diff(heard_s) > self._silent_s).tolist():
            if len(self._silences) < DOWNS_MAX:
                self._silences.append((float(heard_s[place]), float(heard_s[place + 1])))
        self._newest_s = max(self._newest_s, float(time_s[-1]))

    def _thinned(self, heard: SecondArray, counts: FloatArray) -> dict[str, FloatArray]:
        """By second; beside each second in which something came, those in which nothing did."""
        told = np.array([*self._loads, *self._lost], dtype=np.int64)
        beside = np.concatenate([heard - 1, heard + 1])
        within = beside[(beside >= heard[0]) & (beside <= heard[-1])] if len(heard) else beside
        seconds = np.unique(np.concatenate([heard, told, within]))
        several = np.zeros(len(seconds))
        several[np.searchsorted(seconds, heard)] = counts
        thinning = Thinning(VALUES, VALUES, gap_s=inf)
        numbers = seconds.tolist()
        load = np.array([self._loads.get(second, np.nan) for second in numbers])
        lost = np.array([self._lost.get(second, 0.0) for second in numbers])
        thinning.extend(seconds + 0.5, several, load, lost)
        time_s, values = thinning.columns()
        return {"time_s": time_s, **values}


def _is_pause(silence: Between, others: Iterable[SecondArray]) -> bool:
    """Whether nobody was there: nothing came over any other link, either, for as long as nothing is told of it."""
    from_s, to_s = silence
    if to_s - from_s <= STILL_S:
        return False
    return not any(np.searchsorted(one, to_s - 1.0) > np.searchsorted(one, from_s + 1.0) for one in others)


def _joined(several: Iterable[Between]) -> FloatArray:
    """(M, 2) with those that overlap as one."""
    joined: list[Between] = []
    for from_s, to_s in sorted(several):
        if joined and from_s <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(joined[-1][1], to_s)
        else:
            joined.append((from_s, to_s))
    return np.array(joined).reshape(-1, 2)

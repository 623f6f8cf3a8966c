"""How often healthy dives exceed which level, and what may be said of that after so few hours."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log, sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

LEVEL_PER_HOUR = 10.0  # the tail begins where it is exceeded so often, ...
PEAKS_MIN = 5  # ... or, in short recordings, where so many peaks exceed it
CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Tail:
    """An exponential law: rate of exceedance = exp((once_an_hour - level) / per_e_fold) an hour.

    Attributes:
        once_an_hour: level that is exceeded so often.
        per_e_fold: by how much more one is that is exceeded e times more seldom.
        peaks: number of them that it is fitted to.
    """

    once_an_hour: float
    per_e_fold: float
    peaks: int

    def per_hour(self, level: float) -> float:
        """How often a level is exceeded."""
        return exp(min((self.once_an_hour - level) / self.per_e_fold, 50.0))

    def level(self, per_hour: float) -> float:
        """The level that is exceeded so often."""
        return self.once_an_hour - self.per_e_fold * log(per_hour)

    def level_error(self, per_hour: float) -> float:
        """Its standard deviation: of the count of the peaks, and of their mean excess, carried on to that rate."""
        beyond = self.level(per_hour) - self.once_an_hour
        return sqrt((self.per_e_fold**2 + beyond**2) / max(self.peaks, 1))


def peaks_of(time_s: FloatArray, values: FloatArray, apart_s: float) -> FloatArray:
    """(P,) the greatest value, the greatest so far away from it, and so on; NaN is none."""
    left, found = np.isfinite(values), []
    while left.any():
        index = int(np.argmax(np.where(left, values, -np.inf)))
        found.append(values[index])
        left &= np.abs(time_s - time_s[index]) >= apart_s
    return np.array(found)


def tail_of(peaks: FloatArray, hours: float, usual_e_fold: float, usual_peaks: int = PEAKS_MIN) -> Tail:
    """The law that fits best: excesses of independent peaks over a level have one mean, whatever the level.

    Args:
        peaks: (P,) of all healthy dives, from each other as far as they are independent.
        hours: of these dives.
        usual_e_fold: what is expected of `per_e_fold` before anything is measured, ...
        usual_peaks: ... and for how many peaks that counts.

    Raises:
        ValueError: too few peaks.
    """
    highest = np.sort(peaks[np.isfinite(peaks)])[::-1]
    count = min(max(round(LEVEL_PER_HOUR * hours), PEAKS_MIN), len(highest) - 1)
    if count < PEAKS_MIN or not hours > 0.0:
        raise ValueError(f"{len(highest)} peaks in {hours:.2f} h: want more than {PEAKS_MIN}: a longer recording")
    start = float(highest[count])
    excess = float(np.sum(highest[:count] - start))
    per_e_fold = (excess + usual_peaks * usual_e_fold) / (count + usual_peaks)
    return Tail(start + per_e_fold * log(count / hours), per_e_fold, count)


def most_per_hour(events: int, hours: float) -> float:
    """The rate that so many events in so many hours do not exclude (one-sided, 95 %; none: about 3 / hours).

    Raises:
        ValueError: no time at all.
    """
    from scipy.special import gammaincinv  # late: it takes longer than all the rest

    if not hours > 0.0:
        raise ValueError(f"hours = {hours}: want above 0")
    return float(gammaincinv(events + 1, CONFIDENCE)) / hours


def spoken_rate(events: int, hours: float) -> str:
    """What was counted, and what it says: `0 in 2.5 h, so below 1.2 an hour (95 %)`."""
    most = most_per_hour(events, hours)
    return f"{events} in {hours:.1f} h, so below {most:.{1 if most < 10.0 else 0}f} an hour (95 %)"

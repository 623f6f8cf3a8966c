"""White noise of an inertial unit on a vehicle under way, by the Allan deviation.

At rest, an Allan deviation times the root of its averaging time is the density of white noise, whatever that time.
Under way, waves and steering add to it at longer times, and what a filter in the unit rounds off is missing at the
shortest. So of all averaging times the one with the least counts, in the calmest of many short windows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

WINDOW_S = 20.0
CALMEST = 0.2  # quantile of the windows
LONGEST_S = 2.0
SHORTEST, SHORTEST_S = 2, 0.05  # samples and time that are averaged, at least: what is less may be a filter's
# White noise has one density: so many times the least, at most, over times of which the last is twice the first
LEVEL = 1.6
UNEVEN = 0.5  # an interval farther off the usual one than this share of it parts windows


@dataclass(frozen=True, slots=True, eq=False)
class AllanCurve:
    """Allan deviations of three axes, as densities.

    Attributes:
        averaging_s: (T,)
        density: (T, 3) deviation times the root of the averaging time, in the unit of the samples per root Hz.
        windows: that they are of.
    """

    averaging_s: FloatArray
    density: FloatArray
    windows: int

    @property
    def white(self) -> FloatArray:
        """(3,) density of the white noise of each axis."""
        return np.asarray(self.density.min(axis=0))

    @property
    def level(self) -> bool:
        """Whether the least of the noisiest axis is noise; else the vehicle never held still, and it is a bound."""
        density = self.density[:, int(np.argmax(self.white))]
        near_s = self.averaging_s[density <= LEVEL * density.min()]
        return bool(near_s.max() >= 2.0 * near_s.min())


def allan_curve(time_s: FloatArray, values: FloatArray) -> AllanCurve | None:
    """Of samples (N, 3) in the order of their times (N,); None: no window of even samples is long enough."""
    if len(time_s) < 2:
        return None
    interval_s = float(np.median(np.diff(time_s)))
    count = max(round(WINDOW_S / interval_s), 1)
    uneven = np.abs(np.diff(time_s) - interval_s) > UNEVEN * interval_s
    uneven_before = np.append(0, np.cumsum(uneven))
    begins = [k for k in range(0, len(time_s) - count + 1, count) if uneven_before[k + count - 1] == uneven_before[k]]
    shortest = max(SHORTEST, round(SHORTEST_S / interval_s))
    longest = min(round(LONGEST_S / interval_s), count // 3)
    if not begins or longest < shortest:
        return None
    sizes = np.unique(np.geomspace(shortest, longest, 12).round().astype(int))
    densities = np.array([[_density(values[k : k + count], n, interval_s) for n in sizes] for k in begins])
    return AllanCurve(sizes * interval_s, np.quantile(densities, CALMEST, axis=0), len(begins))


def _density(values: FloatArray, size: int, interval_s: float) -> FloatArray:
    """(3,) overlapping Allan deviation over so many samples, times the root of their time."""
    total = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values - values.mean(axis=0), axis=0)))
    means = (total[size:] - total[:-size]) / size
    variance = 0.5 * ((means[size:] - means[:-size]) ** 2).mean(axis=0)
    return np.asarray(np.sqrt(variance * size * interval_s))

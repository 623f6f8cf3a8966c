"""Two logs of one autopilot: what its own clock showed when its messages came to either.

Reception minus stamp is the offset of two clocks and what a message took to come, which is never less than nothing.
The line under all points of it, with the least area between, is offset and drift with the least delay; it is the edge
of their lower convex hull over their mean (Moon, Skelly and Towsley 1999, section IV, solve the same as a linear
program). What two lines differ by is the offset of the logs.

That both had the same autopilot, and not the one of another day, is told by the attitudes that it stamped: at equal
stamps they must be equal, to far less than they change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.replay.log_trace import BootSession

FloatArray: TypeAlias = NDArray[np.float64]

BIN_S = 1.0
DRIFT_SPAN_S = 300.0  # below, the jitter of delays is more than the drift of clocks
DRIFT_MAX = 300e-6
ATTITUDES_MIN = 20
ATTITUDE_GAP_S = 2.0
UNEXPLAINED_MAX = 0.1  # of the attitudes' variance
APART_MAX_RAD = 0.02  # of their means


@dataclass(frozen=True, slots=True)
class ClockLine:
    """How a log's clock runs beside the autopilot's.

    Attributes:
        offset_s: to be added to the autopilot's time, at `at_s`.
        at_s: on the autopilot's clock.
        drift: seconds a second.
    """

    offset_s: float
    at_s: float
    drift: float

    def at(self, boot_s: float) -> float:
        """The offset at a time on the autopilot's clock."""
        return self.offset_s + self.drift * (boot_s - self.at_s)


def clock_line(session: BootSession) -> ClockLine:
    """The line under reception minus stamp."""
    delay_s = session.time_s - session.boot_s
    order = np.lexsort((delay_s, np.floor(session.boot_s / BIN_S)))
    _, first = np.unique(np.floor(session.boot_s / BIN_S)[order], return_index=True)
    at_s, least_s = session.boot_s[order][first], delay_s[order][first]
    middle_s = float(at_s.mean())
    if at_s[-1] - at_s[0] >= DRIFT_SPAN_S:
        left, right = _edge_over(at_s, least_s, middle_s)
        drift = float((least_s[right] - least_s[left]) / (at_s[right] - at_s[left])) if right > left else 0.0
        if abs(drift) <= DRIFT_MAX:
            return ClockLine(float(least_s[left]) + drift * (middle_s - float(at_s[left])), middle_s, drift)
    return ClockLine(float(least_s.min()), middle_s, 0.0)


def unexplained(one: BootSession, other: BootSession) -> tuple[float, float] | None:
    """How far two sessions' attitudes differ.

    Returns:
        (share, overlap_s): variance of their difference over their own, and how long both have attitudes; None where
        they have too few together, or differ by a constant.
    """
    first, second = _attitudes(one), _attitudes(other)
    if min(len(first), len(second)) < 2:
        return None
    if len(first) < len(second):
        first, second = second, first
    row = np.searchsorted(first[:, 0], second[:, 0])
    near = (row > 0) & (row < len(first))
    near[near] = first[row[near], 0] - first[row[near] - 1, 0] <= ATTITUDE_GAP_S
    if near.sum() < ATTITUDES_MIN:
        return None
    mine = second[near]
    theirs = np.column_stack([np.interp(mine[:, 0], first[:, 0], first[:, place]) for place in (1, 2, 3)])
    apart = mine[:, 1:] - theirs
    apart[:, 2] -= 2.0 * np.pi * np.round(np.median(apart[:, 2]) / (2.0 * np.pi))
    if np.abs(apart.mean(axis=0)).max() > APART_MAX_RAD:
        return None
    own = float(mine[:, 1:].var(axis=0).sum())
    share = float(apart.var(axis=0).sum()) / own if own > 0.0 else 1.0
    return share, float(np.ptp(mine[:, 0]))


def _attitudes(session: BootSession) -> FloatArray:
    """(M, 4) stamps that rise, roll, pitch, and yaw without leaps."""
    told = ~np.isnan(session.attitude_rad[:, 0])
    rows = np.column_stack([session.boot_s, session.attitude_rad])[told]
    if len(rows):
        rows = rows[np.concatenate([[True], np.diff(rows[:, 0]) > 0.0])]
        rows[:, 3] = np.unwrap(rows[:, 3])
    return rows


def _edge_over(x: FloatArray, y: FloatArray, middle: float) -> tuple[int, int]:
    """Ends of the edge of the lower convex hull of points, in the order of x, that lies over `middle`."""
    hull: list[int] = []
    for new in range(len(x)):
        while len(hull) > 1 and _turns_down(x, y, hull[-2], hull[-1], new):
            hull.pop()
        hull.append(new)
    right = next(place for place, point in enumerate(hull) if x[point] >= middle)
    return hull[max(right - 1, 0)], hull[right]


def _turns_down(x: FloatArray, y: FloatArray, first: int, second: int, third: int) -> bool:
    """Whether the second point does not lie below the line from the first to the third."""
    return bool((x[second] - x[first]) * (y[third] - y[first]) <= (y[second] - y[first]) * (x[third] - x[first]))

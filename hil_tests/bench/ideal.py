"""How soon anybody could have found a loss: what the positions hold, against which a detector is to be measured.

The ideal observer knows the true heading and the noise, and at which instant something changes: the speed, or the
flow, from one constant to another. It needs evidence of five standard deviations that it was the speed; on a straight
leg there is none. No detector that has to find the instant, too, with a compass that is off, in water that changes,
is as quick. Where not even the ideal observer finds the loss, the way does not excite enough.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil_tests.missions import Passage

FloatArray = NDArray[np.float64]

BEFORE_S = 120.0
DEVIATIONS = 5.0
INSTANTS = 60  # after the onset at which it is asked


def ideal_delay_s(way: Passage) -> float | None:
    """Seconds from the onset until the positions, with white noise, tell the loss from none; None for never.

    The positions are p0 + F t + G t+ + V a(t) - V loss b(t): t+ is the time after the onset and G a change of the
    flow then; a and b are integrals of the unit vector along the heading, from the beginning and from the onset on.
    What of b is not a sum of the others, over the noise, is how many standard deviations the loss is from none.
    """
    used = way.time_s >= way.onset_s - BEFORE_S
    after = np.flatnonzero(way.time_s[used] > way.onset_s)
    if len(after) == 0:
        return None
    time_s = way.time_s[used] - way.onset_s
    regressors, change = regressors_of(time_s, way.true_heading_rad[used])
    lost_mps = way.loss * float(np.mean(way.true_speed_mps[used][time_s <= 0.0]))
    for index in after[np.unique(np.linspace(0, len(after) - 1, INSTANTS).astype(int))]:
        until = 2 * (index + 1)
        known, asked = regressors[:until], change[:until]
        left = asked - known @ np.linalg.lstsq(known, asked, rcond=None)[0]
        if lost_mps * np.linalg.norm(left) > DEVIATIONS * way.noise_m:
            return float(time_s[index])
    return None


def regressors_of(time_s: FloatArray, heading_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2N, 7) of start, flow, its change and speed, and (2N,) of the loss; north and east of an instant in turns."""
    ahead = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    steps_m = 0.5 * (ahead[1:] + ahead[:-1]) * np.diff(time_s)[:, np.newaxis]
    way_m = np.concatenate([np.zeros((1, 2)), np.cumsum(steps_m, axis=0)])
    at_onset_m = np.array([np.interp(0.0, time_s, axis_m) for axis_m in way_m.T])
    since_m = np.where(time_s[:, np.newaxis] > 0.0, way_m - at_onset_m, 0.0)
    axes = np.tile(np.eye(2), (len(time_s), 1))
    flow, change = (axes * np.repeat(times, 2)[:, np.newaxis] for times in (time_s, np.maximum(time_s, 0.0)))
    return np.column_stack([axes, flow, change, way_m.ravel()]), since_m.ravel()

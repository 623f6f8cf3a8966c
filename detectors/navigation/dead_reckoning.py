"""Two strapdown systems on the samples of one IMU: one as far behind as the filter is, one at the newest sample.

Both are corrected alike. What a tilt or a bias has done since then to the one that is ahead is not among the
corrections: so now and again it follows anew from the one behind.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from copy import copy

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.error_model import strapdown_error
from detectors.navigation.features import MotionFeatures
from detectors.navigation.motion import BodyMotion
from detectors.navigation.sample import ImuSample, NavigationState, Vector
from detectors.navigation.strapdown import Strapdown

FloatArray = NDArray[np.float64]

# How often the present follows anew from the corrected past: left out, what the corrections lack would add up.
CATCH_UP_S = 0.5
# A gap of the IMU: nobody knows how the vehicle moved.
GAP_S = 0.5
# After it, how long it was does not matter any more, and what was measured meanwhile says nothing.
GAP_MAX_S = 100.0


class DeadReckoning:
    """Where the vehicle is now, where it was some time ago, and how it moved.

    Args:
        initial: where it begins.

    Attributes:
        behind: the system that measurements are compared with. behind_s: its instant.
        motion: of the body at that instant.
        present_motion: of the body at the newest sample.
    """

    def __init__(self, initial: NavigationState) -> None:
        self.behind, self._present = Strapdown(initial), Strapdown(initial)
        self.behind_s = self._present_s = self._caught_up_s = initial.time_s
        self.motion, self.present_motion = BodyMotion(), BodyMotion()
        self._features = MotionFeatures()
        self._imu: deque[ImuSample] = deque()

    def state(self, time_s: float) -> NavigationState:
        """Where the vehicle is now."""
        return self._present.state(time_s)

    def advance(self, sample: ImuSample) -> float:
        """Takes the newest sample into the present; `follow` does the rest. The seconds since the one before."""
        interval_s = sample.time_s - self._present_s
        self._present_s = _advance(self._present, self._present_s, sample)
        if 0.0 < interval_s <= GAP_S:
            self.present_motion.follow(self._present, sample.angular_rate_radps, interval_s)
        self._imu.append(sample)
        return interval_s

    def follow(self, until_s: float) -> Iterator[float]:
        """Brings the system behind to an instant, sample by sample; the interval of each that it has come by."""
        while self._imu and self._imu[0].time_s <= until_s:
            sample = self._imu.popleft()
            interval_s = sample.time_s - self.behind_s
            if interval_s <= 0.0:
                continue
            self.behind_s = _advance(self.behind, self.behind_s, sample)
            if interval_s > GAP_S:
                self.motion = BodyMotion()
            else:
                self._move(sample, interval_s)
            yield interval_s

    def catch_up(self) -> None:
        """The present follows anew from the past, where it is time for it."""
        if self._present_s - self._caught_up_s < CATCH_UP_S:
            return
        self._caught_up_s = self._present_s
        self._present, self._present_s = copy(self.behind), self.behind_s
        for sample in self._imu:
            self._present_s = _advance(self._present, self._present_s, sample)

    def take_features(self) -> FloatArray | None:
        """(12,) of the time since the last call, see `MotionFeatures`; None: no sample came."""
        return self._features.take(self.behind.body_velocity(), self.behind.attitude)

    def correct(self, error: FloatArray) -> None:
        """Takes in an error (N,) of the states."""
        correction = strapdown_error(error)
        self.behind.correct(correction)
        self._present.correct(correction)

    def locate(self, latitude_rad: float, longitude_rad: float) -> None:
        """Goes on from another place."""
        for strapdown in (self.behind, self._present):
            strapdown.locate(latitude_rad, longitude_rad)

    def _move(self, sample: ImuSample, interval_s: float) -> None:
        self.motion.follow(self.behind, sample.angular_rate_radps, interval_s)
        self._features.add(
            _less(sample.specific_force_mps2, self.behind.accelerometer_bias_mps2),
            _less(sample.angular_rate_radps, self.behind.gyroscope_bias_radps),
        )


def _advance(strapdown: Strapdown, last_s: float, sample: ImuSample) -> float:
    """To a sample; over a gap, the vehicle goes on as it went. The instant that it has come to."""
    interval_s = sample.time_s - last_s
    if interval_s <= 0.0:
        return last_s
    if interval_s > GAP_S:
        strapdown.coast(min(interval_s, GAP_MAX_S))
    else:
        strapdown.advance(sample.specific_force_mps2, sample.angular_rate_radps, interval_s)
    return sample.time_s


def _less(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]

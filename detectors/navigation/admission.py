"""Which samples are taken, and which sensors are silent."""

from __future__ import annotations

from collections import Counter
from math import inf, isfinite

from detectors.navigation.sample import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationSample,
)

LARGEST = 1e4  # of any number that a sensor says, in its unit
LARGEST_TIME_S = 1e10  # three centuries since 1970
# A stamp so far ahead of the IMU's is another clock's.
AHEAD_S = 10.0
# A sensor that was silent for so many of its intervals, and so many seconds, is not judged.
SILENT_INTERVALS, SILENT_S = 5.0, 3.0
_SMOOTHING = 0.1


def numbers_of(sample: NavigationSample) -> tuple[float, ...]:
    """What a sample says, without its time."""
    match sample:
        case ImuSample():
            return *sample.specific_force_mps2, *sample.angular_rate_radps
        case DvlSample():
            return sample.velocity_mps
        case DepthSample():
            return (sample.depth_m,)
        case FixSample():
            return sample.latitude_rad, sample.longitude_rad
        case AttitudeSample():
            return sample.attitude_rad


class Admission:
    """Samples of each kind have to be finite and in the order of their times.

    Attributes:
        refused: samples that were not, by cause.
    """

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self._newest_s: dict[type[NavigationSample], float] = {}
        self._interval_s: dict[type[NavigationSample], float] = {}

    def admits(self, sample: NavigationSample) -> bool:
        """Whether a sample is taken; counts it where it is not."""
        cause = self._fault(sample)
        if cause:
            self.refused[cause] += 1
            return False
        kind, time_s = type(sample), sample.time_s
        if kind in self._newest_s:
            between_s = time_s - self._newest_s[kind]
            usual_s = self._interval_s.get(kind, between_s)
            self._interval_s[kind] = usual_s + _SMOOTHING * (min(between_s, 2.0 * usual_s) - usual_s)
        self._newest_s[kind] = time_s
        return True

    def heard(self, kind: type[NavigationSample]) -> bool:
        """Whether a sample of this kind was ever taken."""
        return kind in self._newest_s

    def silent(self, kind: type[NavigationSample], time_s: float) -> bool:
        """Whether too long nothing was heard of a kind of sample; not for one that was never heard."""
        if kind not in self._newest_s:
            return False
        wait_s = max(SILENT_S, SILENT_INTERVALS * self._interval_s.get(kind, 0.0))
        return time_s - self._newest_s[kind] > wait_s

    def _fault(self, sample: NavigationSample) -> str:
        numbers = numbers_of(sample)
        if not (isfinite(sample.time_s) and all(map(isfinite, numbers))):
            return "not finite"
        if abs(sample.time_s) > LARGEST_TIME_S or any(abs(number) > LARGEST for number in numbers):
            return "out of range"
        if not isinstance(sample, ImuSample) and sample.time_s > self._newest_s.get(ImuSample, inf) + AHEAD_S:
            return "ahead of the IMU"
        return "late or repeated" if sample.time_s <= self._newest_s.get(type(sample), -inf) else ""

"""What the navigation filter makes of a healthy dive: innovations, and how sure it grows of the sensors' mounting."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import (
    DepthSample,
    DvlSample,
    ImuSample,
    NavigationConfig,
    NavigationSample,
    NavigationState,
    NavigationVerdict,
)
from detectors.navigation.innovation import Innovation
from detectors.navigation.installation import ALL_STATES, INSTALLED, Installation
from detectors.navigation.integration import IntegratedFilter
from detectors.verdict import Level
from gateway.config_sections import Navigation
from gateway.sensor_watch import SensorWatch

FloatArray: TypeAlias = NDArray[np.float64]
INSTALLATION = len(range(ALL_STATES)[INSTALLED])


@dataclass(frozen=True, slots=True, eq=False)
class Innovations:
    """Of one sensor with M components, N in the order of time.

    Attributes:
        time_s: (N,)
        values: (N, M) measured minus expected.
        variance: (N, M) that the filter expects of them.
    """

    time_s: FloatArray
    values: FloatArray
    variance: FloatArray

    @property
    def surprise(self) -> float:
        """Mean negative log likelihood of a component: the less, the better the filter knows the vehicle."""
        return float(np.mean(0.5 * (self.values**2 / self.variance + np.log(2.0 * np.pi * self.variance))))


@dataclass(frozen=True, slots=True, eq=False)
class NavigationCourse:
    """One dive.

    Attributes:
        imu: (N, 7) time; specific force (3) in m/s2; angular rate (3) in rad/s.
        velocity: (N, 4) time; the DVL's velocity (3) in m/s.
        dvl, depth: innovations.
        installed, deviation: (N, 10) what was known of the mounting at each of the DVL's innovations, in the order of
            `detectors.navigation.installation`, and its standard deviation.
        acquainted: (N,) whether the vehicle had turned enough by then to know the DVL's delay at all.
        rates_hz: of IMU, DVL and depth sensor; 0: not heard.
    """

    imu: FloatArray
    velocity: FloatArray
    dvl: Innovations
    depth: Innovations
    installed: FloatArray
    deviation: FloatArray
    acquainted: NDArray[np.bool_]
    rates_hz: tuple[float, float, float]


def navigation_course(
    samples: Iterable[NavigationSample],
    navigation: Navigation,
    settings: NavigationConfig,
) -> NavigationCourse:
    """Runs the filter over a dive, with alignment before it, as the gateway does.

    Args:
        samples: of the dive, in the order of their times.
        navigation, settings: of the watch; what it learns of the mounting, it learns whatever the settings say.
    """
    seen = _Seen()
    learning = replace(settings, estimate_installation=True)
    watch = SensorWatch(navigation, learning, lambda *begin: _Filtered(seen, *begin))
    for sample in samples:
        seen.note(sample)
        watch.judge(sample)
    return seen.course()


class _Seen:
    """Gathers."""

    def __init__(self) -> None:
        self._imu: list[tuple[float, ...]] = []
        self._velocity: list[tuple[float, ...]] = []
        self._depth_s: list[float] = []
        self._innovations: dict[type, list[tuple[float, ...]]] = {DvlSample: [], DepthSample: []}
        self._known: list[tuple[float, ...]] = []

    def note(self, sample: NavigationSample) -> None:
        match sample:
            case ImuSample():
                self._imu.append((sample.time_s, *sample.specific_force_mps2, *sample.angular_rate_radps))
            case DvlSample():
                self._velocity.append((sample.time_s, *sample.velocity_mps))
            case DepthSample():
                self._depth_s.append(sample.time_s)

    def innovation(self, innovation: Innovation, filter_: IntegratedFilter) -> None:
        rows = self._innovations.get(type(innovation.measurement))
        if rows is None:
            return
        variance = np.diag(innovation.covariance)
        rows.append((innovation.time_s, *innovation.values.tolist(), *variance.tolist()))
        if isinstance(innovation.measurement, DvlSample):
            known = filter_.installation
            deviation = np.sqrt(np.diag(known.covariance))
            self._known.append((float(filter_.acquainted), *known.values.tolist(), *deviation.tolist()))

    def course(self) -> NavigationCourse:
        known = np.array(self._known).reshape(-1, 1 + 2 * INSTALLATION)
        imu = np.array(self._imu).reshape(-1, 7)
        velocity = np.array(self._velocity).reshape(-1, 4)
        return NavigationCourse(
            imu=imu,
            velocity=velocity,
            dvl=self._of(DvlSample, 3),
            depth=self._of(DepthSample, 1),
            installed=known[:, 1 : 1 + INSTALLATION],
            deviation=known[:, 1 + INSTALLATION :],
            acquainted=known[:, 0] > 0.0,
            rates_hz=(_rate_hz(imu[:, 0]), _rate_hz(velocity[:, 0]), _rate_hz(np.array(self._depth_s))),
        )

    def _of(self, kind: type, components: int) -> Innovations:
        rows = np.array(self._innovations[kind]).reshape(-1, 1 + 2 * components)
        return Innovations(rows[:, 0], rows[:, 1 : 1 + components], rows[:, 1 + components :])


def _rate_hz(time_s: FloatArray) -> float:
    """Median of the rate."""
    return float(1.0 / np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0


class _Filtered:
    """A filter in the place of a detector: judges nothing, and says what it sees.

    Attributes:
        refused: samples that were not used, by cause.
    """

    def __init__(
        self, seen: _Seen, settings: NavigationConfig, initial: NavigationState, installation: Installation | None
    ) -> None:
        self._seen = seen
        self._filter = IntegratedFilter(settings, initial, installation)
        self._newest_s = initial.time_s

    @property
    def refused(self) -> Counter[str]:
        return self._filter.refused

    @property
    def installation(self) -> Installation:
        return self._filter.installation

    def accept(self) -> None:
        """Nothing is judged."""

    def update(self, sample: NavigationSample) -> NavigationVerdict:
        if not isinstance(sample, ImuSample):
            self._filter.measure(sample)
        elif sample.time_s > self._newest_s:
            self._newest_s = sample.time_s
            for innovation in self._filter.advance(sample):
                self._seen.innovation(innovation, self._filter)
        state = self._filter.state(self._newest_s)
        return NavigationVerdict(time_s=self._newest_s, level=Level.UNKNOWN, score=0.0, state=state)

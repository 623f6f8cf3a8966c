"""Samples of navigation sensors in, a judgement of each out: by alignment at first and after gaps, then the detector.

The detector must be told where it begins. So the first seconds, and those after a gap in the inertial samples, go
through alignment; until that is done, nothing is known of any sensor. After a gap it begins where it ended before.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from math import hypot, nan, radians
from typing import Protocol

from detectors.navigation import (
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationConfig,
    NavigationSample,
    NavigationState,
    NavigationVerdict,
    SensorVerdict,
)
from detectors.navigation.alignment import Alignment
from detectors.navigation.installation import Installation
from detectors.verdict import Level
from gateway.channel import NavigationJudgement
from gateway.config_sections import Navigation
from gateway.local_frame import LocalFrame

# Over shorter gaps of the inertial unit the detector goes on, and doubts what it knows the more the longer they are.
# In a longer one a vehicle may have turned so far that the error of its attitude would be taken for a sensor's.
GAP_S = 2.5
# Slower than this, an inertial unit misses the motion of a vehicle between its samples.
RATE_MIN_HZ = 8.0
# of the mean interval between inertial samples: some twenty of them
FORGETTING = 0.05
# A velocity to begin with is not older.
FRESH_S = 1.5
# Where the first fix is this far away, it was the configuration's place that was rough.
ROUGH_M = 10_000.0

Place = tuple[float, float]


class Detector(Protocol):
    """What the pipeline needs of a navigation detector."""

    @property
    def refused(self) -> Counter[str]:
        """Samples that were not used, by cause."""
        ...

    @property
    def installation(self) -> Installation:
        """What was learnt of lever arm, mounting, scale and delays."""
        ...

    def update(self, sample: NavigationSample) -> NavigationVerdict:
        """Judges one sample."""
        ...

    def accept(self) -> None:
        """What the sensors say now is right."""
        ...


NavigationFactory = Callable[[NavigationConfig, NavigationState, Installation | None], Detector]


class SensorWatch:
    """See the module's text.

    Args:
        navigation: which sensors there are, and where, roughly.
        settings: the detector's.
        make: makes the detector, once there is a state to begin with.
    """

    def __init__(self, navigation: Navigation, settings: NavigationConfig, make: NavigationFactory) -> None:
        self._settings, self._make = settings, make
        self._wants_dvl = navigation.dvl != "none"
        self._place: Place = (radians(navigation.latitude_deg), radians(navigation.longitude_deg))
        self._heading_rad = 0.0
        self._fixed = False
        self._detector: Detector | None = None
        self._installation: Installation | None = None
        self._refused: Counter[str] = Counter()
        self._dvl: DvlSample | None = None
        self._depth: DepthSample | None = None
        self._inertial_s: float | None = None
        self._interval_s: float | None = None
        self._newest: NavigationVerdict | None = None
        self._alignment = self._another_alignment()

    @property
    def rate_hz(self) -> float:
        """Of the inertial samples, of late; 0 before the second."""
        return 0.0 if self._interval_s is None else 1.0 / self._interval_s

    @property
    def refused(self) -> Counter[str]:
        """What the detectors did not use, by cause."""
        return self._refused if self._detector is None else self._refused + self._detector.refused

    @property
    def installation(self) -> Installation | None:
        """How the sensors are installed, as far as that was learnt."""
        return self._installation if self._detector is None else self._detector.installation

    def recall(self, installation: Installation | None) -> None:
        """What an earlier run had learnt of it; before the first sample."""
        self._installation = installation

    def accept(self) -> None:
        """The sensors are well as they are."""
        if self._detector is not None:
            self._detector.accept()

    def judge(self, sample: NavigationSample) -> NavigationJudgement:
        """Takes the next sample, in the order of time."""
        self._note(sample)
        verdict = self._begun(sample) if self._detector is None else self._detector.update(sample)
        before, self._newest = self._newest, verdict
        changed = before is None or _levels(before) != _levels(verdict)
        return NavigationJudgement(sample, verdict, self._dvl, self._depth, changed)

    def _note(self, sample: NavigationSample) -> None:
        match sample:
            case ImuSample():
                self._pace(sample.time_s)
            case DvlSample():
                self._dvl = sample
            case DepthSample():
                self._depth = sample
            case FixSample() if not self._fixed:
                self._fixed = True
                self._move(sample)

    def _pace(self, time_s: float) -> None:
        before_s, self._inertial_s = self._inertial_s, time_s
        if before_s is None:
            return
        interval_s = time_s - before_s
        if interval_s > GAP_S:
            self._refused["gap of the IMU"] += 1
            self._align_anew(self._here())
        elif self._interval_s is None:
            self._interval_s = interval_s
        else:
            self._interval_s += FORGETTING * (interval_s - self._interval_s)

    def _move(self, fix: FixSample) -> None:
        """The first fix of all: it says where we are, if that was hardly known."""
        north_m, east_m = LocalFrame(*self._here()).metres(fix.latitude_rad, fix.longitude_rad)
        if not hypot(north_m, east_m) <= ROUGH_M:  # also for NaN
            self._align_anew((fix.latitude_rad, fix.longitude_rad))

    def _here(self) -> Place:
        if self._detector is None or self._newest is None:
            return self._place
        return self._newest.state.latitude_rad, self._newest.state.longitude_rad

    def _align_anew(self, place: Place) -> None:
        if self._detector is not None and self._newest is not None:
            self._heading_rad = self._newest.state.attitude_rad[2]
            self._refused, self._installation = self.refused, self.installation
            self._detector = None
        self._place = place
        self._alignment = self._another_alignment()

    def _another_alignment(self) -> Alignment:
        latitude_rad, longitude_rad = self._place
        return Alignment(
            self._settings,
            latitude_rad=latitude_rad,
            longitude_rad=longitude_rad,
            heading_rad=self._heading_rad,
        )

    def _begun(self, sample: NavigationSample) -> NavigationVerdict:
        """Nothing is known yet; the detector begins as soon as there is a state to begin with."""
        state = self._alignment.update(sample)
        obstacle = self._obstacle(sample.time_s)
        if state is not None and not obstacle:
            self._detector = self._make(self._settings, state, self._installation)
            return self._unknown(state, "aligned")
        return self._unknown(_nowhere(sample.time_s), obstacle or self._alignment.reason)

    def _obstacle(self, time_s: float) -> str:
        """What is in the way of a detector, whatever alignment says; empty where nothing is."""
        if self._interval_s is None:
            return "waiting for the IMU"
        if self.rate_hz < RATE_MIN_HZ:
            return f"IMU at {self.rate_hz:.1f} Hz is too slow"
        if self._wants_dvl and (self._dvl is None or time_s - self._dvl.time_s > FRESH_S):
            return "waiting for the DVL"
        return ""

    def _unknown(self, state: NavigationState, reason: str) -> NavigationVerdict:
        known = () if self._newest is None else self._newest.sensors
        sensors = tuple(SensorVerdict(one.sensor, Level.UNKNOWN) for one in known)
        return NavigationVerdict(
            time_s=state.time_s, level=Level.UNKNOWN, score=0.0, state=state, sensors=sensors, reason=reason
        )


def _levels(verdict: NavigationVerdict) -> tuple[object, ...]:
    return verdict.level, *((one.sensor, one.level, one.isolated) for one in verdict.sensors)


def _nowhere(time_s: float) -> NavigationState:
    return NavigationState(time_s, nan, nan, nan, (nan, nan, nan), (nan, nan, nan))

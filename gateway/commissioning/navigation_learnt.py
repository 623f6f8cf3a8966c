"""What healthy dives have taught of the navigation sensors, and what of it goes into the detector's settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from detectors.navigation import NavigationConfig
from gateway.commissioning.mounting import Known, Mounting, mounting_of
from gateway.commissioning.navigation_course import NavigationCourse
from gateway.commissioning.navigation_watch import Watched, blocks_over, hours, tail
from gateway.commissioning.peaks import Tail
from gateway.commissioning.sensor_noise import SensorNoise, sensor_noise

# No lower threshold than this share of the configured one, however calm the dives: others will be less so; and none
# that is lower at all, before so many hours were judged
SHARE_LEAST, SHARE_MOST = 0.6, 4.0
LOWERED_HOURS = 0.5


@dataclass(frozen=True, slots=True)
class Learnt:
    """What dives have taught of the sensors. `mounting`: None: of a vehicle without a DVL."""

    noise: SensorNoise
    mounting: Mounting | None

    def settings(self, config: NavigationConfig) -> NavigationConfig:
        """With what is known well enough, and all else as configured."""
        found: dict[str, Any] = {**noises(self.noise, config), **dict(_mounted(self.mounting, config))}
        return replace(config, **found)


@dataclass(frozen=True, slots=True)
class Threshold:
    """Of the method.

    Attributes:
        wanted_per_hour: false alarms.
        share: of the configured one. law: what it was taken from; None: too little, it is as configured.
        events, hours: blocks of time in which it was exceeded, and time, both with settings from other dives.
        held_out: the settings were from other dives.
    """

    wanted_per_hour: float
    share: float
    law: Tail | None
    events: int
    hours: float
    held_out: bool


def learn(courses: Sequence[NavigationCourse]) -> Learnt:
    """What the dives say of the sensors."""
    return Learnt(sensor_noise(courses), mounting_of(courses))


def threshold_of(seen: Sequence[Watched], false_alarms_per_hour: float, *, held_out: bool) -> Threshold:
    """The threshold that is exceeded so often at most, by the bound of a law that is fitted to the peaks."""
    law, judged = tail(seen), hours(seen)
    least = SHARE_LEAST if judged >= LOWERED_HOURS else 1.0
    share = 1.0 if law is None else min(max(law.sure_threshold(false_alarms_per_hour), least), SHARE_MOST)
    return Threshold(false_alarms_per_hour, share, law, blocks_over(seen, share), judged, held_out)


def noises(noise: SensorNoise, config: NavigationConfig) -> dict[str, float]:
    """Settings of the detector by their names, of two digits; a bound counts where more than that is configured."""
    found = {
        "accelerometer_noise_mps2": (noise.accelerometer_mps2, noise.accelerometer_bound),
        "gyroscope_noise_radps": (noise.gyroscope_radps, noise.gyroscope_bound),
        "dvl_noise_mps": (noise.dvl_mps, False),
        "depth_noise_m": (noise.depth_m, False),
    }
    return {
        name: float(f"{value:.2g}")
        for name, (value, bound) in found.items()
        if value is not None and value > 0.0 and not (bound and value > getattr(config, name))
    }


def _mounted(mounting: Mounting | None, config: NavigationConfig) -> Iterator[tuple[str, Any]]:
    """The same of the mounting; a component that is not known stays as configured."""
    if mounting is None:
        return
    yield "dvl_lever_arm_m", _kept(mounting.lever_arm_m, config.dvl_lever_arm_m, 2)
    yield "dvl_mounting_rad", _kept(mounting.rotation_rad, config.dvl_mounting_rad, 4)
    if mounting.delay_s.enough:
        yield "dvl_delay_s", round(min(max(mounting.delay_s.value, -2.0), 2.0), 2)


def _kept(found: Sequence[Known], configured: Sequence[float], digits: int) -> tuple[float, ...]:
    return tuple(round(one.value, digits) if one.enough else was for one, was in zip(found, configured, strict=True))

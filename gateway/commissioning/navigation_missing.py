"""What healthy dives lack, to learn the navigation sensors from them; with the manoeuvre that gives it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, degrees

import numpy as np

from gateway.commissioning.navigation_course import NavigationCourse
from gateway.config_sections import Navigation
from gateway.sensor_watch import RATE_MIN_HZ

JUDGED_S = 180.0
DVL_HZ = 0.4
# The filter learns small angles only. Vehicles go where their bow points, nearly always: what says otherwise is a DVL
# that looks elsewhere
TURNED_DEG, NEARLY_ALWAYS, UNDER_WAY_MPS = 20.0, 0.9, 0.1
EIGHT = "drive a figure of eight, three times round at half thrust, with stops between"


def missing(courses: Sequence[NavigationCourse], navigation: Navigation) -> tuple[str, ...]:
    """Each with the way out; empty: nothing is."""
    return tuple(_missing(courses, navigation))


def _missing(courses: Sequence[NavigationCourse], navigation: Navigation) -> Iterator[str]:
    imu_hz, dvl_hz, depth_hz = (max((one.rates_hz[k] for one in courses), default=0.0) for k in range(3))
    if not imu_hz:
        yield "the inertial unit was never heard: see [navigation] imu, and which messages the autopilot sends"
        return
    if imu_hz < RATE_MIN_HZ:
        yield (
            f"the inertial unit came at {imu_hz:.1f} Hz: want {RATE_MIN_HZ:.0f} Hz at least, 50 Hz is good: ask the "
            "autopilot for its message more often"
        )
    if navigation.dvl != "none" and dvl_hz < DVL_HZ:
        yield _rate("the DVL", "dvl", dvl_hz) + '; without one, set dvl = "none"'
    if navigation.depth != "none" and not depth_hz:
        yield _rate("the depth sensor", "depth", depth_hz)
    if navigation.dvl != "none" and dvl_hz >= DVL_HZ and imu_hz >= RATE_MIN_HZ:
        yield from _axes(courses) or list(_motion(courses))


def _rate(name: str, key: str, rate_hz: float) -> str:
    heard = f"came at {rate_hz:.2f} Hz" if rate_hz else "was never heard"
    return f"{name} {heard}: see [navigation] {key}"


def _axes(courses: Sequence[NavigationCourse]) -> list[str]:
    """A DVL that is turned by more than the filter can learn."""
    velocity = np.concatenate([one.velocity[:, 1:3] for one in courses])
    speed = np.hypot(*velocity.T)
    ahead, right = velocity[speed > UNDER_WAY_MPS].sum(axis=0).tolist()
    angle_deg = degrees(atan2(right, ahead))
    always = np.hypot(ahead, right) >= NEARLY_ALWAYS * max(float(speed.sum()), 1e-9)
    if not always or abs(angle_deg) <= TURNED_DEG:
        return []
    side = "right" if angle_deg > 0.0 else "left"
    return [
        f"the DVL sees the vehicle go {abs(angle_deg):.0f} degrees to the {side} of its bow nearly all the time: is "
        "it turned in the vehicle? Set its rotation where it is set up, for the watch learns small angles only; or "
        "drive ahead for some minutes"
    ]


def _motion(courses: Sequence[NavigationCourse]) -> Iterator[str]:
    judged_s = sum(float(one.dvl.time_s[-1] - one.dvl.time_s[0]) for one in courses if len(one.dvl.time_s))
    if judged_s < JUDGED_S:
        yield f"{judged_s:.0f} s with DVL and inertial unit: want {JUDGED_S:.0f} s: {EIGHT}"
    elif not any(one.acquainted.any() for one in courses):
        yield (
            "the vehicle hardly turned or changed its speed, so that delay and place of the DVL cannot be told: "
            f"{EIGHT}"
        )

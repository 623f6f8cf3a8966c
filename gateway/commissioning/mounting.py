"""How the DVL is mounted and how late it is, from what the navigation filter learnt in several dives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.error_model import STATES
from detectors.navigation.installation import DEPTH_ARM, DEPTH_DELAY, DVL_DELAY, LEVER_ARM, MOUNTING, SCALE
from gateway.commissioning.navigation_course import NavigationCourse

FloatArray: TypeAlias = NDArray[np.float64]

# Standard deviations above which a component counts as not known: m, rad, relative, s; hardly less than the first
# guess is the word for what no motion has shown.
ARM_KNOWN_M, ANGLE_KNOWN_RAD, SCALE_KNOWN, DELAY_KNOWN_S = 0.3, 0.012, 0.006, 0.3

# A line is laid through the delay over this time at least; where a dive taught it late, it may have been another at
# its beginning, by so much per square root of a second
LINE_S, WALK = 60.0, 0.015


@dataclass(frozen=True, slots=True)
class Known:
    """A constant, as several dives know it.

    Attributes:
        value: weighted mean of the dives'.
        error: its standard deviation.
        spread: standard deviation by which it differs from dive to dive, beyond what each dive's own doubt explains.
        enough: it is known well enough to be written down.
    """

    value: float
    error: float
    spread: float
    enough: bool


@dataclass(frozen=True, slots=True)
class Mounting:
    """Of the sensors on the vehicle.

    Attributes:
        lever_arm_m: (3,) from the inertial unit to the DVL, forward, right, down.
        rotation_rad: (3,) roll, pitch, yaw of the DVL.
        scale: by which the DVL measures too much, relative.
        delay_s: by which its samples are stamped later than the inertial unit's, when a dive begins.
        drift: seconds by which that changes in a second.
        depth_delay_s, depth_arm_m: of the depth sensor; the latter forward of the inertial unit.
        dives: that they are from.
    """

    lever_arm_m: tuple[Known, Known, Known]
    rotation_rad: tuple[Known, Known, Known]
    scale: Known
    delay_s: Known
    drift: float
    depth_delay_s: Known
    depth_arm_m: Known
    dives: int


def mounting_of(courses: Sequence[NavigationCourse]) -> Mounting | None:
    """What is known of it; None where no dive had turns enough to know the DVL's delay."""
    taught = [course for course in courses if course.acquainted.any()]
    if not taught:
        return None
    last = np.array([course.installed[-1] for course in taught])
    errors = np.array([course.deviation[-1] for course in taught])
    delays = [_delay(course) for course in taught]
    begins_s, errors_s, drifts = (
        np.array([getattr(one, name) for one in delays]) for name in ("begin_s", "error_s", "drift")
    )
    (x, y, z), (roll, pitch, yaw) = (
        [pooled(last[:, k], errors[:, k], limit) for k in _of(states)]
        for states, limit in ((LEVER_ARM, ARM_KNOWN_M), (MOUNTING, ANGLE_KNOWN_RAD))
    )
    scale, depth_delay, depth_arm = (
        pooled(last[:, state - STATES], errors[:, state - STATES], limit)
        for state, limit in ((SCALE, SCALE_KNOWN), (DEPTH_DELAY, DELAY_KNOWN_S), (DEPTH_ARM, ARM_KNOWN_M))
    )
    return Mounting(
        lever_arm_m=(x, y, z),
        rotation_rad=(roll, pitch, yaw),
        scale=scale,
        delay_s=pooled(begins_s, errors_s, DELAY_KNOWN_S),
        drift=float(np.median(drifts)),
        depth_delay_s=depth_delay,
        depth_arm_m=depth_arm,
        dives=len(taught),
    )


def pooled(values: FloatArray, errors: FloatArray, limit: float) -> Known:
    """The mean of the same constant in (D,) dives, which may differ more than their errors say.

    By R. DerSimonian and N. Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7 (1986): what the
    values scatter by beyond their own errors is a variance of its own, in the weight of each of them.

    Args:
        values, errors: (D,) of the dives, one or more.
        limit: standard deviation up to which the mean is known well enough.
    """
    weight = 1.0 / errors**2
    mean = float(weight @ values / weight.sum())
    scatter = float(weight @ (values - mean) ** 2)
    beyond = weight.sum() - (weight @ weight) / weight.sum()
    between2 = max(scatter - (len(values) - 1), 0.0) / beyond if len(values) > 1 else 0.0
    weight = 1.0 / (errors**2 + between2)
    error = sqrt(1.0 / float(weight.sum()))
    return Known(float(weight @ values) * error**2, error, sqrt(between2), error <= limit)


@dataclass(frozen=True, slots=True)
class _Delay:
    """In one dive: at its beginning, the error of that, and by how much it changes in a second."""

    begin_s: float
    error_s: float
    drift: float


def _delay(course: NavigationCourse) -> _Delay:
    """A straight line: clocks drift apart, and the next dive begins where this one began."""
    index = DVL_DELAY - STATES
    passed_s = (course.dvl.time_s - course.velocity[0, 0])[course.acquainted]
    delays, errors = course.installed[course.acquainted, index], course.deviation[course.acquainted, index]
    drift = float(np.polyfit(passed_s, delays, 1, w=1.0 / errors)[0]) if np.ptp(passed_s) > LINE_S else 0.0
    begin_s = float(np.average(delays - drift * passed_s, weights=1.0 / errors**2))
    return _Delay(begin_s, hypot(float(errors.min()), WALK * sqrt(float(passed_s[0]))), drift)


def _of(states: slice) -> range:
    """Their places among the installation's constants."""
    return range(states.start - STATES, states.stop - STATES)

"""How much DVL and depth sensor scatter, from the innovations of a healthy dive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.commissioning.inertial_noise import AllanCurve, allan_curve
from gateway.commissioning.navigation_course import Innovations, NavigationCourse

FloatArray: TypeAlias = NDArray[np.float64]

STRAIGHT_RADPS = 0.05  # slower than this, a vehicle goes straight on, and what scatters is noise
AROUND_S = 1.0  # a turn is seen so long before and after
TOGETHER_S = 2.5  # samples farther apart are not compared
PAIRS_MIN = 20
MAD = 1.4826  # a standard deviation over the median absolute deviation
# of depths that are off what is expected, so many are off by no more than so many standard deviations: their tails,
# when the vehicle climbs and sinks, count
QUANTILE, DEVIATIONS = 0.95, 1.96


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Noises of the sensors; None: too few samples of it, while the vehicle went straight on.

    Attributes:
        accelerometer_mps2, gyroscope_radps: per root Hz, of the noisiest axis.
        dvl_mps: of a component, on straight legs. pairs: of samples that this is from.
        depth_m: by which depths are off what the filter expects, motion included.
        accelerometer, gyroscope: Allan curves of a dive.
        accelerometer_bound, gyroscope_bound: the vehicle never held still enough: the noise is less than that.
    """

    accelerometer_mps2: float | None
    gyroscope_radps: float | None
    dvl_mps: float | None
    depth_m: float | None
    pairs: int = 0
    accelerometer: AllanCurve | None = None
    gyroscope: AllanCurve | None = None
    accelerometer_bound: bool = False
    gyroscope_bound: bool = False


def sensor_noise(courses: Sequence[NavigationCourse]) -> SensorNoise:
    """Of all dives: medians over them."""
    accelerometers = _curves(courses, slice(1, 4))
    gyroscopes = _curves(courses, slice(4, 7))
    changes = [_changes(course) for course in courses]
    pairs = np.concatenate([*changes, np.empty((0, 3))])
    depths = np.concatenate([*(course.depth.values[_settled(course.depth), 0] for course in courses), np.empty(0)])
    return SensorNoise(
        accelerometer_mps2=_median(accelerometers),
        gyroscope_radps=_median(gyroscopes),
        dvl_mps=float(_scatter(pairs).max()) if len(pairs) >= PAIRS_MIN else None,
        depth_m=float(np.quantile(np.abs(depths), QUANTILE)) / DEVIATIONS if len(depths) >= PAIRS_MIN else None,
        pairs=len(pairs),
        accelerometer=next(iter(accelerometers), None),
        gyroscope=next(iter(gyroscopes), None),
        accelerometer_bound=not any(one.level for one in accelerometers),
        gyroscope_bound=not any(one.level for one in gyroscopes),
    )


def _curves(courses: Sequence[NavigationCourse], columns: slice) -> list[AllanCurve]:
    found = (allan_curve(course.imu[:, 0], course.imu[:, columns]) for course in courses)
    return [one for one in found if one is not None]


def _median(curves: Sequence[AllanCurve]) -> float | None:
    return float(np.median([one.white.max() for one in curves])) if curves else None


def _scatter(pairs: FloatArray) -> FloatArray:
    """(3,) standard deviation of one of two samples whose differences (P, 3) are these; deaf to outliers."""
    return np.asarray(MAD * np.median(np.abs(pairs), axis=0) / np.sqrt(2.0))


def _settled(innovations: Innovations) -> NDArray[np.bool_]:
    """(N,) the second half: until then the filter finds its feet."""
    return np.arange(len(innovations.time_s)) >= len(innovations.time_s) // 2


def _changes(course: NavigationCourse) -> FloatArray:
    """(P, 3) of the DVL's innovation from one sample to the next, on straight legs."""
    time_s, values = course.dvl.time_s, course.dvl.values
    if len(time_s) < 2:
        return np.empty((0, 3))
    straight = _straight(course, time_s)
    both = straight[1:] & straight[:-1] & (np.diff(time_s) < TOGETHER_S)
    return np.asarray(np.diff(values, axis=0)[both])


def _straight(course: NavigationCourse, time_s: FloatArray) -> NDArray[np.bool_]:
    """(N,) whether the vehicle did not turn around these times."""
    total_rad = np.concatenate(([0.0], np.cumsum(np.abs(course.imu[1:, 6]) * np.diff(course.imu[:, 0]))))
    turned_rad = np.interp(time_s + AROUND_S, course.imu[:, 0], total_rad) - np.interp(
        time_s - AROUND_S, course.imu[:, 0], total_rad
    )
    return np.asarray(turned_rad < 2.0 * AROUND_S * STRAIGHT_RADPS)

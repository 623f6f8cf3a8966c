"""Generalised likelihood ratio: which fault, since when and how large, explains the innovations best.

A fault that begins at some instant leaves a trace in all innovations after it, and the filter, which takes it in,
changes that trace in a way that its own matrices tell exactly (Willsky and Jones 1976). So for each fault that a
sensor can have, and each instant of the last minute, the size that fits best follows by least squares, and how much
more likely it makes what was measured than no fault does. A drift that the filter absorbs into tilt and bias is found
by what it does to them.

Sizes have a prior, for their plausible range: a drift of 0.04 m/s in a second is a DVL's, a jump of 0.5 m/s2 an
accelerometer's, although both bend the same curve. With it the ratio is that of the marginal likelihoods, in which
a fault with more parameters needs more evidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.error_model import ACCELEROMETER_BIAS, GYROSCOPE_BIAS
from detectors.navigation.innovation import Innovation
from detectors.navigation.installation import ALL_STATES, SCALE
from detectors.navigation.sample import DepthSample, DvlSample, FaultKind, Sensor, Vector

FloatArray = NDArray[np.float64]

# Instants at which a fault may have begun: every second, and every third for those farther back.
ONSET_S = 0.9
RECENT_S, LONGEST_S = 20.0, 60.0
SPARSE = 3
# One sample can be off without anything being broken: its squared size in standard deviations counts only so far, at
# one sample a second, and less where they come faster.
SAMPLE_LIMIT, SAMPLE_LIMIT_RATE = (3.0, 18.0), 32.0
# On a straight course a wrong scale looks like an offset; it is called so only where it explains much more.
SCALE_RARER = 8.0
# Inertial sensors fail more rarely than a DVL, which loses its bottom, or a depth sensor; gyroscopes the more so.
INERTIAL_RARER = {Sensor.ACCELEROMETER: 4.0, Sensor.GYROSCOPE: 12.0}


@dataclass(frozen=True, slots=True)
class Family:
    """A kind of fault of one sensor.

    Attributes:
        sensor, kind: of which, and how.
        size: standard deviation of each component before anything is measured, in the sensor's unit (a drift: per
            second; a scale: relative).
        components: 3 or 1.
    """

    sensor: Sensor
    kind: FaultKind
    size: float
    components: int = 3


FAMILIES = (
    Family(Sensor.DVL, FaultKind.STEP, 0.5),
    Family(Sensor.DVL, FaultKind.DRIFT, 0.05),
    Family(Sensor.DVL, FaultKind.SCALE, 0.3, 1),
    Family(Sensor.DEPTH, FaultKind.STEP, 1.0, 1),
    Family(Sensor.DEPTH, FaultKind.DRIFT, 0.05, 1),
    Family(Sensor.ACCELEROMETER, FaultKind.STEP, 0.3),
    Family(Sensor.GYROSCOPE, FaultKind.STEP, 0.01),
)
_SIZES = np.array([family.size for family in FAMILIES])
_COUNT = len(FAMILIES)
_DVL_STEP, _DVL_DRIFT, _DVL_SCALE, _DEPTH_STEP, _DEPTH_DRIFT, _ACCELEROMETER, _GYROSCOPE = range(_COUNT)


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """The best fault of one sensor.

    Attributes:
        family: which.
        ratio: twice the logarithm of the likelihood ratio against no fault.
        onset_s: when it began.
        size: (3,) of it, in the family's unit; of one component the first.
        size_now: (3,) of the sensor's error now, in its unit; a depth is the third. Not for a scale.
    """

    family: Family
    ratio: float
    onset_s: float
    size: Vector
    size_now: Vector

    @property
    def weight(self) -> float:
        """The ratio, less what speaks against this kind before anything is measured."""
        rarer = SCALE_RARER if self.family.kind is FaultKind.SCALE else INERTIAL_RARER.get(self.family.sensor, 0.0)
        return self.ratio - rarer


class LikelihoodRatio:
    """All faults at all instants, followed through the filter at once. Picklable, bit for bit."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forgets all that was measured: from now on a fault would be a new one."""
        self._newest_s = 0.0
        self._onsets_s = np.zeros(0)
        self._kept = np.zeros(0, dtype=bool)
        self._begun = 0
        # what a fault of unit size makes the states err by, (N, onsets, families, components)
        self._errors = np.zeros((ALL_STATES, 0, _COUNT, 3))
        self._information = np.zeros((0, _COUNT, 3, 3))
        self._correlation = np.zeros((0, _COUNT, 3))
        self._last_s: dict[type, float] = {}

    def update(self, innovation: Innovation, *, counts: bool = True) -> None:
        """Takes an innovation of any sensor, in the filter's order; `counts`: it is evidence."""
        self._newest_s = innovation.time_s
        transition = innovation.transition
        states, onsets = ALL_STATES, len(self._onsets_s)
        self._errors = (transition @ self._errors.reshape(states, -1)).reshape(states, onsets, _COUNT, 3)
        if isinstance(innovation.measurement, DvlSample | DepthSample):
            self._begin(innovation.time_s)
        if not len(self._onsets_s):
            return
        traces = self._traces(innovation)
        if innovation.gain is not None:
            flat = innovation.gain @ traces.reshape(len(traces), -1)
            self._errors = self._errors - flat.reshape(self._errors.shape)
        if counts:
            self._collect(innovation, traces)

    def ratios(self) -> FloatArray:
        """(families,) twice the logarithm of the best likelihood ratio of each; 0 where nothing was measured."""
        if not len(self._onsets_s):
            return np.zeros(_COUNT)
        return np.asarray(self._all_ratios()[0].max(axis=0))

    def explanations(self) -> list[Explanation]:
        """The best of each sensor, the most likely first."""
        if not len(self._onsets_s):
            return []
        ratios, sizes = self._all_ratios()
        best: dict[Sensor, Explanation] = {}
        for index, family in enumerate(FAMILIES):
            onset = int(np.argmax(ratios[:, index]))
            one = self._explanation(family, index, onset, float(ratios[onset, index]), sizes[onset, index])
            if family.sensor not in best or one.weight > best[family.sensor].weight:
                best[family.sensor] = one
        return sorted(best.values(), key=lambda one: -one.ratio)

    def consequences(self, explanation: Explanation) -> tuple[FloatArray, FloatArray]:
        """(N,) error of the filter's states because of a fault that was explained just now, and its covariance."""
        onset, index = int(np.searchsorted(self._onsets_s, explanation.onset_s)), FAMILIES.index(explanation.family)
        errors, size = self._errors[:, onset, index], np.array(explanation.size)
        uncertain = np.linalg.inv(np.eye(3) / explanation.family.size**2 + self._information[onset, index])
        error, covariance = errors @ size, errors @ uncertain @ errors.T
        if explanation.family.kind is FaultKind.SCALE:
            # the sensor's fault, which is not to be learnt as its mounting
            error[SCALE], covariance[SCALE, :], covariance[:, SCALE] = 0.0, 0.0, 0.0
        return error, covariance

    def _begin(self, time_s: float) -> None:
        if len(self._onsets_s) and time_s - self._onsets_s[-1] < ONSET_S:
            return
        errors = np.zeros((ALL_STATES, 1, _COUNT, 3))
        errors[ACCELEROMETER_BIAS, 0, _ACCELEROMETER] = np.eye(3)
        errors[GYROSCOPE_BIAS, 0, _GYROSCOPE] = np.eye(3)
        errors[SCALE, 0, _DVL_SCALE, 0] = 1.0
        age_s = time_s - self._onsets_s
        keep = (age_s < RECENT_S) | (self._kept & (age_s < LONGEST_S))
        self._onsets_s = np.append(self._onsets_s[keep], time_s)
        self._kept = np.append(self._kept[keep], self._begun % SPARSE == 0)
        self._begun += 1
        self._errors = np.concatenate([self._errors[:, keep], errors], axis=1)
        self._information = np.concatenate([self._information[keep], np.zeros((1, _COUNT, 3, 3))])
        self._correlation = np.concatenate([self._correlation[keep], np.zeros((1, _COUNT, 3))])

    def _traces(self, innovation: Innovation) -> FloatArray:
        """(M, onsets, families, components) of a fault of unit size in this innovation."""
        observed = innovation.observation @ self._errors.reshape(ALL_STATES, -1)
        traces = observed.reshape(len(innovation.values), *self._errors.shape[1:])
        age_s = innovation.time_s - self._onsets_s
        if isinstance(innovation.measurement, DvlSample):
            for axis in range(3):
                traces[axis, :, _DVL_STEP, axis] += 1.0
                traces[axis, :, _DVL_DRIFT, axis] += age_s + ONSET_S
        elif isinstance(innovation.measurement, DepthSample):
            traces[0, :, _DEPTH_STEP, 0] += 1.0
            traces[0, :, _DEPTH_DRIFT, 0] += np.maximum(age_s + ONSET_S, 0.0)
        return traces

    def _collect(self, innovation: Innovation, traces: FloatArray) -> None:
        kind, time_s = type(innovation.measurement), innovation.time_s
        interval_s = time_s - self._last_s.get(kind, time_s - 1.0)
        self._last_s[kind] = time_s
        limit = float(np.clip(SAMPLE_LIMIT_RATE * interval_s, *SAMPLE_LIMIT))
        scale = max(1.0, innovation.squared / limit)
        # in units of its standard deviations
        root = np.linalg.cholesky(innovation.covariance * scale)
        white = np.linalg.solve(root, traces.reshape(len(traces), -1)).reshape(traces.shape)
        values = np.linalg.solve(root, innovation.values)
        columns = np.moveaxis(white, 0, -1)
        self._information = self._information + columns @ np.swapaxes(columns, -1, -2)
        self._correlation = self._correlation + columns @ values

    def _all_ratios(self) -> tuple[FloatArray, FloatArray]:
        """(onsets, families) of the ratios, and (onsets, families, 3) of the sizes."""
        prior = (_SIZES**2)[:, np.newaxis, np.newaxis]
        inflated = np.eye(3) + prior * self._information
        sizes = np.linalg.solve(inflated, prior * self._correlation[..., np.newaxis])[..., 0]
        _, occam = np.linalg.slogdet(inflated)
        return np.asarray((self._correlation * sizes).sum(axis=-1) - occam), np.asarray(sizes)

    def _explanation(self, family: Family, index: int, onset: int, ratio: float, size: FloatArray) -> Explanation:
        grown = size
        if family.kind is FaultKind.DRIFT:
            grown = size * (self._newest_s - float(self._onsets_s[onset]) + ONSET_S)
        elif family.kind is FaultKind.SCALE:
            grown = 0.0 * size
        return Explanation(
            family,
            ratio,
            float(self._onsets_s[onset]),
            _vector(size),
            _vector(np.roll(grown, 2) if family.sensor is Sensor.DEPTH else grown),
        )


def _vector(array: FloatArray) -> Vector:
    x, y, z = array.tolist()
    return x, y, z

"""Speed and flow by one Kalman filter, beside the paper's adaptive law and with an uncertainty that it lacks."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from detectors.speed.estimate import Estimate, Step

FloatArray = NDArray[np.float64]

# Standard deviations of what changes by itself in one second, in reference speeds: both wander, the flow more slowly.
# On simulated missions more of either leaves a loss of 30 % within the uncertainty, less mistakes eddies for one.
SPEED_WANDERS = 0.01
FLOW_WANDERS = 0.005
UNKNOWN_NOISE_S = 1.0  # standard deviation of a position that nobody knows, as the way of so many seconds


class KalmanEstimator:
    """States: position (D), speed, flow (D), of which the position is measured. An `Estimator`.

    The vehicle moves by flow times the interval and speed times `ahead_s`; speed and flow are random walks. What
    `aside_s` and `turned` say is not used: it goes into the flow.

    Args:
        dimensions: D.
        speed_scale_mps: a usual speed, to which uncertainties at the start and changes are in proportion.
        speed_mps: at the start.
        position_noise_m: standard deviation of each coordinate of a position; None: as each step says.

    Raises:
        ValueError: a scale or noise not above 0, or a speed that is not finite.
    """

    def __init__(
        self,
        dimensions: int = 2,
        *,
        speed_scale_mps: float = 1.0,
        speed_mps: float = 0.0,
        position_noise_m: float | None = None,
    ) -> None:
        for name, value in (("speed_scale_mps", speed_scale_mps), ("position_noise_m", position_noise_m)):
            if value is not None and not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}: want above 0")
        if not isfinite(speed_mps):
            raise ValueError(f"speed_mps = {speed_mps}: want a finite number")
        self._dimensions = dimensions
        wanders = np.array([SPEED_WANDERS, *[FLOW_WANDERS] * dimensions])
        self._wander_rates = (wanders * speed_scale_mps) ** 2  # variance per second of speed and flow
        self._known_noise_m = position_noise_m
        self._noise_m = UNKNOWN_NOISE_S * speed_scale_mps if position_noise_m is None else position_noise_m
        # here, for it brings all of scipy.stats, for which no command that only asks or checks should wait a second
        from filterpy.kalman import KalmanFilter

        self._filter = KalmanFilter(dim_x=2 * dimensions + 1, dim_z=dimensions)
        self._filter.x[dimensions, 0] = speed_mps
        self._filter.P = np.eye(2 * dimensions + 1) * speed_scale_mps**2
        self._filter.H = np.eye(dimensions, 2 * dimensions + 1)

    def begin(self, position_m: FloatArray, time_s: float) -> None:
        """As `Estimator.begin`."""
        count = self._dimensions
        self._filter.x[:count, 0] = position_m
        self._filter.P[:count], self._filter.P[:, :count] = 0.0, 0.0
        self._filter.P[:count, :count] = np.eye(count) * self._noise_m**2

    def idle(self, interval_s: float) -> None:
        """As `Estimator.idle`."""
        learnt = slice(self._dimensions, None)
        self._filter.P[learnt, learnt] += np.diag(self._wander_rates * interval_s)

    def rescale(self, factor: float) -> None:
        """As `Estimator.rescale`."""
        self._filter.x[self._dimensions] *= factor
        self._filter.P[self._dimensions] *= factor
        self._filter.P[:, self._dimensions] *= factor
        self._wander_rates[0] *= factor**2

    def update(self, step: Step) -> Estimate:
        """As `Estimator.update`."""
        count, size = self._dimensions, 2 * self._dimensions + 1
        transition, wandering = self._motion(step)
        self._filter.predict(F=_shaped("F", transition, (size, size)), Q=_shaped("Q", wandering, (size, size)))
        position = _shaped("z", step.position_m.reshape(-1, 1), (count, 1))
        if self._known_noise_m is None and isfinite(step.position_noise_m):
            self._noise_m = step.position_noise_m
        self._filter.update(position, R=np.eye(count) * self._noise_m**2)
        return self._estimate()

    def _motion(self, step: Step) -> tuple[FloatArray, FloatArray]:
        """F and Q of the step."""
        count, size, h = self._dimensions, 2 * self._dimensions + 1, step.interval_s
        by_cause = np.column_stack((step.ahead_s, h * np.eye(count)))  # position by speed and flow
        transition = np.eye(size)
        transition[:count, count:] = by_cause
        rates = self._wander_rates
        # random walks of these rates, seen through the mean direction of the step: integrated exactly
        wandering = np.zeros((size, size))
        wandering[:count, :count] = (by_cause * rates) @ by_cause.T * h / 3.0
        wandering[:count, count:] = by_cause * rates * h / 2.0
        wandering[count:, :count] = wandering[:count, count:].T
        wandering[count:, count:] = np.diag(rates * h)
        return transition, wandering

    def _estimate(self) -> Estimate:
        count = self._dimensions
        errors = np.sqrt(np.maximum(np.diag(self._filter.P)[count:], 0.0))
        return Estimate(
            speed_mps=float(self._filter.x[count, 0]),
            speed_error_mps=float(errors[0]),
            flow_mps=self._filter.x[count + 1 :, 0].copy(),
            flow_error_mps=float(errors[1:].max()),
        )


def _shaped(name: str, array: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """The array; filterpy would take another shape, too, and make something of it."""
    if array.shape != shape:
        raise ValueError(f"{name} of the shape {array.shape}: want {shape}")
    return array

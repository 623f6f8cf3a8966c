"""Settings of the speed detector."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal, get_args

from detectors.speed.basis import FlowBasis
from detectors.speed.curve import SpeedCurve
from detectors.speed.flow import FlowModel

EstimatorName = Literal["interacting", "kalman", "adaptive", "published"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedConfig:
    """Settings of the speed detector.

    `SpeedConfig(estimator="published", speed_min_mps=..., speed_max_mps=..., basis=...)` is the method of paper 002
    to the letter, at one sampling interval and with its explicit step.

    Attributes:
        speed_min_mps, speed_max_mps: normal speed through the water (paper 002, assumption 3), at the usual command;
            both None: learnt, as a curve over the command where that is known.
        range_command: command that this range belongs to, above 0 to 1; None: the one of the first seconds under way.
        usual_mps: about the usual speed, within a factor of three, where no normal speed is given.
        tolerance: of the learnt normal speed: a share of it up or down is normal.
        estimator: how speed and flow are told apart. "interacting": several Kalman filters, from calm to changing
            water; "kalman": one; "adaptive": the paper's law, integrated exactly; "published": to the letter.
        learning_rate: paper 002, equations 12 and 13.
        gain: paper 002, K of equation 9, as one number.
        basis: paper 002, equation 6; None: centres and widths move with the vehicle.
        flow_error_max: paper 002, Algorithm 2, false alarm factor, 0 to 1: a learnt flow that differs more than this
            from the foreseen one is not trusted.
        flow_model: an outside model of the flow; None: the flow learnt while the speed was normal, carried on.
        flow_model_error_mps: how far an outside model is off, as a standard deviation of each component.
        speed_limit_mps: most that the thrusters can give (paper 002, u_0 of equation 3); None: no limit.
        position_noise_m: standard deviation of a position; None: learnt.
        dimensions: 2, or 3 with depth, pitch and upwelling.
        speed_curve: normal speed over the command; None: learnt, where there are commands.
        surge_time_s: time constant with which speed follows the command.

    Raises:
        ValueError: a setting out of its range.
    """

    speed_min_mps: float | None = None
    speed_max_mps: float | None = None
    range_command: float | None = None
    usual_mps: float = 1.0
    tolerance: float = 0.2
    estimator: EstimatorName = "interacting"
    learning_rate: float = 0.8
    gain: float = 1.0
    basis: FlowBasis | None = None
    flow_error_max: float = 0.07
    flow_model: FlowModel | None = None
    flow_model_error_mps: float = 0.2
    speed_limit_mps: float | None = None
    position_noise_m: float | None = None
    dimensions: Literal[2, 3] = 2
    speed_curve: SpeedCurve | None = None
    surge_time_s: float = 1.0

    def __post_init__(self) -> None:
        for name in ("usual_mps", "learning_rate", "gain", "flow_model_error_mps", "surge_time_s"):
            value = getattr(self, name)
            _want(name, value, value > 0, "above 0")
        command = self.range_command
        _want("range_command", command, command is None or 0 < command <= 1, "above 0, to 1, or None")
        for name in ("speed_limit_mps", "position_noise_m"):
            value = getattr(self, name)
            _want(name, value, value is None or value > 0, "above 0, or None")
        _want("tolerance", self.tolerance, 0 < self.tolerance < 1, "between 0 and 1")
        _want("flow_error_max", self.flow_error_max, 0 < self.flow_error_max <= 1, "above 0, to 1")
        names = get_args(EstimatorName)
        _want("estimator", self.estimator, self.estimator in names, f"one of {', '.join(names)}")
        _want("dimensions", self.dimensions, self.dimensions in (2, 3), "2 or 3")
        self._check_range()

    @property
    def speed_scale_mps(self) -> float:
        """About the usual speed: the middle of the normal range, or the greatest of the curve."""
        if self.speed_min_mps is not None and self.speed_max_mps is not None:
            return 0.5 * (self.speed_min_mps + self.speed_max_mps)
        return self.usual_mps if self.speed_curve is None else max(map(abs, self.speed_curve.speeds_mps))

    @property
    def normal_shares(self) -> tuple[float, float]:
        """Lowest and highest normal speed, as shares of the usual one."""
        if self.speed_min_mps is not None and self.speed_max_mps is not None:
            return self.speed_min_mps / self.speed_scale_mps, self.speed_max_mps / self.speed_scale_mps
        return 1.0 - self.tolerance, 1.0 + self.tolerance

    def _check_range(self) -> None:
        low, high = self.speed_min_mps, self.speed_max_mps
        if low is None and high is None:
            published = self.estimator == "published"
            _want("speed_min_mps", low, not published, "a number: the published method does not learn its range")
            return
        _want("speed_min_mps", low, low is not None and low >= 0, "0 or more, where speed_max_mps is given")
        _want(
            "speed_max_mps", high, high is not None and low is not None and high > low, f"above speed_min_mps = {low}"
        )


def _want(name: str, value: object, fulfilled: bool, wanted: str) -> None:
    if not fulfilled or (isinstance(value, float) and not isfinite(value)):
        raise ValueError(f"{name} = {value!r}: want {wanted}")

"""The method of paper 000 as published: a static polynomial, learnt anew whenever it no longer fits (figure 6)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf, isfinite, nan

from detectors.thruster.modelling import OnlineModel, OnlineModelling
from detectors.thruster.sample import ThrusterSample
from detectors.thruster.search import SearchName
from detectors.verdict import Level


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperStep:
    """What the paper's method says of one sample. NaN and 0 while there is no model.

    Attributes:
        level: UNKNOWN in the warm-up, SUSPECT at the first residual that a new model does not mend, FAULT from the
            second on (rule 3), NORMAL otherwise: also once the state after the fault has been learnt.
        residual_rpm: measured less predicted speed, by the model in force after this sample (equations 18 and 20).
        forecast_residual_rpm: the same by the model in force before this sample had been seen (equation 19).
        predicted_rpm: speed that the model in force after this sample gives for it.
        threshold_rpm: bound of |residual_rpm|.
        order, window, delay: of the model in force after this sample; order 0 where the commands did not change.
        refitted: whether the model was learnt anew at this sample.
        fault_since_s: time of the first sample of the fault (the paper's t), NaN while there is none.
    """

    level: Level
    residual_rpm: float = nan
    forecast_residual_rpm: float = nan
    predicted_rpm: float = nan
    threshold_rpm: float = nan
    order: int = 0
    window: int = 0
    delay: int = 0
    refitted: bool = False
    fault_since_s: float = nan

    @property
    def score(self) -> float:
        """|residual| over its threshold; 0.0 while there is no model."""
        return abs(self.residual_rpm) / self.threshold_rpm if isfinite(self.residual_rpm) else 0.0


@dataclass(frozen=True, slots=True)
class _Judged:
    predicted_rpm: float
    residual_rpm: float
    threshold_rpm: float
    covered: bool  # the model knows this command well enough to be asked

    @property
    def within(self) -> bool:
        return abs(self.residual_rpm) <= self.threshold_rpm


class _Rule(ABC):
    """What the online and the fixed rule share: arguments, warm-up, first model, and the residual of a sample.

    Args:
        order_max, delay_max, window_min, window_max, search, seed: as for `OnlineModelling`.
        warmup: samples before the first model (paper: 500).
        threshold_rpm: bound of |residual| (paper: 80 or 8), None for `OnlineModel.threshold_rpm`.

    Raises:
        ValueError: an argument out of range.
    """

    def __init__(
        self,
        *,
        order_max: int = 5,
        delay_max: int = 10,
        window_min: int = 50,
        window_max: int = 500,
        warmup: int = 500,
        search: SearchName = "swarm",
        threshold_rpm: float | None = None,
        seed: int = 0,
    ) -> None:
        if threshold_rpm is not None and not 0.0 < threshold_rpm < inf:
            raise ValueError(f"threshold_rpm = {threshold_rpm}: want above 0, or None for an automatic one")
        if warmup < window_min + delay_max:
            raise ValueError(f"warmup = {warmup}: want at least window_min + delay_max = {window_min + delay_max}")
        self._modelling = OnlineModelling(
            order_max=order_max,
            delay_max=delay_max,
            window_min=window_min,
            window_max=window_max,
            search=search,
            seed=seed,
        )
        self._warmup, self._threshold_rpm = warmup, threshold_rpm
        self._seen = 0

    def step(self, sample: ThrusterSample) -> PaperStep:
        """Judge the next sample. Its values must be finite, and one sampling period after the last."""
        self._modelling.append(sample.command, sample.speed_rpm)
        self._seen += 1
        if self._seen < self._warmup:
            return PaperStep(level=Level.UNKNOWN)
        return self._judge_sample(sample)

    @abstractmethod
    def _judge_sample(self, sample: ThrusterSample) -> PaperStep: ...

    def _judge(self, sample: ThrusterSample, model: OnlineModel) -> _Judged:
        command = self._modelling.command_before(model.delay)
        predicted = float(model.curve.predict(command))
        residual = sample.speed_rpm - predicted
        if self._threshold_rpm is not None:
            return _Judged(predicted, residual, self._threshold_rpm, covered=True)
        return _Judged(predicted, residual, model.threshold_rpm(command), model.covers(command))


class OnlinePolynomial(_Rule):
    """The paper's rule (section 5, figure 6); picklable at any sample, and then goes on bit for bit.

    A residual beyond the threshold starts an online modelling. If the new model's residual is beyond it too,
    modelling is repeated with every following sample until one is within; from the second such sample on it is a
    fault, since the first. Once the state after the fault has been learnt, a second fault is found in the same way
    (section 6.3).
    """

    _model: OnlineModel | None = None
    _beyond = 0  # successive samples whose newly built model did not mend the residual
    _since_s = nan  # time of the first of them

    @property
    def model(self) -> OnlineModel | None:
        """In use now; None while warming up."""
        return self._model

    def _judge_sample(self, sample: ThrusterSample) -> PaperStep:
        forecast = self._judge(sample, self._model) if self._model else None
        if self._model and forecast and forecast.within and forecast.covered and not self._beyond:
            return _report(Level.NORMAL, self._model, forecast, forecast)  # rule (1)
        learnt = self._modelling.learn()
        self._model = learnt.no_noisier_than(self._model) if self._model and self._beyond else learnt
        judged = self._judge(sample, self._model)
        level = self._count(judged, sample.time_s)
        return _report(level, self._model, judged, forecast, refitted=True, fault_since_s=self._since_s)

    def _count(self, judged: _Judged, time_s: float) -> Level:
        """Rules (2) and (3): what the residual of a newly built model means."""
        if judged.within:
            self._beyond, self._since_s = 0, nan
            return Level.NORMAL
        self._beyond += 1
        if self._beyond == 1:
            self._since_s = time_s
            return Level.SUSPECT
        return Level.FAULT


class FixedPolynomial(_Rule):
    """The paper's comparison (section 6.1): the same first model, kept for ever; every residual beyond is a fault."""

    _model: OnlineModel | None = None

    def _judge_sample(self, sample: ThrusterSample) -> PaperStep:
        first = self._model is None
        model = self._model = self._model or self._modelling.learn()
        judged = self._judge(sample, model)
        level = Level.NORMAL if judged.within else Level.FAULT
        since_s = nan if judged.within else sample.time_s
        return _report(level, model, judged, None if first else judged, refitted=first, fault_since_s=since_s)


def _report(
    level: Level,
    model: OnlineModel,
    judged: _Judged,
    forecast: _Judged | None,
    *,
    refitted: bool = False,
    fault_since_s: float = nan,
) -> PaperStep:
    return PaperStep(
        level=level,
        residual_rpm=judged.residual_rpm,
        forecast_residual_rpm=forecast.residual_rpm if forecast else nan,
        predicted_rpm=judged.predicted_rpm,
        threshold_rpm=judged.threshold_rpm,
        order=model.curve.order,
        window=model.curve.window,
        delay=model.delay,
        refitted=refitted,
        fault_since_s=fault_since_s,
    )

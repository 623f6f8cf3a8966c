"""The thruster detector: guards its input, and hands it to the method that the configuration names."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from math import isfinite, nan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from detectors.thruster.adaptive import AdaptiveMethod
from detectors.thruster.config import ThrusterConfig
from detectors.thruster.judgement import Judgement, Method
from detectors.thruster.learnt import LearntCurve
from detectors.thruster.published import PublishedMethod
from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.thruster.wear import CommissionedCurve
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

LARGEST = 1e15  # magnitude of time, command or speed beyond which no sample makes sense, in any unit ...
SMALLEST = 1e-15  # ... and below which it is none: the ratio's higher powers stay finite numbers
SUPPLY_MIN, SUPPLY_MAX = 1e-3, 1e6  # volts that count as measured, and ...
CURRENT_MAX = 1e6  # ... amperes

UNJUDGED = ThrusterVerdict(
    time_s=nan, level=Level.UNKNOWN, score=0.0, residual_rpm=nan, predicted_rpm=nan, threshold_rpm=nan,
    order=0, window=0, delay=0, lag_s=0.0, refitted=False, reason="learning",
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class ThrusterVerdicts:
    """Verdicts of N samples as arrays (N,); attributes as in `ThrusterVerdict`."""

    time_s: FloatArray
    level: NDArray[np.int64]
    score: FloatArray
    residual_rpm: FloatArray
    predicted_rpm: FloatArray
    threshold_rpm: FloatArray
    order: NDArray[np.int64]
    window: NDArray[np.int64]
    delay: NDArray[np.int64]
    lag_s: FloatArray
    refitted: NDArray[np.bool_]
    kind: NDArray[np.str_]
    wear: FloatArray
    reason: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def whole(self) -> ThrusterVerdicts:
        """All of them: these, where others are still waited for."""
        return self

    @classmethod
    def blank(cls, samples: int) -> ThrusterVerdicts:
        """As many verdicts of a detector that has seen nothing yet."""
        columns = {}
        for name in cls.__slots__:
            value = getattr(UNJUDGED, name)
            columns[name] = np.full(samples, value, dtype="U40" if isinstance(value, str) else None)
        return cls(**columns)

    def row(self, index: int) -> ThrusterVerdict:
        """One of the verdicts."""
        values = {name: getattr(self, name)[index].item() for name in self.__slots__}
        return ThrusterVerdict(**{**values, "level": Level(values["level"]), "kind": FaultKind(values["kind"])})


class ThrusterDetector:
    """Watches one thruster: its speed against what its command should give.

    Picklable at any sample; unpickled, it goes on bit for bit.

    Args:
        config: settings.
        commissioned: curve to measure wear against, from an earlier dive; None for the first one that is learnt.

    >>> detector = ThrusterDetector(ThrusterConfig())
    >>> detector.update(ThrusterSample(0.0, command=0.5, speed_rpm=1800.0)).level.name
    'UNKNOWN'
    """

    def __init__(self, config: ThrusterConfig | None = None, commissioned: CommissionedCurve | None = None) -> None:
        self.config = config or ThrusterConfig()
        self._method: Method = (
            AdaptiveMethod(self.config, commissioned) if self.config.dynamics else PublishedMethod(self.config)
        )
        self._last = UNJUDGED
        self.refused: Counter[str] = Counter()

    @property
    def commissioned(self) -> CommissionedCurve | None:
        """The curve that wear is measured against; None while there is none."""
        return self._method.commissioned

    @property
    def learnt(self) -> LearntCurve | None:
        """The steady curve as it is learnt by now; None while there is none."""
        return self._method.learnt

    def accept(self) -> None:
        """An operator's act: today's thruster is healthy. Its curve becomes the commissioned one, a fault is over."""
        self._method.accept()

    def begin_dive(self) -> None:
        """What comes now is another dive: what was learnt judges it until it has been learnt from by itself."""
        self._method.begin_dive()

    def resume(self) -> None:
        """After a restart of the program: the clock may be another, and behind the one that it knew."""
        self._last = replace(self._last, time_s=nan)

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        """Judge the next sample. Never raises on data.

        A sample that is not finite, beyond all range, or not later than the last one, is refused and counted in
        `refused`; the last verdict stands. A supply voltage or current that makes no sense counts as not measured.
        """
        cause = self._cause_to_refuse(sample)
        if cause:
            self.refused[cause] += 1
            self._last = replace(self._last, refitted=False)
            return self._last
        values = (
            sample.time_s,
            sample.command,
            sample.speed_rpm,
            _measured(sample.voltage_v),
            _measured(sample.current_a),
        )
        judgement = next(self._method.judge(_sensible(np.array(values)[:, None])))
        self._last = _verdict(sample.time_s, judgement)
        return self._last

    def _cause_to_refuse(self, sample: ThrusterSample) -> str:
        values = (sample.time_s, sample.command, sample.speed_rpm)
        if not all(map(isfinite, values)):
            return "not finite"
        if max(map(abs, values)) > LARGEST:
            return "out of range"
        return "late or repeated" if sample.time_s <= self._last.time_s else ""

    def run(
        self,
        time_s: ArrayLike,
        command: ArrayLike,
        speed_rpm: ArrayLike,
        voltage_v: ArrayLike | None = None,
        current_a: ArrayLike | None = None,
    ) -> ThrusterVerdicts:
        """Judge (N,) samples at once: equal to calling `update` on each, and much faster.

        Args:
            time_s, command, speed_rpm: as in `ThrusterSample`.
            voltage_v, current_a: NaN or None where not measured.

        Raises:
            ValueError: the arrays are not one-dimensional, or differ in length.
        """
        block = _block(time_s, command, speed_rpm, voltage_v, current_a)
        accepted = self._accepted(block)
        verdicts = ThrusterVerdicts.blank(int(accepted.sum()))
        done, times = 0, block[0, accepted]
        verdicts.time_s[:] = times
        for judgement in self._method.judge(_sensible(block[:, accepted])):
            _write(verdicts, slice(done, done + len(judgement)), judgement)
            done += len(judgement)
        return self._with_refused(verdicts, accepted)

    def _accepted(self, block: FloatArray) -> NDArray[np.bool_]:
        """(N,) which samples are taken; the others are counted."""
        finite = np.isfinite(block[:3]).all(axis=0)
        within = finite & (np.abs(block[:3]) <= LARGEST).all(axis=0)
        start = self._last.time_s if isfinite(self._last.time_s) else -np.inf
        latest = np.maximum.accumulate(np.concatenate([[start], np.where(within, block[0], -np.inf)]))[:-1]
        later = block[0] > latest
        causes = {"not finite": ~finite, "out of range": finite & ~within, "late or repeated": within & ~later}
        for cause, refused in causes.items():
            if refused.any():
                self.refused[cause] += int(refused.sum())
        return np.asarray(within & later)

    def _with_refused(self, verdicts: ThrusterVerdicts, accepted: NDArray[np.bool_]) -> ThrusterVerdicts:
        """Each refused sample gets the verdict that stands."""
        before = self._last
        if len(verdicts):
            self._last = verdicts.row(-1)
        if accepted.all():
            return verdicts
        self._last = replace(self._last, refitted=bool(accepted[-1]) and self._last.refitted)
        source = np.cumsum(accepted)  # 0: the verdict that stood before
        columns = {}
        for name in ThrusterVerdicts.__slots__:
            column = getattr(verdicts, name)
            columns[name] = np.concatenate([np.array([getattr(before, name)], dtype=column.dtype), column])[source]
        columns["refitted"] &= accepted
        return ThrusterVerdicts(**columns)


def _measured(value: float | None) -> float:
    return nan if value is None else value


def _sensible(block: FloatArray) -> FloatArray:
    """(5, N) the samples, with next to nothing as 0 and what no supply or motor shows as not measured."""
    time_s, command, speed_rpm, voltage_v, current_a = block
    return np.stack(
        [
            time_s,
            np.where(np.abs(command) < SMALLEST, 0.0, command),
            np.where(np.abs(speed_rpm) < SMALLEST, 0.0, speed_rpm),
            np.where((voltage_v >= SUPPLY_MIN) & (voltage_v <= SUPPLY_MAX), voltage_v, nan),
            np.where(np.abs(current_a) <= CURRENT_MAX, current_a, nan),
        ]
    )


def _block(*series: ArrayLike | None) -> FloatArray:
    """(5, N) of the series; those that are None are NaN."""
    arrays = [None if one is None else np.asarray(one, dtype=np.float64) for one in series]
    shape = () if arrays[0] is None else arrays[0].shape
    for name, array in zip(("time_s", "command", "speed_rpm", "voltage_v", "current_a"), arrays, strict=True):
        if array is not None and (array.ndim != 1 or array.shape != shape):
            raise ValueError(f"{name} has shape {array.shape}, time_s {shape}: want one-dimensional, of one length")
    return np.stack([np.full(shape, nan) if array is None else array for array in arrays])


def _verdict(time_s: float, judgement: Judgement) -> ThrusterVerdict:
    """The first sample's verdict."""
    return ThrusterVerdict(
        time_s=time_s,
        level=Level(int(judgement.level[0])),
        score=float(judgement.score[0]),
        residual_rpm=float(judgement.residual_rpm[0]),
        predicted_rpm=float(judgement.predicted_rpm[0]),
        threshold_rpm=float(judgement.threshold_rpm[0]),
        order=judgement.order,
        window=judgement.window,
        delay=judgement.delay,
        lag_s=judgement.lag_s,
        refitted=judgement.refitted,
        kind=FaultKind(judgement.kind[0]),
        wear=judgement.wear,
        reason=str(judgement.reason[0]),
    )


def _write(verdicts: ThrusterVerdicts, where: slice, judgement: Judgement) -> None:
    for name in Judgement.__slots__:
        getattr(verdicts, name)[where] = getattr(judgement, name)
    verdicts.refitted[where.start + 1 : where.stop] = False

"""The default method: learn the thruster all the time, and call a fast, lasting change of its gain a fault."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import nan

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.assessment import (
    FAST,
    RECOVER,
    SLOW,
    Assessment,
    Fault,
    follow,
    run_length,
    thresholds,
    watch,
)
from detectors.thruster.config import ThrusterConfig
from detectors.thruster.evidence import NEWEST, REACH
from detectors.thruster.history import COMMAND, ROWS, SPEED, TRUSTED, History
from detectors.thruster.identification import learn, learnt_range
from detectors.thruster.judgement import Judgement
from detectors.thruster.learnt import LearntCurve, curve_of_model
from detectors.thruster.model import NEAR_NEUTRAL, ThrusterModel
from detectors.thruster.sample import FaultKind
from detectors.thruster.schedule import Schedule
from detectors.thruster.search import search_named
from detectors.thruster.statement import KIND, kinds, levels, with_wear
from detectors.thruster.tracking import SPEED_MIN, Track, Tracker
from detectors.thruster.wear import CommissionedCurve, commission, wear, wider
from detectors.thruster.window import window_of
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

HELD_BACK = 20  # newest samples that are not learnt from: a fault that is just being found is not learnt
BLOCK = 256  # samples that are judged at once at most
BEFORE_FOUND = 60  # samples before a fault was found that may belong to it
MATURE = 2  # warm-ups before a curve is taken for the commissioned one
SAME = 0.03  # of a learnt command: one that is not farther outside is not new
RELAX = 0.97  # the memory of the largest healthy statistic fades by this at each learning

Commands = tuple[tuple[float, float], tuple[float, float]]  # least and greatest that are learnt, ahead and astern


class AdaptiveMethod:
    """Judges samples with a model that is learnt anew at intervals, for as long as the thruster is healthy.

    Args:
        config: settings; `dynamics` is taken as True.
        commissioned: curve to measure wear against; None for the first one that is learnt.
    """

    def __init__(self, config: ThrusterConfig, commissioned: CommissionedCurve | None = None) -> None:
        window_min, window_max, _ = config.spans
        self._config, self._window_max = config, window_max
        self._schedule = Schedule(config)
        self._search = search_named(
            config.search, order_max=config.order_max, window_min=window_min, window_max=window_max, seed=config.seed
        )
        self._history = History(ROWS, window_max + HELD_BACK + config.delay_max + REACH + 2 * BLOCK)
        self.commissioned = commissioned
        self.model: ThrusterModel | None = None
        self.period_s = nan
        self._tracker: Tracker | None = None
        self._learnt: Commands | None = None  # at the last learning
        self._learn_from = 0  # samples before this number belong to another state of the thruster
        self._over = 0  # successive samples over the threshold so far
        self._score = 0.0
        self._fault: Fault | None = None
        self._gain_error = 0.0
        self._largest = np.zeros((3, len(NEWEST)))  # statistic of healthy samples: so far, last interval, this one
        self._wear = nan

    @property
    def learnt(self) -> LearntCurve | None:
        """The present steady curve; None while there is no model."""
        return None if self.model is None else curve_of_model(self.model)

    def judge(self, block: FloatArray) -> Iterator[Judgement]:
        """As `Method.judge`."""
        start = 0
        while start < block.shape[1]:
            refitted = self._learn_if_due()
            stop = min(block.shape[1], start + self._until_due())
            step = self._judge_part(block[:, start:stop])
            yield replace(step, refitted=refitted)
            start += len(step)

    def accept(self) -> None:
        """Take the thruster as it is now for healthy: its curve becomes the commissioned one, a fault is over."""
        if self.model is None:
            return
        response = self.model.response
        scaled = replace(response, coefficients=response.coefficients * (1.0 + self._gain_error))
        self.model = replace(self.model, response=scaled)
        if self._fault is not None:
            self._learn_from = self._history.end
            self._history.row(TRUSTED, self._history.first, self._history.end)[:] = 0.0
            self._schedule.begin_anew(self._history.end)
        self.commissioned, self._wear = commission(self.model) or self.commissioned, 0.0
        self._schedule.saw_news()
        self._end_fault(healthy=0)

    def begin_dive(self) -> None:
        """Judge with what was learnt so far, until the samples that come now are enough to learn from by themselves.

        How restlessly a thruster is driven shows in its noise: by a lively dive, a calm one is judged too coarsely.
        """
        if self.model is None:
            return
        self._learn_from = self._history.end
        self._schedule.begin_anew(self._history.end)
        self._largest[:] = 0.0

    def _until_due(self) -> int:
        room = BLOCK if self._tracker is None else min(BLOCK, self._tracker.room)
        return max(1, min(room, self._schedule.due - self._history.end))

    def _learn_if_due(self) -> bool:
        learnt = self._history.end >= self._schedule.due and not self._wait() and self._learn()
        if self._tracker is not None and not self._tracker.room:
            self._track_anew()
        return learnt

    def _wait(self) -> bool:
        """Whether this is no time to learn, or there is nothing to learn: the model knows what is driven, no more."""
        now, schedule = self._history.end, self._schedule
        if schedule.postpone(now, self._fault is not None, self._score):
            return True
        if self.model is None or not schedule.may_idle(now, self._gain_error) or not self._drives_the_same():
            return False
        schedule.stay_idle(now)
        return True

    def _drives_the_same(self) -> bool:
        """Whether a model of as many samples would know the same commands now, ahead and astern."""
        assert self.model is not None and self._learnt is not None  # noqa: S101
        stop = self._history.end - HELD_BACK
        start = max(self._history.first, self._learn_from, stop - self.model.window)
        trusted = self._history.row(TRUSTED, start, stop) > 0.0
        command = self._history.row(COMMAND, start, stop)[trusted] - self.model.basis.neutral
        return _same_commands((learnt_range(command), learnt_range(-command)), self._learnt, self.model)

    def _learn(self) -> bool:
        now = self._history.end
        stop = now if self.model is None else now - HELD_BACK
        start = max(self._history.first, self._learn_from, stop - self._window_max)
        window, self.period_s = window_of(self._history, start, stop, self._config.delay_max)
        model = learn(window, self._config, self._search, self.model)
        if model is None:
            self._schedule.try_again(now)
            return False
        self._schedule.learnt(now)
        self.model = self._confirmed(model)
        self._largest[0] = np.maximum(self._largest[0] * RELAX, self._largest[1])
        self._largest[1], self._largest[2] = self._largest[2], 0.0
        if now >= MATURE * self._config.spans[2] and (
            self.commissioned is None or wider(self.model, self.commissioned)
        ):
            self.commissioned = commission(self.model, self.commissioned)
        self._wear = nan if self.commissioned is None else wear(self.model, self.commissioned)
        self._track_anew()
        return True

    def _confirmed(self, model: ThrusterModel) -> ThrusterModel:
        """The model, knowing only commands that were learnt the last time as well: at first it may be a transient.

        Where there are new ones, the next learning comes soon.
        """
        learnt = (model.learnt_ahead, model.learnt_astern)
        before, self._learnt = self._learnt or learnt, learnt
        ahead, astern = ((max(a[0], b[0]), min(a[1], b[1])) for a, b in zip(before, learnt, strict=True))
        now, confirmed = self._history.end, (ahead, astern)
        young = self._schedule.is_young(now)
        if confirmed != learnt and (young or not _same_commands(confirmed, learnt, model)):
            self._schedule.confirm(now)
        return replace(model, learnt_ahead=ahead, learnt_astern=astern)

    def _track_anew(self) -> None:
        assert self.model is not None  # noqa: S101
        self._tracker = Tracker(self.model, self._history, self.period_s, capacity=2 * BLOCK)

    def _judge_part(self, block: FloatArray) -> Judgement:
        """Judge as many of these samples as there are until a fault begins or ends."""
        samples = block.shape[1]
        self._history.append(np.concatenate([block, np.ones((1, samples))]))
        if self._tracker is None or self.model is None:
            return self._still_learning(samples)
        checkpoint = self._tracker.checkpoint()
        track = self._tracker.advance(samples)
        assessment = self._assess(track)
        if assessment.event is not None and assessment.event + 1 < samples:
            samples = assessment.event + 1
            self._tracker.back_to(checkpoint)
            self._history.drop_newest(block.shape[1] - samples)
            track = self._tracker.advance(samples)
            assessment = self._assess(track)
        return self._commit(track, assessment)

    def _still_learning(self, samples: int) -> Judgement:
        blank = np.full(samples, nan)
        level, score = np.full(samples, int(Level.UNKNOWN)), np.zeros(samples)
        kind, reason = np.full(samples, FaultKind.NONE, dtype=KIND), np.full(samples, "learning")
        return Judgement(level, score, blank, blank, blank, kind, reason, 0, 0, 0, 0.0, False, self._wear)

    def _assess(self, track: Track) -> Assessment:
        if self._fault is not None:
            return follow(track, self._fault)
        fixed = self._config.threshold_rpm is not None
        return watch(track, self._thresholds(track), slice(FAST, FAST + 1) if fixed else slice(None), self._over)

    def _thresholds(self, track: Track) -> FloatArray:
        assert self.model is not None  # noqa: S101
        return thresholds(track, self.model, self._config, self._largest[0])

    def _commit(self, track: Track, assessment: Assessment) -> Judgement:
        """Say what was found, and take it over into the state."""
        faulty = np.full(len(assessment.score), self._fault is not None)
        if assessment.event is not None:
            faulty[-1] = not faulty[-1]
        judgement = self._say(track, assessment, faulty)
        if self._fault is None:
            self._remember(track, assessment)
        else:
            self._gain_error = float(track.gain.newest[SLOW, -1] - self._fault.reference)
            self._fault = self._fault.after(track, FaultKind(judgement.kind[-1]) or self._fault.kind)
        if assessment.event is not None and faulty[-1]:
            self._begin_fault(track, assessment, FaultKind(judgement.kind[-1]))
        elif assessment.event is not None:
            self._end_fault(healthy=RECOVER)
        return judgement

    def _remember(self, track: Track, assessment: Assessment) -> None:
        if track.unknown.any():
            self._schedule.saw_news()
        self._score = float(assessment.score[-1])
        self._over = run_length(assessment.score >= 1.0, self._over)
        statistic = np.abs(track.gain.change) / track.gain.deviation
        self._largest[2] = np.maximum(self._largest[2], statistic.max(axis=1))
        self._gain_error = float(track.gain.reference[FAST, -1])

    def _begin_fault(self, track: Track, assessment: Assessment, kind: FaultKind) -> None:
        bound = np.minimum(self._thresholds(track)[:, -1], abs(float(assessment.change[-1])))
        scale = int(np.argmax(np.abs(track.gain.change[:, -1]) / bound))
        since = self._history.end - BEFORE_FOUND
        self._fault = Fault(since, float(track.gain.reference[scale, -1]), bound, kind=kind)
        self._gain_error = float(track.gain.newest[scale, -1])
        self._over, self._score = 0, 0.0
        self._largest[2] = 0.0

    def _end_fault(self, healthy: int) -> None:
        """Watch again, and never learn from the fault: from all of it but the newest, `healthy` samples."""
        if self._fault is not None:
            since = max(self._fault.since, self._history.first)
            self._history.row(TRUSTED, since, max(since, self._history.end - healthy))[:] = 0.0
        self._fault, self._over, self._score = None, 0, 0.0
        self._largest[1:] = 0.0
        self._track_anew()

    def _say(self, track: Track, assessment: Assessment, faulty: NDArray[np.bool_]) -> Judgement:
        assert self.model is not None  # noqa: S101
        top_rpm, samples = self.model.top_rpm, len(faulty)
        history = self._history
        predicted = track.predicted * (1.0 + assessment.reference)
        predicted_rpm = (np.abs(predicted) if self.model.unsigned else predicted) * top_rpm
        speed_rpm = history.row(SPEED, history.end - samples, history.end)
        threshold_rpm = assessment.bound * np.maximum(np.abs(track.predicted), SPEED_MIN) * top_rpm
        level, reason = levels(track, assessment, faulty, self._wear, self._config)
        fast = kinds(track, assessment, faulty, self._fault, self.model, history)
        kind = with_wear(fast, level, self._wear, self._config)
        return Judgement(
            level=level,
            score=assessment.score,
            residual_rpm=speed_rpm - predicted_rpm,
            predicted_rpm=predicted_rpm,
            threshold_rpm=threshold_rpm,
            kind=kind,
            reason=reason,
            order=self.model.order,
            window=self.model.window,
            delay=self.model.response.delay,
            lag_s=self.model.response.lag * self.period_s,
            refitted=False,
            wear=self._wear,
        )


def _same_commands(some: Commands, others: Commands, model: ThrusterModel) -> bool:
    """Whether these are the same commands: a little more or less is not worth learning for."""
    near = NEAR_NEUTRAL * model.basis.scale
    one, other = (np.array([(max(low, near), high) for low, high in commands]) for commands in (some, others))
    return np.allclose(one, other, rtol=SAME, atol=0.0)

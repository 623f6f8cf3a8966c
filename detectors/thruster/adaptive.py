"""The default method: learn the thruster all the time, and call a fast, lasting change of its gain a fault."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.config import ThrusterConfig
from detectors.thruster.evidence import CHANGE_MIN, DEVIATIONS, HEADROOM, NEWEST, REACH
from detectors.thruster.history import History
from detectors.thruster.identification import learn
from detectors.thruster.judgement import Judgement
from detectors.thruster.kind import FROZEN_SAMPLES, fault_kind
from detectors.thruster.model import ThrusterModel
from detectors.thruster.sample import FaultKind
from detectors.thruster.search import search_named
from detectors.thruster.tracking import (
    COMMAND,
    CURRENT,
    GAP_PERIODS,
    ROWS,
    SPEED,
    SPEED_MIN,
    SPIKE,
    TIME,
    TRUSTED,
    VOLTAGE,
    Track,
    Tracker,
)
from detectors.thruster.wear import CommissionedCurve, commission, wear, wider
from detectors.thruster.window import RUN_IN, Window
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

HELD_BACK = 20  # newest samples that are not learnt from: a fault that is just being found is not learnt
BLOCK = 256  # samples that are judged at once at most
CONFIRM = 2  # successive samples over the threshold that are a fault
BEFORE_FOUND = 60  # samples before a fault was found that may belong to it
RECOVER = 50  # successive samples back at the old gain that end a fault
RECOVER_SHARE = 0.35  # of the fault's size within which a gain counts as the old one
CLEAR_SHARE = 0.7  # of the fault's size from which on its kind is judged anew
CALM = 0.8  # the model is not learnt anew while the score is above this ...
POSTPONE, POSTPONE_MAX = 25, 8  # ... but this many samples later, so many times at most
MATURE = 2  # warm-ups before a curve is taken for the commissioned one
BLIND = 0.5  # relative change of speed: where the threshold is above, nothing can be said
AT_WORK = 0.15  # of the top speed
STAGGER = 17  # samples
RETRY = 50  # samples to the next attempt to learn when there was too little to learn from
RELAX = 0.97  # the memory of the largest healthy statistic fades by this at each learning
FAST, SLOW = 1, 3  # scales (8 and 50 samples) that judge whether a fault is still there; the first one is shown


@dataclass(frozen=True, slots=True, eq=False)
class _Fault:
    """A fault that lasts: the healthy gain that it is measured against, and its size so far."""

    since: int  # number of the first sample that may belong to it
    reference: float  # healthy mean gain error
    bound: FloatArray  # (5,) threshold on each scale when it was found
    size: float  # largest change seen on the slow scale
    kind: FaultKind = FaultKind.NONE
    recovered: int = 0  # successive samples back at the old gain


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """N samples against the thresholds."""

    score: FloatArray  # (N,)
    change: FloatArray  # (N,) gain error on the scale that says most
    reference: FloatArray  # (N,) gain error that counts as healthy
    bound: FloatArray  # (N,) threshold of the change on the scale that is shown
    event: int | None  # first sample at which a fault begins or ends


class AdaptiveMethod:
    """Judges samples with a model that is learnt anew at intervals, for as long as the thruster is healthy.

    Args:
        config: settings; `dynamics` is taken as True.
        commissioned: curve to measure wear against; None for the first one that is learnt.
    """

    def __init__(self, config: ThrusterConfig, commissioned: CommissionedCurve | None = None) -> None:
        window_min, window_max, warmup = config.spans
        self._config, self._window_max = config, window_max
        self._search = search_named(
            config.search, order_max=config.order_max, window_min=window_min, window_max=window_max, seed=config.seed
        )
        self._history = History(ROWS, window_max + HELD_BACK + config.delay_max + REACH + 2 * BLOCK)
        self.commissioned = commissioned
        self.model: ThrusterModel | None = None
        self.period_s = nan
        self._tracker: Tracker | None = None
        self._due, self._postponed = warmup, 0
        self._learn_from = 0  # samples before this number belong to another state of the thruster
        self._over = 0  # successive samples over the threshold so far
        self._score = 0.0
        self._fault: _Fault | None = None
        self._gain_error = 0.0
        self._largest = np.zeros((3, len(NEWEST)))  # statistic of healthy samples: so far, last interval, this one
        self._wear = nan

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
            self._due = self._history.end + self._config.spans[2]
        self.commissioned, self._wear = commission(self.model) or self.commissioned, 0.0
        self._end_fault(healthy=0)

    # ---------------------------------------------------------------------------------------------- learning

    def _until_due(self) -> int:
        room = BLOCK if self._tracker is None else min(BLOCK, self._tracker.room)
        return max(1, min(room, self._due - self._history.end))

    def _learn_if_due(self) -> bool:
        learnt = self._history.end >= self._due and not self._postpone() and self._learn()
        if self._tracker is not None and not self._tracker.room:
            self._track_anew()
        return learnt

    def _postpone(self) -> bool:
        """Whether this is no time to learn: a fault lasts, or may be about to be found."""
        suspicious = self._score > CALM and self._postponed < POSTPONE_MAX
        if self._fault is None and not suspicious:
            self._postponed = 0
            return False
        self._postponed += 1
        self._due = self._history.end + POSTPONE
        return True

    def _learn(self) -> bool:
        now = self._history.end
        model = learn(self._window(now), self._config, self._search)
        if model is None:
            self._due = now + RETRY
            return False
        self.model, self._due = model, now + self._interval(now)
        self._largest[0] = np.maximum(self._largest[0] * RELAX, self._largest[1])
        self._largest[1], self._largest[2] = self._largest[2], 0.0
        if now >= MATURE * self._config.spans[2] and (self.commissioned is None or wider(model, self.commissioned)):
            self.commissioned = commission(model, self.commissioned)
        self._wear = nan if self.commissioned is None else wear(model, self.commissioned)
        self._track_anew()
        return True

    def _interval(self, now: int) -> int:
        """Samples to the next learning; a little longer by the seed, for not all thrusters to learn at once."""
        return int(np.clip(now // 10, 50, 300)) + self._config.seed % STAGGER

    def _window(self, now: int) -> Window:
        """The newest samples to learn from. Those just after a gap in time are only passed through."""
        stop = now if self.model is None else now - HELD_BACK
        start = max(self._history.first, self._learn_from, stop - self._window_max)
        time_s = self._history.row(TIME, start, stop)
        steps = np.diff(time_s, prepend=time_s[0])
        self.period_s = float(np.median(steps[1:]))
        trusted = self._history.row(TRUSTED, start, stop) > 0.0
        for gap in np.flatnonzero(steps > GAP_PERIODS * self.period_s):
            trusted[gap : gap + RUN_IN // 2] = False
        trusted &= ~_spikes(self._history.row(SPEED, start, stop))
        lead = self._config.delay_max
        return Window(
            command=self._history.row(COMMAND, start - lead, stop).copy(),
            speed_rpm=self._history.row(SPEED, start, stop).copy(),
            trusted=trusted,
            voltage_v=self._history.row(VOLTAGE, start, stop).copy(),
            current_a=self._history.row(CURRENT, start, stop).copy(),
        )

    def _track_anew(self) -> None:
        assert self.model is not None  # noqa: S101
        self._tracker = Tracker(self.model, self._history, self.period_s, capacity=2 * BLOCK)

    # ---------------------------------------------------------------------------------------------- judging

    def _judge_part(self, block: FloatArray) -> Judgement:
        """Judge as many of these samples as there are until a fault begins or ends."""
        samples = block.shape[1]
        self._history.append(np.concatenate([block, np.ones((1, samples))]))
        if self._tracker is None or self.model is None:
            return self._still_learning(samples)
        checkpoint = self._tracker.checkpoint()
        track = self._tracker.advance(samples)
        judged = self._judge(track)
        if judged.event is not None and judged.event + 1 < samples:
            samples = judged.event + 1
            self._tracker.back_to(checkpoint)
            self._history.drop_newest(block.shape[1] - samples)
            track = self._tracker.advance(samples)
            judged = self._judge(track)
        return self._commit(track, judged)

    def _still_learning(self, samples: int) -> Judgement:
        blank = np.full(samples, nan)
        level, score = np.full(samples, int(Level.UNKNOWN)), np.zeros(samples)
        kind, reason = [FaultKind.NONE] * samples, ["learning"] * samples
        return Judgement(level, score, blank, blank, blank, kind, reason, 0, 0, 0, 0.0, False, self._wear)

    def _judge(self, track: Track) -> _Judged:
        return self._watch(track) if self._fault is None else self._follow(track, self._fault)

    def _watch(self, track: Track) -> _Judged:
        """No fault yet: one begins when the score stays over 1."""
        gain = track.gain
        bound = self._bound(track)
        ratio = np.abs(gain.change) / bound
        if self._config.threshold_rpm is not None:
            ratio = ratio[FAST : FAST + 1]
        score = ratio.max(axis=0)
        most = ratio.argmax(axis=0) if len(ratio) > 1 else np.full(len(score), FAST)
        change = np.take_along_axis(gain.change, most[None, :], axis=0)[0]
        event = _first_run(score >= 1.0, CONFIRM, self._over)
        return _Judged(score, change, gain.reference[FAST], bound[FAST], event)

    def _bound(self, track: Track) -> FloatArray:
        """(5, N) relative change that is a fault, on each scale."""
        gain = track.gain
        divisor = np.maximum(np.abs(track.predicted), SPEED_MIN)
        assert self.model is not None  # noqa: S101
        if self._config.threshold_rpm is not None:
            fixed = self._config.threshold_rpm / self.model.top_rpm / divisor
            return np.broadcast_to(fixed, gain.change.shape)
        deviations = np.maximum(DEVIATIONS, HEADROOM * self._largest[0])[:, None]
        resolution = self.model.resolution_rpm / self.model.top_rpm / divisor
        return np.asarray(np.maximum(np.maximum(CHANGE_MIN[:, None], deviations * gain.deviation), resolution))

    def _follow(self, track: Track, fault: _Fault) -> _Judged:
        """A fault lasts until the gain has been back for a while."""
        fast, slow = (track.gain.newest[scale] - fault.reference for scale in (FAST, SLOW))
        score = np.maximum(np.abs(fast) / fault.bound[FAST], np.abs(slow) / fault.bound[SLOW])
        event = _first_run(self._is_back(track, fault), RECOVER, fault.recovered)
        whole = np.full(len(score), fault.reference)
        return _Judged(score, fast, whole, np.full(len(score), fault.bound[FAST]), event)

    @staticmethod
    def _size(track: Track, fault: _Fault) -> FloatArray:
        """(N,) largest change of gain since the fault began, on the slow scale."""
        slow = np.abs(track.gain.newest[SLOW] - fault.reference)
        return np.asarray(np.maximum(np.maximum.accumulate(slow), fault.size))

    def _is_back(self, track: Track, fault: _Fault) -> NDArray[np.bool_]:
        """(N,) whether the gain is surely nearer to the healthy one than to the fault's."""
        newest, doubt = track.gain.newest - fault.reference, track.gain.newest_deviation
        near = np.maximum(0.5 * fault.bound[SLOW], RECOVER_SHARE * self._size(track, fault))
        back = np.abs(newest[SLOW]) + doubt[SLOW] < near
        back &= np.abs(newest[FAST]) < np.maximum(fault.bound[FAST], near)
        return np.asarray(back & ~track.unknown)

    # ---------------------------------------------------------------------------------------------- committing

    def _commit(self, track: Track, judged: _Judged) -> Judgement:
        """Take the judgement over into the state, and say it."""
        faulty = np.full(len(judged.score), self._fault is not None)
        if self._fault is None:
            self._remember(track, judged)
        else:
            self._fault = self._fault_now(track, self._fault)
        if judged.event is not None:
            faulty[-1] = not faulty[-1]
        step = self._say(track, judged, faulty)
        if judged.event is not None and faulty[-1]:
            self._begin_fault(track, judged, step.kind[-1])
        elif judged.event is not None:
            self._end_fault(healthy=RECOVER)
        return step

    def _remember(self, track: Track, judged: _Judged) -> None:
        self._score = float(judged.score[-1])
        self._over = _run_length(judged.score >= 1.0, self._over)
        statistic = np.abs(track.gain.change) / track.gain.deviation
        self._largest[2] = np.maximum(self._largest[2], statistic.max(axis=1))
        self._gain_error = float(track.gain.reference[FAST, -1])

    def _fault_now(self, track: Track, fault: _Fault) -> _Fault:
        self._gain_error = float(track.gain.newest[SLOW, -1] - fault.reference)
        recovered = _run_length(self._is_back(track, fault), fault.recovered)
        return replace(fault, size=float(self._size(track, fault)[-1]), recovered=recovered)

    def _begin_fault(self, track: Track, judged: _Judged, kind: FaultKind) -> None:
        bound = np.minimum(self._bound(track)[:, -1], abs(float(judged.change[-1])))
        scale = int(np.argmax(np.abs(track.gain.change[:, -1]) / bound))
        since = self._history.end - BEFORE_FOUND
        self._fault = _Fault(since, float(track.gain.reference[scale, -1]), bound, size=0.0, kind=kind)
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

    def _say(self, track: Track, judged: _Judged, faulty: NDArray[np.bool_]) -> Judgement:
        assert self.model is not None  # noqa: S101
        top_rpm, samples = self.model.top_rpm, len(faulty)
        history = self._history
        predicted = track.predicted * (1.0 + judged.reference)
        predicted_rpm = (np.abs(predicted) if self.model.unsigned else predicted) * top_rpm
        speed_rpm = history.row(SPEED, history.end - samples, history.end)
        threshold_rpm = judged.bound * np.maximum(np.abs(track.predicted), SPEED_MIN) * top_rpm
        level, reason = self._levels(track, judged, faulty)
        kind = self._kinds(track, judged, faulty, level)
        return Judgement(
            level=level,
            score=judged.score,
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

    def _levels(
        self, track: Track, judged: _Judged, faulty: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int64], list[str]]:
        """Level of each sample, and why."""
        worn = abs(self._wear) if isfinite(self._wear) else 0.0
        rows = (
            (faulty, Level.FAULT, "speed has changed"),
            (np.full(len(faulty), worn > self._config.wear_max), Level.FAULT, "drifted from the commissioned curve"),
            (judged.score >= 1.0, Level.SUSPECT, "speed is off"),
            (
                np.full(len(faulty), worn > self._config.wear_suspect),
                Level.SUSPECT,
                "drifts from the commissioned curve",
            ),
            (track.unknown, Level.UNKNOWN, "command not learnt yet"),
            (self._blind(track, judged), Level.UNKNOWN, "driven too restlessly to judge"),
        )
        conditions = [row[0] for row in rows]
        level = np.select(conditions, [int(row[1]) for row in rows], int(Level.NORMAL))
        which = np.select(conditions, range(len(rows)), len(rows))
        reasons = [*(row[2] for row in rows), ""]
        return level, [reasons[index] for index in which]

    @staticmethod
    def _blind(track: Track, judged: _Judged) -> NDArray[np.bool_]:
        """(N,) whether even a large change of speed would not show now, though the thruster is at work."""
        return np.asarray((judged.bound > BLIND) & (np.abs(track.predicted) > AT_WORK))

    def _kinds(
        self, track: Track, judged: _Judged, faulty: NDArray[np.bool_], level: NDArray[np.int64]
    ) -> list[FaultKind]:
        """Kind of each sample. A fault keeps its kind unless it shows nearly as large as ever."""
        kept, size = FaultKind.NONE, np.zeros(len(level))
        if self._fault is not None:
            kept, size = self._fault.kind, self._size(track, self._fault)
        clear = np.abs(judged.change) >= np.maximum(judged.bound, CLEAR_SHARE * size)
        clear &= np.isfinite(track.gain.newest_deviation[FAST])
        kinds = []
        for number, (at_fault, item, sure) in enumerate(zip(faulty, level, clear, strict=True)):
            stuck = kept is FaultKind.SENSOR and self._reading_stands(len(level) - number - 1)
            if at_fault and not stuck and (sure or not kept):
                kept = self._kind(len(level) - number - 1, float(judged.change[number]))
            kinds.append(kept if at_fault else self._worn(item))
        if self._fault is not None:
            self._fault = replace(self._fault, kind=kept)
        return kinds

    def _reading_stands(self, ago: int) -> bool:
        """Whether the speed this many samples ago is to the last bit the one before it."""
        stop = self._history.end - ago
        before, now = self._history.row(SPEED, stop - 2, stop).tolist()
        return bool(before == now)

    def _worn(self, level: int) -> FaultKind:
        worn = isfinite(self._wear) and abs(self._wear) > self._config.wear_suspect
        return FaultKind.WORN if worn and level >= Level.SUSPECT else FaultKind.NONE

    def _kind(self, ago: int, change: float) -> FaultKind:
        """Kind of fault at the sample that was the newest this many samples ago."""
        assert self.model is not None  # noqa: S101
        stop = self._history.end - ago
        start, delay = stop - FROZEN_SAMPLES, self.model.response.delay
        return fault_kind(
            self.model,
            change,
            self._history.row(SPEED, start, stop),
            self._history.row(COMMAND, start - delay, stop - delay),
            self._history.row(CURRENT, start, stop),
        )


def _spikes(speed_rpm: FloatArray) -> NDArray[np.bool_]:
    """(N,) single readings far off both neighbours; a step of the speed is none."""
    line = np.concatenate([speed_rpm[:1], speed_rpm, speed_rpm[-1:]])
    middle = np.sort(np.stack([line[:-2], line[1:-1], line[2:]]), axis=0)[1]
    return np.asarray(np.abs(speed_rpm - middle) > SPIKE * np.quantile(np.abs(middle), 0.995))


def _first_run(condition: NDArray[np.bool_], length: int, so_far: int) -> int | None:
    """First index at which the condition has held `length` times in a row, `so_far` of them before the first."""
    if not condition.any():
        return None
    for index, holds in enumerate(condition.tolist()):
        so_far = so_far + 1 if holds else 0
        if so_far >= length:
            return index
    return None


def _run_length(condition: NDArray[np.bool_], so_far: int) -> int:
    """How many of the newest have held in a row, `so_far` before the first."""
    broken = np.flatnonzero(~condition)
    return len(condition) - 1 - int(broken[-1]) if len(broken) else so_far + len(condition)

"""A learnt model run along the samples: prediction, gain error, and how much each sample can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.curve import combine
from detectors.thruster.evidence import REACH, UNCERTAINTY, GainChange, RunningSums
from detectors.thruster.fading import FadingMaximum
from detectors.thruster.history import COMMAND, SPEED, TIME, TRUSTED, VOLTAGE, History
from detectors.thruster.lag import follow_gain, followed
from detectors.thruster.model import ThrusterModel
from detectors.thruster.noise import low_speed_error, settling_decay
from detectors.thruster.window import GAP_PERIODS, SPIKE

FloatArray = NDArray[np.float64]

SPEED_MIN = 0.08  # of the top speed: errors of slower speeds are taken relative to this one
NEVER = -(2**60)  # number of no sample
RUN_IN = 60  # samples before the first that counts, for the lag's state to settle


@dataclass(frozen=True, slots=True)
class _Carry:
    """What the recursions hand from one sample to the next."""

    speeds: tuple[float, ...]  # of the best response and of the alternatives
    unsettled: FadingMaximum  # error still expected of the transients so far, top speeds
    unlearnt: int  # number of the last sample whose command was not learnt
    errors: tuple[float, float]  # relative errors of the last two samples
    time_s: float
    pending: _Seen | None  # the newest sample, weighed when the next command is known


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """N samples before they are weighed: (N,) each."""

    predicted: FloatArray
    target: FloatArray
    command: FloatArray
    columns: FloatArray  # (K + 1, N)
    error: FloatArray
    unsettled: FloatArray
    unknown: NDArray[np.bool_]
    trusted: FloatArray

    def part(self, where: slice) -> _Seen:
        return _Seen(*(getattr(self, name)[..., where] for name in self.__slots__))

    def after(self, before: _Seen | None) -> _Seen:
        """These samples behind those."""
        if before is None:
            return self
        both = ((getattr(before, name), getattr(self, name)) for name in self.__slots__)
        return _Seen(*(np.concatenate(pair, axis=-1) for pair in both))


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """N samples seen through the model: (N,) each.

    Attributes:
        predicted: speed that the model gives, top speeds, signed.
        unknown: whether the command, or one that still shows, was not learnt.
        gain: the test for a change of gain.
    """

    predicted: FloatArray
    unknown: NDArray[np.bool_]
    gain: GainChange


class Tracker:
    """Runs a model along a history; blocks of any length give the same result.

    Args:
        model: the model.
        history: the samples; the tracker starts in its past, so that the test has its reference.
        period_s: sampling period.
        capacity: samples that may follow before a new tracker is needed.
    """

    def __init__(self, model: ThrusterModel, history: History, period_s: float, capacity: int) -> None:
        self.model, self._history, self._period_s = model, history, period_s
        self._responses = (model.response, *model.alternatives)
        self._follow = [follow_gain(response.lag) for response in self._responses]
        self._settling = settling_decay(model.response.lag)
        self._reach = max(response.delay for response in self._responses)
        self._linger = self._reach + int(3.0 * model.response.lag) + 4
        self._sums = RunningSums(UNCERTAINTY + len(model.whitener), REACH + RUN_IN + capacity)
        start = max(history.first + self._reach, history.end - REACH - RUN_IN)
        self._next = start
        self._carry = self._at_rest(start)
        self._take_in(history.end - start, run_in=RUN_IN)

    @property
    def room(self) -> int:
        """Samples that may still follow."""
        return self._sums.room

    def advance(self, samples: int) -> Track:
        """Go on over the next samples of the history."""
        seen = self._take_in(samples)
        gain = self._sums.test(samples, self.model.basis.scale, self.model.correlation)
        return Track(seen.predicted, seen.unknown, gain)

    def _take_in(self, samples: int, run_in: int = 0) -> _Seen:
        """See and sum up the next samples; the first `run_in` of them count for nothing."""
        seen, carry = self._see(samples)
        lined_up = seen.after(self._carry.pending)
        values = self._weigh(lined_up)
        values[:, :run_in] = 0.0
        self._sums.extend(values)
        self._carry = replace(carry, pending=lined_up.part(slice(-1, None)))
        self._next += samples
        return seen

    def checkpoint(self) -> tuple[_Carry, int]:
        """What `back_to` needs."""
        return self._carry, self._next

    def back_to(self, checkpoint: tuple[_Carry, int]) -> None:
        """Undo `advance`."""
        self._sums.forget(self._next - checkpoint[1])
        self._carry, self._next = checkpoint

    def _at_rest(self, start: int) -> _Carry:
        speeds = tuple(float(target[0]) for target in self._targets(start, start + 1)[0])
        time_s = float(self._history.row(TIME, start, start + 1)[0])
        settled, unlearnt = FadingMaximum(self._settling), self._last_unlearnt(start - self._reach, start, NEVER)
        last = int(unlearnt[-1]) if len(unlearnt) else NEVER
        return _Carry(speeds, settled, last, (0.0, 0.0), time_s, None)

    def _targets(self, start: int, stop: int) -> tuple[list[FloatArray], FloatArray, FloatArray]:
        """Steady speeds by each response; the best one's delayed command, and its columns."""
        model, supply = self.model, np.zeros(stop - start)
        if np.isfinite(model.supply_v):
            voltage = self._history.row(VOLTAGE, start, stop)
            supply = np.where(np.isfinite(voltage), voltage / model.supply_v - 1.0, 0.0)
        power = 1.0 + model.supply_exponent * supply
        reach = self._reach
        command = self._history.row(COMMAND, start - reach, stop)
        columns = model.basis.columns(command)
        targets = []
        for response in self._responses:
            delayed = slice(reach - response.delay, reach - response.delay + stop - start)
            targets.append(combine(response.coefficients[None, :], columns[:, delayed])[0] * power)
        best = slice(reach - model.response.delay, reach - model.response.delay + stop - start)
        with_supply = np.concatenate([columns[:, best] * power, (targets[0] * supply)[None, :]])
        return targets, command[best], with_supply

    def _see(self, samples: int) -> tuple[_Seen, _Carry]:
        """The next samples, and the carry after them."""
        start, stop = self._next, self._next + samples
        targets, command, columns = self._targets(start, stop)
        time_s = self._history.row(TIME, start, stop)
        predicted, unsettled, carry = self._recur(targets, time_s)
        unlearnt = self._last_unlearnt(start, stop, self._carry.unlearnt)
        unknown = np.arange(start, stop) - unlearnt < self._linger
        error, errors = self._despiked(self._relative_error(predicted, start, stop))
        trusted = self._history.row(TRUSTED, start, stop)
        seen = _Seen(predicted, targets[0], command, columns, error, unsettled, unknown, trusted)
        return seen, replace(carry, errors=errors, unlearnt=int(unlearnt[-1]))

    def _weigh(self, seen: _Seen) -> FloatArray:
        """(rows, N - 1) values for the running sums of all but the newest sample.

        A command may be stamped up to a sample later than the motor had it. So the step that the target is about to
        make is an error that the sample before it may already show.
        """
        now = seen.part(slice(None, -1))
        ahead = self.model.timing.at(np.abs(np.diff(seen.target)) * self._follow[0])
        size = np.abs(now.predicted)
        divisor = np.maximum(size, SPEED_MIN)
        low = low_speed_error(size)
        unsettled = np.maximum(now.unsettled, ahead)
        systematic = np.sqrt(unsettled * unsettled + low * low) / divisor
        noise = self.model.noise / divisor
        weight = np.where(now.unknown, 0.0, now.trusted) / (noise * noise + systematic * systematic)
        uncertainty = combine(self.model.whitener, now.columns / divisor)
        plain = [weight, weight * weight, weight * now.error, weight * now.command, weight * systematic]
        return np.concatenate([plain, weight * uncertainty])

    def _last_unlearnt(self, start: int, stop: int, before: int) -> NDArray[np.int_]:
        """(N,) number of the latest sample so far whose command was not learnt; `before`: until then."""
        known = self.model.knows(self._history.row(COMMAND, start, stop))
        return np.asarray(np.maximum.accumulate(np.where(known, before, np.arange(start, stop))))

    def _relative_error(self, predicted: FloatArray, start: int, stop: int) -> FloatArray:
        """Measured less predicted speed over the prediction, in the direction that is expected."""
        speed = self._history.row(SPEED, start, stop) / self.model.top_rpm
        along = np.where(predicted < 0.0, np.abs(speed) if self.model.unsigned else -speed, speed)
        return np.asarray((along - np.abs(predicted)) / np.maximum(np.abs(predicted), SPEED_MIN))

    def _despiked(self, error: FloatArray) -> tuple[FloatArray, tuple[float, float]]:
        """A single sample far off its neighbours becomes the median of three; a step passes one sample late."""
        line = np.concatenate([self._carry.errors, error])
        three = np.sort(np.stack([line[:-2], line[1:-1], line[2:]]), axis=0)
        clean = np.where(np.abs(error - three[1]) > SPIKE, three[1], error)
        return clean, (float(line[-2]), float(line[-1]))

    def _recur(self, targets: list[FloatArray], time_s: FloatArray) -> tuple[FloatArray, FloatArray, _Carry]:
        """The parts that go from sample to sample: lags, and the memory of transients. Both begin anew after gaps."""
        steps = time_s - np.concatenate([[self._carry.time_s], time_s[:-1]])
        gap = np.abs(steps) > GAP_PERIODS * self._period_s  # after a restart, another clock may be behind
        starts = np.flatnonzero(gap).tolist()
        speeds, unsettled, parts = self._carry.speeds, self._carry.unsettled, []
        for start, stop in pairwise(sorted({0, *starts, len(time_s)})):
            part = [target[start:stop] for target in targets]
            if start in starts:
                speeds, unsettled = tuple(float(one[0]) for one in part), FadingMaximum.after(self._settling, 1.0)
            ways = [followed(*one) for one in zip(part, speeds, self._follow, strict=True)]
            error, unsettled = unsettled.over(self._error(part[0], ways))
            speeds = tuple(float(way[-1]) for way in ways)
            parts.append((ways[0], error))
        predicted, unsettled_by = parts[0] if len(parts) == 1 else map(np.concatenate, zip(*parts, strict=True))
        carry = replace(self._carry, speeds=speeds, unsettled=unsettled, time_s=float(time_s[-1]))
        return predicted, unsettled_by, carry

    def _error(self, target: FloatArray, speeds: list[FloatArray]) -> FloatArray:
        """(N,) error of the best response on its way to the target: as learnt, or as the alternatives differ."""
        best, model = speeds[0], self.model
        distance = np.abs(target - best)
        faster = np.abs(target) >= np.abs(best)
        error = np.where(faster, model.spin_up.at(distance), model.spin_down.at(distance))
        for other in speeds[1:]:
            error = np.maximum(error, np.abs(other - best))
        return np.asarray(error)

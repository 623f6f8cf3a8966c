"""A learnt model run along the samples: prediction, gain error, and how much each sample can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from detectors.thruster.curve import combine
from detectors.thruster.evidence import REACH, UNCERTAINTY, GainChange, RunningSums
from detectors.thruster.history import COMMAND, SPEED, TIME, TRUSTED, VOLTAGE, History
from detectors.thruster.lag import follow_gain
from detectors.thruster.model import ThrusterModel
from detectors.thruster.noise import settling_decay
from detectors.thruster.window import GAP_PERIODS, SPIKE

FloatArray = NDArray[np.float64]

SPEED_MIN = 0.08  # of the top speed: errors of slower speeds are taken relative to this one
LOW_SPEED_ERROR = 0.04  # error of the curve, in top speeds, near standstill; it vanishes above about 0.2 of top speed
LOW_SPEED = 0.1
RUN_IN = 60  # samples before the first that counts, for the lag's state to settle


@dataclass(frozen=True, slots=True)
class _Carry:
    """What the recursions hand from one sample to the next."""

    speeds: tuple[float, ...]  # of the best response and of the alternatives
    unsettled: float  # error still expected of the transients so far, top speeds
    unknown_left: int  # samples for which an unlearnt command still shows
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
        self._decay = settling_decay(model.response.lag)
        self._linger = int(3.0 * model.response.lag) + 4
        self._sums = RunningSums(UNCERTAINTY + len(model.whitener), REACH + RUN_IN + capacity)
        reach = max(response.delay for response in self._responses)
        start = max(history.first + reach, history.end - REACH - RUN_IN)
        self._next = start
        self._carry = self._at_rest(start)
        self.advance(history.end - start, run_in=RUN_IN)

    @property
    def room(self) -> int:
        """Samples that may still follow."""
        return self._sums.room

    def advance(self, samples: int, run_in: int = 0) -> Track:
        """Go on over the next samples of the history. The first `run_in` of them count for nothing."""
        seen, carry = self._see(samples)
        lined_up = seen.after(self._carry.pending)
        values = self._weigh(lined_up)
        values[:, :run_in] = 0.0
        self._sums.extend(values)
        self._carry = replace(carry, pending=lined_up.part(slice(-1, None)))
        self._next += samples
        gain = self._sums.test(samples, self.model.basis.scale, self.model.correlation)
        return Track(seen.predicted, seen.unknown, gain)

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
        return _Carry(speeds, 0.0, 0, (0.0, 0.0), time_s, None)

    def _targets(self, start: int, stop: int) -> tuple[list[FloatArray], FloatArray, FloatArray]:
        """Steady speeds by each response; the best one's delayed command, and its columns."""
        model, supply = self.model, np.zeros(stop - start)
        if np.isfinite(model.supply_v):
            voltage = self._history.row(VOLTAGE, start, stop)
            supply = np.where(np.isfinite(voltage), voltage / model.supply_v - 1.0, 0.0)
        power = 1.0 + model.supply_exponent * supply
        targets, seen = [], []
        for response in self._responses:
            command = self._history.row(COMMAND, start - response.delay, stop - response.delay)
            columns = model.basis.columns(command)
            targets.append(combine(response.coefficients[None, :], columns)[0] * power)
            seen.append((command, columns))
        command, columns = seen[0]
        return targets, command, np.concatenate([columns * power, (targets[0] * supply)[None, :]])

    def _see(self, samples: int) -> tuple[_Seen, _Carry]:
        """The next samples, and the carry after them."""
        start, stop = self._next, self._next + samples
        targets, command, columns = self._targets(start, stop)
        time_s = self._history.row(TIME, start, stop)
        predicted, unsettled, unknown, carry = self._recur(targets, self._known(start, stop), time_s)
        error, errors = self._despiked(self._relative_error(predicted, start, stop))
        trusted = self._history.row(TRUSTED, start, stop)
        seen = _Seen(predicted, targets[0], command, columns, error, unsettled, unknown, trusted)
        return seen, replace(carry, errors=errors)

    def _weigh(self, seen: _Seen) -> FloatArray:
        """(rows, N - 1) values for the running sums of all but the newest sample.

        A command may be stamped up to a sample later than the motor had it. So the step that the target is about to
        make is an error that the sample before it may already show.
        """
        now = seen.part(slice(None, -1))
        ahead = self.model.timing.at(np.abs(np.diff(seen.target)) * self._follow[0])
        size = np.abs(now.predicted)
        divisor = np.maximum(size, SPEED_MIN)
        slowness = (size / LOW_SPEED) * (size / LOW_SPEED)
        low = LOW_SPEED_ERROR / (1.0 + slowness * slowness)
        unsettled = np.maximum(now.unsettled, ahead)
        systematic = np.sqrt(unsettled * unsettled + low * low) / divisor
        noise = self.model.noise / divisor
        weight = np.where(now.unknown, 0.0, now.trusted) / (noise * noise + systematic * systematic)
        uncertainty = combine(self.model.whitener, now.columns / divisor)
        plain = [weight, weight * weight, weight * now.error, weight * now.command, weight * systematic]
        return np.concatenate([plain, weight * uncertainty])

    def _known(self, start: int, stop: int) -> NDArray[np.bool_]:
        """Whether all commands that may show in each sample were learnt: from the newest to the most delayed."""
        delay = max(response.delay for response in self._responses)
        known = self.model.knows(self._history.row(COMMAND, start - delay, stop))
        return np.asarray(sliding_window_view(known, delay + 1).all(axis=1))

    def _relative_error(self, predicted: FloatArray, start: int, stop: int) -> FloatArray:
        """Measured less predicted speed over the prediction, in the direction that is expected."""
        speed = self._history.row(SPEED, start, stop) / self.model.top_rpm
        along = np.abs(speed) if self.model.unsigned else np.where(predicted < 0.0, -speed, speed)
        return np.asarray((along - np.abs(predicted)) / np.maximum(np.abs(predicted), SPEED_MIN))

    def _despiked(self, error: FloatArray) -> tuple[FloatArray, tuple[float, float]]:
        """A single sample far off its neighbours becomes the median of three; a step passes one sample late."""
        line = np.concatenate([self._carry.errors, error])
        three = np.sort(np.stack([line[:-2], line[1:-1], line[2:]]), axis=0)
        clean = np.where(np.abs(error - three[1]) > SPIKE, three[1], error)
        return clean, (float(line[-2]), float(line[-1]))

    def _recur(
        self, targets: list[FloatArray], known: NDArray[np.bool_], time_s: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], _Carry]:
        """The parts that go from sample to sample: lags, memory of transients, lingering of unlearnt commands."""
        carry, model = self._carry, self.model
        speeds, unsettled, left, last_s = list(carry.speeds), carry.unsettled, carry.unknown_left, carry.time_s
        gap_s = GAP_PERIODS * self._period_s
        out_speed, out_unsettled, out_unknown = [], [], []
        rows = zip(*(target.tolist() for target in targets), strict=True)
        for row, is_known, now_s in zip(rows, known.tolist(), time_s.tolist(), strict=True):
            if abs(now_s - last_s) > gap_s:  # after a restart, another clock may be behind
                speeds, unsettled = list(row), 1.0
            last_s = now_s
            speeds = [
                speed + gain * (goal - speed) for speed, gain, goal in zip(speeds, self._follow, row, strict=True)
            ]
            best = speeds[0]
            distance = abs(row[0] - best)
            error = model.spin_up if abs(row[0]) >= abs(best) else model.spin_down
            unseen = max(distance - error.seen, 0.0)
            off = error.share * (distance - unseen) + error.unseen_share * unseen
            for other in speeds[1:]:
                off = max(off, abs(other - best))
            unsettled = max(off, self._decay * unsettled)
            left = max(left - 1, 0) if is_known else self._linger
            out_speed.append(best)
            out_unsettled.append(unsettled)
            out_unknown.append(left > 0)
        after = _Carry(tuple(speeds), unsettled, left, carry.errors, last_s, carry.pending)
        return np.array(out_speed), np.array(out_unsettled), np.array(out_unknown), after

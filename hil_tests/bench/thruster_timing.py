"""The thruster detector's work done in two ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.delay import align, estimate_delay
from detectors.thruster.detector import ThrusterVerdicts
from detectors.thruster.fitness import Candidates
from detectors.thruster.identification import learn
from detectors.thruster.lag import follow_gain, lagged
from detectors.thruster.model import ThrusterModel
from detectors.thruster.polynomial import mape, speed_floor_rpm
from detectors.thruster.search import Choice, ExactSearch
from detectors.thruster.swarm import Dimension, MultiCentreSwarm, Optimum
from detectors.thruster.window import RUN_IN, Window
from hil_tests.bench.timing import Comparison
from hil_tests.random_runs import random_run

FloatArray = NDArray[np.float64]

# Paper 000: windows of 50 to 500; orders and delays it leaves open.
WINDOW_MIN, WINDOW_MAX, ORDER_MAX, DELAY_MAX = 50, 500, 5, 10
RECORDED = 1500  # samples that are judged at once and one by one
LEARNT = 2500  # samples of a full refit
FLAT = 1e-3  # relative difference of fitness that is none
DELAY, LAG = 4, 2.7  # samples, of the thruster that it is to find


def refit() -> Comparison:
    """Order and window of the paper's static model on the same samples, by the same fitness (equations 16 and 17).

    Ours tries the whole grid; the peer is the paper's swarm with a `numpy.polyfit` for every candidate that it meets.
    They agree where ours is at least as good.
    """
    command, speed_rpm = _swinging(WINDOW_MAX + DELAY_MAX)
    command, speed_rpm = align(command, speed_rpm, estimate_delay(command, speed_rpm, DELAY_MAX))
    return Comparison(
        work="order, window and fit",
        peer="swarm with numpy.polyfit",
        unit="refit",
        count=1,
        ours=lambda: _exact(command, speed_rpm),
        theirs=lambda: _swarm_with_polyfit(command, speed_rpm),
        agree=_not_worse,
    )


def full_refit() -> Comparison:
    """Delay, order, window and lag on the same samples, by the same fitness (equation 17, tested on all samples).

    Ours is the whole learning of the detector, uncertainty included. The peer is the paper's swarm over all four;
    each candidate is solved by least squares of the lagged powers, as `numpy.polyfit` solves plain ones.
    They agree where what ours found is as good to a thousandth, by the peer's own reckoning: the mean error is flat
    around its least, and while the swarm may end anywhere in there, ours is where the sum of squares is least.
    """
    config = ThrusterConfig()
    command, speed_rpm = _lagging(LEARNT, config.delay_max)
    unmeasured = np.full(LEARNT, np.nan)
    window = Window(command, speed_rpm, np.ones(LEARNT, dtype=bool), unmeasured, unmeasured)
    fitness = _LaggedPolynomial(command, speed_rpm)
    return Comparison(
        work="delay, order, window, lag",
        peer="swarm with lfilter, lstsq",
        unit="refit",
        count=1,
        ours=lambda: learn(window, config, ExactSearch()),
        theirs=lambda: _swarm_of_four(fitness, config),
        agree=lambda model, optimum: fitness(_four(model)) <= optimum.fitness * (1.0 + FLAT),
    )


def whole_run() -> Comparison:
    """A recording judged at once, and sample by sample."""
    run = random_run(0)
    series = [values[:RECORDED] for values in (run.time_s, run.command, run.speed_rpm)]
    samples = list(map(ThrusterSample, *(values.tolist() for values in series)))

    def one_by_one() -> list[ThrusterVerdict]:
        detector = ThrusterDetector()
        return [detector.update(sample) for sample in samples]

    return Comparison(
        work="ThrusterDetector.run",
        peer="update in a loop",
        unit="sample",
        count=len(samples),
        ours=lambda: ThrusterDetector().run(*series),
        theirs=one_by_one,
        agree=_same_levels,
    )


def _swinging(samples: int) -> tuple[FloatArray, FloatArray]:
    """A command that excites every order in every window, and the speed of a thruster three samples later."""
    phase = 2.0 * np.pi * np.arange(samples)
    command = 0.575 + 0.25 * np.sin(phase / 45.0) + 0.15 * np.sin(phase / 17.0)
    speed_rpm = 3000.0 * np.roll(command, 3) ** 0.8 + 5.0 * np.random.default_rng(0).standard_normal(samples)
    return command[3:], np.asarray(speed_rpm[3:])


def _lagging(samples: int, lead: int) -> tuple[FloatArray, FloatArray]:
    """Commands that hold and swing, `lead` of them ahead of the samples, and the speed of a thruster with a lag."""
    rng = np.random.default_rng(0)
    holds = np.repeat(rng.uniform(0.15, 1.0, samples // 50 + 2), 50)[: samples + lead]
    command = np.clip(holds + 0.1 * np.sin(2.0 * np.pi * np.arange(samples + lead) / 33.0), 0.1, 1.0)
    speed = lagged(np.roll(command, DELAY)[None, :] ** 0.8, LAG)[0]
    return command, 3000.0 * speed[lead:] + 9.0 * rng.standard_normal(samples)


class _LaggedPolynomial:
    """Fitness of delay, order, window and lag: a polynomial of the delayed command, then a first-order lag."""

    def __init__(self, command: FloatArray, speed_rpm: FloatArray) -> None:
        self._command, self._speed_rpm = command, speed_rpm
        self._floor_rpm = speed_floor_rpm(speed_rpm)

    def __call__(self, position: tuple[float, ...]) -> float:
        """Equation 17: the greater of the mean errors on the window and on all samples but those of the run-in."""
        delay, order, window = map(int, position[:3])
        powers = np.vander(self._command[: len(self._command) - delay], order + 1)
        share = follow_gain(position[3])
        lagged_powers = lfilter([share], [1.0, share - 1.0], powers, axis=0, zi=(1.0 - share) * powers[:1])[0]
        columns = lagged_powers[-len(self._speed_rpm) :]
        measured, seen = self._speed_rpm[RUN_IN:], columns[RUN_IN:]
        coefficients = np.linalg.lstsq(seen[-window:], measured[-window:], rcond=None)[0]
        predicted = seen @ coefficients
        on_window = mape(measured[-window:], predicted[-window:], self._floor_rpm)
        return max(on_window, mape(measured, predicted, self._floor_rpm))


def _swarm_of_four(fitness: _LaggedPolynomial, config: ThrusterConfig) -> Optimum:
    window_min, window_max, _ = config.spans
    dimensions = (
        Dimension(0, config.delay_max, integer=True),
        Dimension(1, config.order_max, integer=True),
        Dimension(window_min, min(window_max, LEARNT - RUN_IN), integer=True),
        Dimension(0.0, config.lag_max),
    )
    return MultiCentreSwarm(prior=((3, 2, window_min, 1.0), (3, 3, window_max, 3.0))).minimise(fitness, dimensions)


def _four(model: ThrusterModel) -> tuple[float, ...]:
    return model.response.delay, model.order, min(model.window, LEARNT - RUN_IN), model.response.lag


def _exact(command: FloatArray, speed_rpm: FloatArray) -> Choice:
    return ExactSearch()(
        Candidates(command, speed_rpm, order_max=ORDER_MAX, window_min=WINDOW_MIN, window_max=WINDOW_MAX)
    )


def _swarm_with_polyfit(command: FloatArray, speed_rpm: FloatArray) -> Optimum:
    floor_rpm = speed_floor_rpm(speed_rpm)
    newest = slice(-WINDOW_MIN, None)

    def fitness(position: tuple[float, ...]) -> float:
        order, window = map(int, position)
        coefficients = np.polyfit(command[-window:], speed_rpm[-window:], order)
        predicted: FloatArray = np.asarray(np.polyval(coefficients, command), dtype=np.float64)
        on_window = mape(speed_rpm[-window:], predicted[-window:], floor_rpm)
        return max(on_window, mape(speed_rpm[newest], predicted[newest], floor_rpm))

    longest = min(WINDOW_MAX, len(command))
    dimensions = (Dimension(1, ORDER_MAX, integer=True), Dimension(WINDOW_MIN, longest, integer=True))
    return MultiCentreSwarm(prior=((2, WINDOW_MIN), (3, longest))).minimise(fitness, dimensions)


def _not_worse(ours: Choice, theirs: Optimum) -> bool:
    return ours.fitness <= theirs.fitness * (1.0 + 1e-6)


def _same_levels(ours: ThrusterVerdicts, theirs: list[ThrusterVerdict]) -> bool:
    return bool(ours.level.tolist() == [int(verdict.level) for verdict in theirs])

"""The thruster detector's work done in two ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.thruster import ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.delay import align, estimate_delay
from detectors.thruster.detector import ThrusterVerdicts
from detectors.thruster.fitness import Candidates
from detectors.thruster.polynomial import mape, speed_floor_rpm
from detectors.thruster.search import Choice, ExactSearch
from detectors.thruster.swarm import Dimension, MultiCentreSwarm, Optimum
from hil_tests.bench.timing import Comparison
from hil_tests.random_runs import random_run

FloatArray = NDArray[np.float64]

# Paper 000: windows of 50 to 500; orders and delays it leaves open.
WINDOW_MIN, WINDOW_MAX, ORDER_MAX, DELAY_MAX = 50, 500, 5, 10
RECORDED = 1500  # samples that are judged at once and one by one


def refit() -> Comparison:
    """Order and window of the paper's model on the same samples, by the same fitness (equations 16 and 17).

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

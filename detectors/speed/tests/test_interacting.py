import pickle
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from filterpy.kalman import IMMEstimator, KalmanFilter
from scipy.linalg import expm

from detectors.speed import interacting
from detectors.speed.estimate import Step
from detectors.speed.interacting import (
    ANYWHERE_S,
    ASIDE_AT_START,
    BEGIN_IN,
    FLOW_AT_START,
    HEADING_ERROR_LASTS_S,
    HEADING_ERROR_RAD,
    LEADS_TO,
    LEAST_PROBABILITY,
    MOTION_ERROR,
    REGIMES,
    RESTLESS_ERROR,
    RESTLESS_S,
    SLIP_AT_START,
    SLIP_WALK,
    SPEED_AT_START,
    TURN_ERROR_S,
    InteractingEstimator,
)
from detectors.speed.tests.drives import circling, drive, irregular, run, zig_zag

NOISE_M = 0.2


def van_loan(ways, interval_s, rates):
    """Transition and process noise of dx = A x dt + dw by the exponential of one matrix (Van Loan, 1978)."""
    d, size = len(ways), len(ways) + len(rates)
    a, diffusion = np.zeros((size, size)), np.zeros((size, size))
    a[:d, d:] = ways / interval_s
    diffusion[d:, d:] = rates
    block = expm(np.block([[-a, diffusion], [np.zeros((size, size)), a.T]]) * interval_s)
    transition = block[size:, size:].T
    return transition, transition @ block[:size, size:]


class Reference:
    """The same mixture by filterpy, in coordinates that do not move."""

    def __init__(self, dimensions, scale_mps, position_m):
        self.d, self.scale, self.regimes = dimensions, scale_mps, list(REGIMES.values())
        self.restless_regimes = np.array(["flow" in name for name in REGIMES], dtype=float)
        self.restless, self.probability = 0.0, np.array(BEGIN_IN)
        spread = (ANYWHERE_S, SPEED_AT_START, ASIDE_AT_START, SLIP_AT_START, FLOW_AT_START)
        spread = scale_mps * np.repeat(spread, (dimensions, 1, 1, 1, dimensions))
        self.filters = [self.new_filter(position_m, spread) for _ in REGIMES]

    def new_filter(self, position_m, spread):
        one = KalmanFilter(dim_x=2 * self.d + 3, dim_z=self.d)
        one.x[: self.d, 0], one.x[self.d, 0] = position_m, self.scale
        one.P, one.H = np.diag(spread**2), np.eye(self.d, 2 * self.d + 3)
        return one

    def rates(self, regime, step):
        """What each second adds to the covariance of speed, sideways speed, slip and flow."""
        bow = step.ahead_s / step.interval_s
        rates = np.diag([regime.speed**2, 0.0, SLIP_WALK**2, *[regime.flow**2] * self.d])
        rates[3:, 3:] += regime.flow_ahead**2 * np.outer(bow, bow)
        return rates * self.scale**2

    def way_error(self, step):
        """What else adds to the covariance of the position: a heading that is off goes across the way."""
        length_s = np.linalg.norm(step.ahead_s)
        bow = step.ahead_s / length_s
        heading2 = (HEADING_ERROR_RAD * length_s) ** 2 * max(HEADING_ERROR_LASTS_S / step.interval_s, 1.0)
        motion2 = MOTION_ERROR**2 * step.interval_s + TURN_ERROR_S**2 * np.linalg.norm(step.turned) ** 2
        one = np.eye(self.d)
        return self.scale**2 * (heading2 * (one - np.outer(bow, bow)) + motion2 * one)

    def update(self, step):
        ways = np.column_stack((step.ahead_s, step.aside_s, step.turned, step.interval_s * np.eye(self.d)))
        for one, regime in zip(self.filters, self.regimes, strict=True):
            one.F, one.Q = van_loan(ways, step.interval_s, self.rates(regime, step))
            one.Q[: self.d, : self.d] += self.way_error(step)
            one.R = np.eye(self.d) * step.position_noise_m**2
        stay = np.exp([-step.interval_s / regime.lasts_s for regime in self.regimes])
        moves = np.diag(stay) + (1.0 - stay)[:, None] * LEADS_TO
        bank = IMMEstimator(self.filters, self.probability, moves)
        bank.predict()
        bank.update(step.position_m.reshape(-1, 1))
        floored = np.maximum(bank.mu, LEAST_PROBABILITY)
        self.probability = floored / floored.sum()
        now = float(self.probability @ self.restless_regimes)
        self.restless += (now - self.restless) * (1.0 - np.exp(-step.interval_s / RESTLESS_S))

    def estimate(self):
        states = np.array([one.x[:, 0] for one in self.filters])
        mean = self.probability @ states
        off = states - mean
        covariance = sum(
            weight * (one.P + np.outer(away, away))
            for weight, one, away in zip(self.probability, self.filters, off, strict=True)
        )
        variance = np.diag(covariance)
        restless = RESTLESS_ERROR * self.restless * self.scale
        return (
            mean[self.d],
            sqrt(variance[self.d] + restless**2),
            mean[self.d + 3 :],
            sqrt(variance[self.d + 3 :].max()),
        )


def noisy_drive(dimensions, *, times, speed=0.9, seed=0):
    """Steps with all that a step can have: slipping in turns, thrust to the side."""
    flow, start = (0.3, -0.2, 0.05)[:dimensions], (10.0, -5.0, 3.0)[:dimensions]
    first, steps = drive(
        times, flow=flow, speed=speed, heading=circling(40.0), start=start, noise_m=NOISE_M, pitch=-0.1, seed=seed
    )
    rng = np.random.default_rng(seed)
    aside, turned = rng.normal(size=(2, len(steps), dimensions)) * 0.1
    return first, [
        replace(step, aside_s=aside[k] * step.interval_s, turned=turned[k] * step.interval_s)
        for k, step in enumerate(steps)
    ]


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("speed", [0.9, lambda t: 0.9 if t < 30.0 else 0.5], ids=["steady", "falling"])
def test_it_is_the_mixture_of_kalman_filters_that_an_independent_library_computes(dimensions, speed):
    first, steps = noisy_drive(dimensions, times=irregular(60.0, seed=2), speed=speed)
    ours, reference = InteractingEstimator(dimensions, 0.8), Reference(dimensions, 0.8, first)
    ours.begin(first, 0.0)
    for step in steps:
        estimate = ours.update(step)
        reference.update(step)
        speed_mps, speed_error_mps, flow_mps, flow_error_mps = reference.estimate()
        # not closer: the first position's variance is that of a whole sea, of which the rest is left by subtraction
        assert estimate.speed_mps == pytest.approx(speed_mps, abs=1e-6)
        assert estimate.speed_error_mps == pytest.approx(speed_error_mps, rel=1e-5)
        np.testing.assert_allclose(estimate.flow_mps, flow_mps, atol=1e-6)
        assert estimate.flow_error_mps == pytest.approx(flow_error_mps, rel=1e-5)


@pytest.mark.parametrize("number", range(len(REGIMES)), ids=list(REGIMES))
def test_a_regime_alone_is_a_kalman_filter(monkeypatch, number):
    """The plain recursion, with the covariance of the update in its information form."""
    alone = np.full(len(REGIMES), 1e-300)
    alone[number] = 1.0
    monkeypatch.setattr(interacting, "BEGIN_IN", alone)
    monkeypatch.setattr(interacting, "LEADS_TO", np.eye(len(REGIMES)))
    monkeypatch.setattr(interacting, "LEAST_PROBABILITY", 1e-300)
    monkeypatch.setattr(interacting, "RESTLESS", np.zeros(len(REGIMES)))
    first, steps = noisy_drive(2, times=irregular(40.0, seed=3))
    ours, reference = InteractingEstimator(2, 0.8), Reference(2, 0.8, first)
    ours.begin(first, 0.0)
    x, p, seen = reference.filters[0].x[:, 0], reference.filters[0].P, np.eye(2, 7)
    for step in steps:
        ways = np.column_stack((step.ahead_s, step.aside_s, step.turned, step.interval_s * np.eye(2)))
        rates = reference.rates(list(REGIMES.values())[number], step)
        transition, wandering = van_loan(ways, step.interval_s, rates)
        wandering[:2, :2] += reference.way_error(step)
        information = np.linalg.inv(transition @ p @ transition.T + wandering)
        p = np.linalg.inv(information + seen.T @ seen / NOISE_M**2)
        x = p @ (information @ transition @ x + seen.T @ step.position_m / NOISE_M**2)
        estimate = ours.update(step)
        assert estimate.speed_mps == pytest.approx(x[2], abs=1e-6)
        assert estimate.speed_error_mps == pytest.approx(sqrt(p[2, 2]), rel=1e-5)
        np.testing.assert_allclose(estimate.flow_mps, x[5:], atol=1e-6)
        assert estimate.flow_error_mps == pytest.approx(sqrt(max(p[5, 5], p[6, 6])), rel=1e-5)


@pytest.mark.parametrize("noise_m", [1e-3, 0.1, 30.0])
def test_covariances_stay_symmetric_and_positive_for_hours(noise_m):
    """Long straight legs, stops, turns, 0.02 s to 1000 s between positions."""
    rng = np.random.default_rng(4)
    ours, position_m, time_s = InteractingEstimator(2, 1.0), np.array([3e5, -2e5]), 0.0
    ours.begin(position_m, time_s)
    for number in range(1500):
        interval_s = float(10.0 ** rng.uniform(-1.7, 0.5 if number % 500 else 3.0))
        time_s += interval_s
        angle = 0.3 if number // 300 % 2 else number / 20.0
        ahead_s = interval_s * (0.0 if number // 700 % 3 == 2 else 1.0) * np.array([np.cos(angle), np.sin(angle)])
        position_m = position_m + ahead_s + 0.2 * interval_s
        seen_m = position_m + noise_m * rng.normal(size=2)
        nothing = np.zeros(2)
        estimate = ours.update(Step(time_s, interval_s, seen_m, ahead_s, nothing, nothing, noise_m))
        assert estimate.speed_error_mps > 0.0
    for one in ours._covariance:
        np.testing.assert_allclose(one, one.T, rtol=1e-6, atol=1e-9 * np.abs(one).max())
        size = np.sqrt(np.diag(one))
        assert np.linalg.eigvalsh(one / np.outer(size, size)).min() > 0.0
    assert ours._probability.sum() == pytest.approx(1.0, abs=1e-9)
    assert (ours._probability > 0.0).all()


def test_three_dimensions_know_upwelling_from_a_nose_that_is_down():
    times = np.arange(0.0, 120.0, 0.5)
    first, steps = drive(
        times, flow=(0.2, 0.1, -0.15), speed=1.1, heading=circling(40.0), start=(0, 0, 20.0), noise_m=0.1, pitch=-0.3
    )
    estimate = run(InteractingEstimator(3, 1.0), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.1, abs=0.05)
    np.testing.assert_allclose(estimate.flow_mps, [0.2, 0.1, -0.15], atol=0.05)


@pytest.mark.parametrize("interval_s", [0.02, 0.1, 1.0, 5.0])
def test_any_sampling_learns_speed_and_flow(interval_s):
    times = np.arange(0.0, min(160.0, 3000 * interval_s), interval_s)
    first, steps = drive(times, flow=(0.4, -0.3), speed=1.3, heading=zig_zag(), noise_m=0.1)
    estimate = run(InteractingEstimator(2, 1.0), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.3, abs=0.06)
    np.testing.assert_allclose(estimate.flow_mps, [0.4, -0.3], atol=0.06)


def straight_then_turned(onset_s, turn_s):
    """Legs, then a long one north in whose midst a head current sets in or half a metre per second is lost."""
    return lambda t: 0.0 if onset_s - 20.0 < t < turn_s else zig_zag(10.0)(t)


@pytest.mark.parametrize("lost", [True, False], ids=["speed is lost", "a head current sets in"])
def test_what_a_straight_course_cannot_tell_is_left_in_the_error_and_told_by_the_turn(lost):
    heading, before, after = straight_then_turned(80.0, 120.0), (0.2, 0.1), (-0.3, 0.1)
    first, steps = drive(
        np.arange(0.0, 150.0, 0.5),
        flow=lambda t, x: np.array(after if t >= 80.0 and not lost else before),
        speed=lambda t: 0.5 if t >= 80.0 and lost else 1.0,
        heading=heading,
        noise_m=0.1,
    )
    estimates = run(InteractingEstimator(2, 1.0), first, steps)
    straight, turned = estimates[238], estimates[-1]
    for possible_mps in (1.0, 0.5):
        assert abs(straight.speed_mps - possible_mps) < 2.5 * straight.speed_error_mps
    assert turned.speed_mps == pytest.approx(0.5 if lost else 1.0, abs=0.08)
    assert turned.speed_error_mps < 0.1 < straight.speed_error_mps


def test_its_error_is_honest():
    """Speed and flow that wander as in calm water: squared errors are no larger than it says, on average."""
    calm, interval_s, ratios = REGIMES["calm"], 0.5, []
    root_s = sqrt(interval_s)
    _, steps = drive(np.arange(0.0, 60.0, interval_s), flow=(0, 0), speed=0.0, heading=circling(30.0))
    for seed in range(20):
        rng = np.random.default_rng(seed)
        speed, flow, position = 1.0 + 0.3 * rng.normal(), 0.5 * rng.normal(size=2), np.zeros(2)
        ours = InteractingEstimator(2, 1.0)
        ours.begin(position, 0.0)
        for step in steps:
            speed += calm.speed * root_s * rng.normal()
            flow = flow + calm.flow * root_s * rng.normal(size=2)
            position = position + speed * step.ahead_s + flow * interval_s
            seen = position + NOISE_M * rng.normal(size=2)
            estimate = ours.update(replace(step, position_m=seen, position_noise_m=NOISE_M))
        ratios.append(((estimate.speed_mps - speed) / estimate.speed_error_mps) ** 2)
    assert 0.1 < np.mean(ratios) < 1.5


def test_a_new_beginning_far_away_keeps_speed_and_flow():
    first, steps = drive(np.arange(0.0, 80.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(10.0), noise_m=0.1)
    ours = InteractingEstimator(2, 1.0)
    before = run(ours, first, steps)[-1]
    there_m, ahead_s = np.array([1e6, -1e6]), np.array([0.5, 0.0])
    ours.begin(there_m, 100.0)
    moved_m = there_m + before.speed_mps * ahead_s + 0.5 * before.flow_mps
    after = ours.update(replace(steps[-1], time_s=100.5, position_m=moved_m, ahead_s=ahead_s))
    assert after.speed_mps == pytest.approx(before.speed_mps, abs=0.02)
    np.testing.assert_allclose(after.flow_mps, before.flow_mps, atol=0.02)


def test_while_it_idles_uncertainty_grows_and_not_beyond_all_bounds():
    first, steps = drive(np.arange(0.0, 80.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(10.0), noise_m=0.1)
    errors = []
    for idle_s in (0.0, 600.0, 1e4, 1e9):
        ours = InteractingEstimator(2, 1.0)
        run(ours, first, steps[:-1])
        ours.idle(idle_s)
        errors.append(ours.update(steps[-1]).flow_error_mps)
    assert errors[0] < errors[1] < errors[2] == errors[3] < 1.5


def test_another_unit_of_the_way_ahead_is_the_same_filter():
    first, steps = drive(np.arange(0.0, 60.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(10.0), noise_m=0.1)
    one, other = InteractingEstimator(2, 1.0), InteractingEstimator(2, 1.0)
    run(one, first, steps[:-1])
    run(other, first, steps[:-1])
    other.rescale(2.0)
    a, b = one.update(steps[-1]), other.update(replace(steps[-1], ahead_s=steps[-1].ahead_s / 2.0))
    assert b.speed_mps == pytest.approx(2.0 * a.speed_mps, rel=1e-3)
    assert b.speed_error_mps == pytest.approx(2.0 * a.speed_error_mps, rel=1e-3)
    np.testing.assert_allclose(b.flow_mps, a.flow_mps, rtol=1e-3)


def test_speeds_of_centimetres_per_second_by_their_scale():
    first, steps = drive(np.arange(0.0, 60.0, 0.5), flow=(0.4, -0.3), speed=1.3, heading=circling(20.0), noise_m=0.1)
    small = [
        replace(one, position_m=one.position_m / 100.0, position_noise_m=one.position_noise_m / 100.0)
        for one in steps
    ]
    large, tiny = (
        run(InteractingEstimator(2, 1.0), first, steps)[-1],
        run(InteractingEstimator(2, 0.01), first / 100.0, small)[-1],
    )
    assert tiny.speed_mps == pytest.approx(large.speed_mps / 100.0, rel=1e-6)
    assert tiny.speed_error_mps == pytest.approx(large.speed_error_mps / 100.0, rel=1e-6)
    np.testing.assert_allclose(tiny.flow_mps, large.flow_mps / 100.0, rtol=1e-6)


def test_where_the_flow_is_known_from_elsewhere_a_straight_course_tells_the_speed():
    first, steps = drive(np.arange(0.0, 60.0, 0.5), flow=(0.0, 0.0), speed=0.6, heading=lambda t: 0.3, noise_m=0.1)
    unknown, known = (run(InteractingEstimator(2, 1.0, error), first, steps)[-1] for error in (None, 0.05))
    assert unknown.speed_error_mps > 0.4
    assert known.speed_error_mps < 0.15
    assert known.speed_mps == pytest.approx(0.6, abs=0.15)


def test_sideways_thrust_and_slip_are_not_taken_for_flow():
    rng = np.random.default_rng(0)
    ours, position, heading = InteractingEstimator(2, 1.0), np.zeros(2), 0.0
    ours.begin(position, 0.0)
    for number in range(400):
        rate = 0.15 if number // 40 % 2 else -0.2
        heading += 0.5 * rate
        bow, right = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
        aside_s, turned = 0.5 * (number // 25 % 3 - 1) * right, 0.5 * rate * right
        position = position + 0.5 * bow + 0.4 * aside_s - 2.0 * turned + 0.5 * np.array([0.2, -0.1])
        seen = position + 0.05 * rng.normal(size=2)
        estimate = ours.update(Step(0.5 * number, 0.5, seen, 0.5 * bow, aside_s, turned, 0.05))
    assert estimate.speed_mps == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(estimate.flow_mps, [0.2, -0.1], atol=0.05)


def test_pickled_it_goes_on_bit_for_bit():
    first, steps = drive(irregular(30.0, seed=1), flow=(0.4, -0.3), speed=1.0, heading=circling(), noise_m=0.2)
    one = InteractingEstimator(2, 1.0)
    one.begin(first, 0.0)
    other = pickle.loads(pickle.dumps(one))  # noqa: S301
    for step in steps:
        expected, again = one.update(step), other.update(step)
        other = pickle.loads(pickle.dumps(other))  # noqa: S301
        assert (again.speed_mps, again.speed_error_mps) == (expected.speed_mps, expected.speed_error_mps)
        np.testing.assert_array_equal(again.flow_mps, expected.flow_mps)

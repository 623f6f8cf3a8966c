import pickle
from dataclasses import replace
from math import nan

import numpy as np
import pytest

from detectors.speed.kalman import FLOW_WANDERS, SPEED_WANDERS, KalmanEstimator
from detectors.speed.tests.drives import circling, drive, irregular, run, zig_zag


class PlainFilter:
    """The same filter written out by itself: information form of the update, process noise by fine steps."""

    def __init__(self, dimensions, speed_mps, scale_mps, noise_m):
        self.d = dimensions
        self.x = np.zeros(2 * dimensions + 1)
        self.x[dimensions] = speed_mps
        self.p = np.eye(2 * dimensions + 1) * scale_mps**2
        self.scale, self.noise = scale_mps, noise_m

    def begin(self, position):
        d = self.d
        self.x[:d] = position
        self.p[:d, :] = self.p[:, :d] = 0.0
        self.p[:d, :d] = np.eye(d) * self.noise**2

    def update(self, step, fine=400):
        d, h = self.d, step.interval_s / fine
        psi = step.ahead_s / step.interval_s
        motion = np.eye(2 * d + 1)
        motion[:d, d] = h * psi
        motion[:d, d + 1 :] = h * np.eye(d)
        rates = np.array([0.0] * d + [SPEED_WANDERS**2] + [FLOW_WANDERS**2] * d) * self.scale**2
        for _ in range(fine):
            self.x = motion @ self.x
            self.p = motion @ self.p @ motion.T + np.diag(rates) * h
        seen = np.eye(d, 2 * d + 1)
        information = np.linalg.inv(self.p)
        self.p = np.linalg.inv(information + seen.T @ seen / self.noise**2)
        self.x = self.p @ (information @ self.x + seen.T @ step.position_m / self.noise**2)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_it_equals_a_filter_written_out(dimensions):
    flow, start = (0.3, -0.2, 0.05)[:dimensions], (10.0, -5.0, 3.0)[:dimensions]
    times = irregular(40.0, seed=2)
    first, steps = drive(times, flow=flow, speed=0.9, heading=circling(30.0), start=start, noise_m=0.3, pitch=-0.1)
    ours = KalmanEstimator(dimensions, speed_scale_mps=0.8, speed_mps=0.7, position_noise_m=0.25)
    plain = PlainFilter(dimensions, 0.7, 0.8, 0.25)
    ours.begin(first, 0.0)
    plain.begin(first)
    for step in steps:
        estimate = ours.update(step)
        plain.update(step)
        assert estimate.speed_mps == pytest.approx(plain.x[dimensions], abs=2e-3)
        np.testing.assert_allclose(estimate.flow_mps, plain.x[dimensions + 1 :], atol=2e-3)
        errors = np.sqrt(np.diag(plain.p)[dimensions:])
        assert estimate.speed_error_mps == pytest.approx(errors[0], rel=5e-3)
        assert estimate.flow_error_mps == pytest.approx(errors[1:].max(), rel=5e-3)


@pytest.mark.parametrize("interval_s", [0.02, 0.1, 1.0, 5.0])
def test_any_sampling_learns_speed_and_flow(interval_s):
    times = np.arange(0.0, 160.1, interval_s)
    first, steps = drive(times, flow=(0.4, -0.3), speed=1.0, heading=zig_zag(), noise_m=0.1)
    estimate = run(KalmanEstimator(), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.0, abs=0.12)
    np.testing.assert_allclose(estimate.flow_mps, [0.4, -0.3], atol=0.12)


def test_a_fall_of_speed_is_followed():
    times = np.arange(0.0, 200.0, 0.2)
    first, steps = drive(times, flow=(0.4, -0.3), speed=lambda t: 1.0 if t < 120.0 else 0.6, heading=zig_zag(10.0),
                         noise_m=0.1)  # fmt: skip
    late = run(KalmanEstimator(), first, steps)[-1]
    assert late.speed_mps == pytest.approx(0.6, abs=0.1)


def test_its_uncertainty_is_honest():
    """Speed and flow as it supposes them, random walks: squared errors are as large as it says, on average."""
    ratios = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        interval_s, position, h = 0.5, np.zeros(2), np.sqrt(0.5)
        speed, flow = 1.0 + rng.normal(), rng.normal(size=2)
        ours = KalmanEstimator(speed_mps=1.0, position_noise_m=0.2)
        ours.begin(position + 0.2 * rng.normal(size=2), 0.0)
        _, steps = drive(np.arange(0.0, 60.0, interval_s), flow=(0, 0), speed=0.0, heading=circling(30.0))
        for step in steps:
            before = speed, flow
            speed, flow = speed + SPEED_WANDERS * h * rng.normal(), flow + FLOW_WANDERS * h * rng.normal(size=2)
            position = position + 0.5 * (before[0] + speed) * step.ahead_s + 0.5 * (before[1] + flow) * interval_s
            estimate = ours.update(replace(step, position_m=position + 0.2 * rng.normal(size=2)))
        ratios.append(((estimate.speed_mps - speed) / estimate.speed_error_mps) ** 2)
    assert 0.5 < np.mean(ratios) < 1.7  # of 25: chi-square, 99 in 100


def test_a_straight_course_leaves_speed_uncertain_and_a_turn_tells():
    first, steps = drive(
        np.arange(0.0, 120.0, 0.5), flow=(-0.3, 0.0), speed=1.0, heading=lambda t: 0.0 if t < 80.0 else np.pi / 2,
        noise_m=0.05,
    )  # fmt: skip
    estimates = run(KalmanEstimator(), first, steps)
    straight, turned = estimates[158], estimates[-1]
    assert straight.speed_error_mps > 0.5
    assert turned.speed_error_mps < 0.2
    assert turned.speed_mps == pytest.approx(1.0, abs=0.2)


def test_speeds_of_centimetres_per_second_by_their_scale():
    first, steps = drive(np.arange(0.0, 60.0, 0.2), flow=(0.4, -0.3), speed=1.85, heading=circling(20.0), noise_m=0.1)
    small = [
        replace(one, position_m=one.position_m / 100, position_noise_m=one.position_noise_m / 100) for one in steps
    ]
    large = run(KalmanEstimator(speed_scale_mps=1.0), first, steps)[-1]
    tiny = run(KalmanEstimator(speed_scale_mps=0.01), first / 100, small)[-1]
    assert tiny.speed_mps == pytest.approx(large.speed_mps / 100, rel=1e-6)
    assert tiny.speed_error_mps == pytest.approx(large.speed_error_mps / 100, rel=1e-6)


def test_a_noise_that_is_given_counts_more_than_that_of_the_steps():
    first, steps = drive(np.arange(0.0, 40.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(5.0), noise_m=0.1)
    doubtful = [replace(step, position_noise_m=5.0) for step in steps]
    unknown = [replace(step, position_noise_m=nan) for step in steps]
    given = [run(KalmanEstimator(position_noise_m=0.1), first, some)[-1].speed_mps for some in (steps, doubtful)]
    assert given[0] == given[1]
    errors = [run(KalmanEstimator(), first, some)[-1].speed_error_mps for some in (steps, unknown, doubtful)]
    assert errors == sorted(errors)


def test_a_new_beginning_keeps_speed_and_flow_and_what_is_known_of_them():
    first, steps = drive(np.arange(0.0, 80.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(10.0), noise_m=0.1)
    ours = KalmanEstimator()
    before = run(ours, first, steps)[-1]
    ours.begin(np.array([1e4, -1e4]), 100.0)
    ahead_s = np.array([0.5, 0.0])
    moved = np.array([1e4, -1e4]) + before.speed_mps * ahead_s + 0.5 * before.flow_mps
    after = ours.update(replace(steps[-1], time_s=100.5, position_m=moved, ahead_s=ahead_s))
    assert after.speed_mps == pytest.approx(before.speed_mps, abs=1e-6)
    assert after.speed_error_mps == pytest.approx(before.speed_error_mps, rel=0.2)


def test_while_it_idles_uncertainty_grows():
    first, steps = drive(np.arange(0.0, 80.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(10.0), noise_m=0.1)
    busy, idle = KalmanEstimator(), KalmanEstimator()
    run(busy, first, steps[:-1])
    run(idle, first, steps[:-1])
    idle.idle(100.0)
    a, b = busy.update(steps[-1]), idle.update(steps[-1])
    assert b.speed_error_mps > 2.0 * a.speed_error_mps
    assert b.flow_error_mps > a.flow_error_mps


def test_another_unit_of_the_way_ahead_is_the_same_filter():
    first, steps = drive(np.arange(0.0, 60.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag(10.0), noise_m=0.1)
    one, other = KalmanEstimator(), KalmanEstimator()
    run(one, first, steps[:-1])
    run(other, first, steps[:-1])
    other.rescale(2.0)
    a = one.update(steps[-1])
    b = other.update(replace(steps[-1], ahead_s=steps[-1].ahead_s / 2.0))
    assert b.speed_mps == pytest.approx(2.0 * a.speed_mps, rel=1e-3)
    assert b.speed_error_mps == pytest.approx(2.0 * a.speed_error_mps, rel=0.05)
    np.testing.assert_allclose(b.flow_mps, a.flow_mps, rtol=1e-3)


@pytest.mark.parametrize("wrong", [{"speed_scale_mps": 0.0}, {"position_noise_m": -1.0}, {"speed_mps": nan}])
def test_what_is_wrong_is_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        KalmanEstimator(**wrong)


def test_a_step_of_the_wrong_shape_is_no_number_to_guess_at():
    first, steps = drive(np.arange(0.0, 2.0, 0.5), flow=(0.4, -0.3), speed=1.0, heading=zig_zag())
    ours = KalmanEstimator()
    ours.begin(first, 0.0)
    with pytest.raises(ValueError, match="want"):
        ours.update(replace(steps[0], position_m=np.zeros(3)))


def test_pickled_it_goes_on_bit_for_bit():
    first, steps = drive(irregular(30.0, seed=1), flow=(0.4, -0.3), speed=1.0, heading=circling(), noise_m=0.2)
    one = KalmanEstimator()
    one.begin(first, 0.0)
    other = pickle.loads(pickle.dumps(one))  # noqa: S301
    for step in steps:
        expected, again = one.update(step), other.update(step)
        other = pickle.loads(pickle.dumps(other))  # noqa: S301
        assert (again.speed_mps, again.speed_error_mps) == (expected.speed_mps, expected.speed_error_mps)
        np.testing.assert_array_equal(again.flow_mps, expected.flow_mps)

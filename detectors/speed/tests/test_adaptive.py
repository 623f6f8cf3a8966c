import pickle
from dataclasses import replace
from math import nan, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from detectors.speed.adaptive import AdaptiveEstimator
from detectors.speed.basis import FlowBasis
from detectors.speed.learnt_flow import FixedBasisFlow
from detectors.speed.moving_basis import MovingBasisFlow
from detectors.speed.oscillator import Gains, Oscillator
from detectors.speed.tests.drives import circling, drive, irregular, run, zig_zag

# Four wide functions: whatever the place, some of them reach there.
WIDE = FlowBasis(
    centres_m=((0.0, 0.0), (20.0, 0.0), (0.0, 20.0), (20.0, 20.0)),
    widths_m=(15.0,) * 4,
    frequencies_radps=(0.0, 0.02, 0.0, 0.05),
    phases_rad=(0.0, 0.3, 0.0, -0.4),
    squared=True,
)
THETA = np.array([[0.4, -0.2, 0.3, 0.1], [0.1, 0.3, -0.2, 0.2]])


def drift(theta=THETA, basis=WIDE):
    return FixedBasisFlow(basis, parameters=theta).velocity_mps


def dense(first, steps, *, basis, gamma, gain, limit=None, speed=0.0):
    """Equations 8-13 and 25-28 by a general solver: e, xi, V, and e_delta at the end."""
    dimensions, count = len(first), basis.size
    position, state = first, np.concatenate((np.zeros(dimensions * (count + 2)), [speed]))
    for step in steps:
        velocity = (step.position_m - position) / step.interval_s
        psi = step.ahead_s / step.interval_s
        begin, x0 = step.time_s - step.interval_s, position

        def derivative(t, y, velocity=velocity, psi=psi, begin=begin, x0=x0):
            e, e_delta = y[:dimensions], y[dimensions : 2 * dimensions]
            xi, v = y[2 * dimensions : -1].reshape(dimensions, count), y[-1]
            phi = basis.values(x0 + velocity * (t - begin), t)
            epsilon = e - e_delta
            delta_u = 0.0 if limit is None else min(v, limit) - v
            return np.concatenate(
                (
                    velocity - xi @ phi - v * psi - gain * e,
                    -gain * e_delta + delta_u * psi,
                    gamma * np.outer(epsilon, phi).ravel(),
                    [gamma * epsilon @ psi],
                )
            )

        solved = solve_ivp(derivative, (begin, step.time_s), state, rtol=1e-8, atol=1e-10, max_step=0.05)
        position, state = step.position_m, solved.y[:, -1]
    xi = state[2 * dimensions : -1].reshape(dimensions, count)
    return state[:dimensions], xi, state[-1], state[dimensions : 2 * dimensions]


@pytest.mark.parametrize("interval_s", [0.02, 0.5, 5.0])
@pytest.mark.parametrize(
    ("gamma", "gain", "close"),
    # the last swings some twenty times while the vehicle crosses a width of the basis
    [(0.8, 1.0, 3e-3), (0.05, 3.0, 3e-3), (20.0, 0.5, 0.06)],
)
def test_exact_steps_equal_a_general_solver(interval_s, gamma, gain, close):
    times = np.arange(0.0, max(10.0 * interval_s, 2.0) + 1e-9, interval_s)
    first, steps = drive(times, flow=drift(), speed=1.0, heading=circling(), start=(3.0, 5.0))
    flow = FixedBasisFlow(WIDE)
    ours = AdaptiveEstimator(flow, learning_rate=gamma, gain=gain)
    estimate = run(ours, first, steps)[-1]
    error, xi, speed, _ = dense(first, steps, basis=WIDE, gamma=gamma, gain=gain)
    assert estimate.speed_mps == pytest.approx(speed, abs=close)
    np.testing.assert_allclose(flow.parameters, xi, atol=close)
    np.testing.assert_allclose(ours.localisation_error_m, error, atol=close)


def test_under_a_limit_they_equal_a_general_solver_too():
    times = np.arange(0.0, 40.0, 0.25)
    first, steps = drive(times, flow=drift(), speed=1.0, heading=circling(), start=(3.0, 5.0))
    flow = FixedBasisFlow(WIDE)
    ours = AdaptiveEstimator(flow, speed_mps=1.8, speed_limit_mps=1.05)
    estimate = run(ours, first, steps)[-1]
    error, xi, speed, _ = dense(first, steps, basis=WIDE, gamma=0.8, gain=1.0, limit=1.05, speed=1.8)
    assert estimate.speed_mps == pytest.approx(min(speed, 1.05), abs=0.02)
    np.testing.assert_allclose(flow.parameters, xi, atol=0.02)
    np.testing.assert_allclose(ours.localisation_error_m, error, atol=0.02)


@pytest.mark.parametrize("stiffness", [1e-6, 0.01, 0.2499999, 0.25, 0.2500001, 0.26, 3.0, 1e4])
@pytest.mark.parametrize("interval_s", [1e-3, 0.1, 5.0, 300.0, 1e5])
def test_oscillator_is_the_matrix_exponential(stiffness, interval_s):
    """State e, its integral q, and a constant drive: e' = drive - K e - k q, q' = e."""
    damping = 1.0
    matrix = np.array([[-damping, -stiffness, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    exponential = expm(matrix * interval_s)
    found = Oscillator.over(interval_s, damping, stiffness)
    ours = np.array([[found.slope, found.answer], [found.answer, found.area]])
    np.testing.assert_allclose(ours, exponential[:2, [0, 2]], rtol=1e-5, atol=1e-8 * max(1.0, interval_s))


def test_theorem_1_the_error_vanishes_without_excitation_too():
    """A straight course cannot tell speed from flow, and the localisation error goes to zero all the same."""
    first, steps = drive(np.arange(0.0, 120.0, 0.2), flow=(0.3, 0.2), speed=1.0, heading=lambda t: 0.7)
    ours = AdaptiveEstimator(FixedBasisFlow(FlowBasis(((0.0, 0.0),), (1e6,))))
    ours.begin(first, 0.0)
    errors = [np.linalg.norm((ours.update(step), ours.localisation_error_m)[1]) for step in steps]
    assert max(errors) > 0.1
    assert errors[-1] < 1e-6


def test_theorem_2_parameters_converge_under_excitation():
    basis = FlowBasis(((0.0, 0.0),), (1e6,))
    first, steps = drive(np.arange(0.0, 200.0, 0.1), flow=(0.3, 0.2), speed=1.2, heading=circling(12.0))
    estimate = run(AdaptiveEstimator(FixedBasisFlow(basis)), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.2, abs=1e-3)
    np.testing.assert_allclose(estimate.flow_mps, [0.3, 0.2], atol=1e-3)


def test_the_lyapunov_function_never_grows():
    """(16) and (18), between any two samples, for a flow of the basis."""
    truth, gamma = FixedBasisFlow(WIDE, parameters=THETA), 0.8
    times = irregular(60.0, seed=3, longest_s=0.5)
    first, steps = drive(times, flow=drift(), speed=1.0, heading=circling(), start=(3.0, 5.0))
    flow = FixedBasisFlow(WIDE)
    ours = AdaptiveEstimator(flow, learning_rate=gamma)
    ours.begin(first, 0.0)
    values = []
    for step in steps:
        estimate = ours.update(step)
        off = np.sum((truth.parameters - flow.parameters) ** 2) + (1.0 - estimate.speed_mps) ** 2
        values.append(0.5 * (np.sum(ours.localisation_error_m**2) + off / gamma))
    assert np.diff(values).max() < 1e-3 * values[0]
    assert values[-1] < 0.2 * values[0]


def test_theorem_3_the_error_stays_bounded_where_the_thrusters_saturate():
    """2 m/s are asked for, and 1 m/s is all there is (2, 3)."""
    basis, limit = FlowBasis(((0.0, 0.0),), (1e6,)), 1.0
    first, steps = drive(np.arange(0.0, 200.0, 0.1), flow=(0.3, 0.2), speed=limit, heading=circling(40.0))
    ours = AdaptiveEstimator(FixedBasisFlow(basis), speed_mps=2.0, speed_limit_mps=limit)
    ours.begin(first, 0.0)
    estimates = []
    for step in steps:
        beyond = ours.asked_speed_mps - limit
        estimates.append(ours.update(step))
        assert np.linalg.norm(ours.localisation_error_m) <= max(beyond, 0.0) / 0.5 + 0.3
    assert estimates[-1].speed_mps == pytest.approx(limit, abs=1e-3)
    np.testing.assert_allclose(estimates[-1].flow_mps, [0.3, 0.2], atol=1e-3)


def test_under_the_limit_a_fall_of_speed_is_learnt_like_without_one():
    first, steps = drive(
        np.arange(0.0, 150.0, 0.1), flow=(0.3, 0.2), speed=lambda t: 1.0 if t < 80 else 0.5, heading=circling(40.0)
    )
    ours = AdaptiveEstimator(MovingBasisFlow(), speed_mps=1.4, speed_limit_mps=1.0)
    estimates = run(ours, first, steps)
    assert max(estimate.speed_mps for estimate in estimates) <= 1.0
    assert estimates[-1].speed_mps == pytest.approx(0.5, abs=0.02)


SAMPLINGS = {
    "50 Hz": np.arange(0.0, 120.0, 0.02),
    "10 Hz": np.arange(0.0, 240.0, 0.1),
    "1 Hz": np.arange(0.0, 240.0, 1.0),
    "0.2 Hz": np.arange(0.0, 240.1, 5.0),
    "irregular": irregular(240.0, seed=5),
    "with gaps": np.delete(np.arange(0.0, 240.0, 0.5), np.r_[100:150, 250:330]),
}


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_any_sampling_converges_to_the_same(sampling):
    times = SAMPLINGS[sampling]
    first, steps = drive(times, flow=(0.4, -0.3), speed=lambda t: 1.0, heading=zig_zag())
    estimate = run(AdaptiveEstimator(MovingBasisFlow()), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.0, abs=0.03)
    np.testing.assert_allclose(estimate.flow_mps, [0.4, -0.3], atol=0.03)


def test_speeds_of_centimetres_per_second():
    """The law is linear: a hundredth of all speeds gives a hundredth of all estimates."""
    times = np.arange(0.0, 100.0, 0.2)
    basis = FlowBasis(((0.0, 0.0),), (1e9,))
    first, steps = drive(times, flow=(0.4, -0.3), speed=1.85, heading=circling(12.0))
    small = [replace(step, position_m=step.position_m / 100.0) for step in steps]
    large = run(AdaptiveEstimator(FixedBasisFlow(basis)), first, steps)[-1]
    tiny = run(AdaptiveEstimator(FixedBasisFlow(basis)), first / 100.0, small)[-1]
    assert tiny.speed_mps == pytest.approx(0.0185, rel=0.01)
    assert tiny.speed_mps == pytest.approx(large.speed_mps / 100.0, rel=1e-6)


def test_in_three_dimensions():
    first, steps = drive(
        np.arange(0.0, 240.0, 0.5),
        flow=(0.2, -0.1, 0.06),
        speed=1.0,
        heading=zig_zag(),
        start=(0.0, 0.0, 20.0),
        pitch=-0.2,
    )
    estimate = run(AdaptiveEstimator(MovingBasisFlow(3)), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.0, abs=0.03)
    np.testing.assert_allclose(estimate.flow_mps, [0.2, -0.1, 0.06], atol=0.03)


@pytest.mark.parametrize(("interval_s", "noise_m"), [(0.2, 1.0), (1.0, 1.0), (0.5, 2.0)])
def test_noisy_positions_slow_the_law_until_the_speed_is_quiet(interval_s, noise_m):
    times = np.arange(0.0, 400.0, interval_s)
    first, steps = drive(times, flow=(0.4, -0.3), speed=1.0, heading=zig_zag(), noise_m=noise_m)

    def spread(most):
        estimates = run(AdaptiveEstimator(MovingBasisFlow(), speed_noise_max_mps=most), first, steps)
        late = np.array([estimate.speed_mps for estimate in estimates])[times[1:] > 200.0]
        return np.sqrt(np.mean((late - 1.0) ** 2))

    slowed = spread(0.05)
    assert slowed < 0.12
    assert spread(None) > 1.8 * slowed


def test_noise_of_the_speed_is_as_foreseen():
    gains, interval_s, noise_m = Gains(0.8, 1.0), 0.05, 0.3
    first, steps = drive(np.arange(0.0, 200.0, interval_s), flow=(0.0, 0.0), speed=0.0, heading=lambda t: 0.0,
                         noise_m=noise_m)  # fmt: skip
    # without a flow to learn the speed alone takes the noise
    flow = FixedBasisFlow(FlowBasis(((1e9, 1e9),), (1.0,)))
    estimates = run(AdaptiveEstimator(flow), first, steps)
    seen = np.std([estimate.speed_mps for estimate in estimates[400:]])
    assert seen == pytest.approx(gains.speed_noise_mps(noise_m, interval_s), rel=0.2)
    assert gains.slowed(0.25).speed_noise_mps(noise_m, interval_s) == pytest.approx(
        0.25**1.5 * gains.speed_noise_mps(noise_m, interval_s)
    )


def test_a_new_beginning_keeps_speed_and_flow_and_forgets_the_error():
    first, steps = drive(np.arange(0.0, 100.0, 0.2), flow=(0.3, 0.2), speed=1.0, heading=circling(40.0))
    ours = AdaptiveEstimator(MovingBasisFlow())
    before = run(ours, first, steps)[-1]
    ours.begin(steps[-1].position_m, 100.0)
    np.testing.assert_array_equal(ours.localisation_error_m, 0.0)
    nothing = np.zeros(2)
    ahead = np.array([1.0, 0.0])
    moved = steps[-1].position_m + 0.2 * (before.flow_mps + before.speed_mps * ahead)
    after = ours.update(replace(steps[-1], time_s=100.2, interval_s=0.2, position_m=moved, ahead_s=0.2 * ahead,
                                aside_s=nothing, turned=nothing))  # fmt: skip
    assert after.speed_mps == pytest.approx(before.speed_mps, abs=1e-3)
    assert np.isnan(after.speed_error_mps)


def test_thrusters_that_give_nothing_leave_the_speed_alone():
    first, steps = drive(np.arange(0.0, 50.0, 0.5), flow=(0.3, 0.2), speed=0.0, heading=circling(40.0))
    drifting = [replace(step, ahead_s=np.zeros(2)) for step in steps]
    estimate = run(AdaptiveEstimator(MovingBasisFlow(), speed_mps=0.9), first, drifting)[-1]
    assert estimate.speed_mps == 0.9
    np.testing.assert_allclose(estimate.flow_mps, [0.3, 0.2], atol=0.01)


def test_another_unit_of_the_way_ahead():
    ours = AdaptiveEstimator(MovingBasisFlow(), speed_mps=0.9)
    ours.rescale(2.0)
    assert ours.asked_speed_mps == 1.8


@pytest.mark.parametrize(
    "wrong",
    [
        {"gain": 0.0},
        {"learning_rate": -1.0},
        {"speed_mps": nan},
        {"speed_limit_mps": 0.0},
        {"speed_noise_max_mps": nan},
    ],
)
def test_what_is_wrong_is_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        AdaptiveEstimator(MovingBasisFlow(), **wrong)


def test_pickled_it_goes_on_bit_for_bit():
    first, steps = drive(irregular(60.0, seed=1), flow=drift(), speed=1.0, heading=circling(), noise_m=0.2)
    one = AdaptiveEstimator(FixedBasisFlow(WIDE), speed_limit_mps=1.1, speed_noise_max_mps=0.05)
    one.begin(first, 0.0)
    for number, step in enumerate(steps):
        expected = one.update(step)
        if number == 0:
            other = pickle.loads(pickle.dumps(one))  # noqa: S301
            continue
        again = other.update(step)
        other = pickle.loads(pickle.dumps(other))  # noqa: S301
        assert again.speed_mps == expected.speed_mps
        np.testing.assert_array_equal(again.flow_mps, expected.flow_mps)
        assert sqrt(expected.flow_mps @ expected.flow_mps) < 10.0

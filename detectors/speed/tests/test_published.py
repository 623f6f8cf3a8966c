import pickle
from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest

from detectors.speed.basis import FlowBasis
from detectors.speed.config import SpeedConfig
from detectors.speed.learnt_flow import FixedBasisFlow
from detectors.speed.published import ExplicitLaw, PublishedMethod
from detectors.speed.sample import PoseSample, direction_of, position_of
from detectors.verdict import Level

BASIS = FlowBasis(((0.0, 0.0), (10.0, 10.0)), (5.0, 5.0), (1.4e-4, 1.45e-4))
UNIFORM = FlowBasis(((0.0, 0.0),), (1e9,))
CONFIG = SpeedConfig(estimator="published", speed_min_mps=0.8, speed_max_mps=1.2, basis=UNIFORM)
XI = np.array([[0.1, 0.2], [0.3, 0.4]])


def poses(count, interval_s=0.1, speed=lambda t: 1.0, flow=(0.2, 0.1), turn_s=12.0):
    """A vehicle that circles in a uniform flow and holds each heading until the next sample."""
    x, samples = np.zeros(2), []
    for number in range(count):
        t = number * interval_s
        heading = 2 * pi * t / turn_s
        samples.append(PoseSample(t, *x.tolist(), heading))
        x = x + interval_s * (np.array(flow) + speed(t) * np.array([np.cos(heading), np.sin(heading)]))
    return samples


def judge(config, samples, **start):
    method = PublishedMethod(config, **start)
    return [method.judge(sample) for sample in samples]


def test_algorithm_1_line_by_line():
    """Two steps by hand, in the paper's order: everything on the right is of t."""
    law = ExplicitLaw(
        FixedBasisFlow(BASIS, parameters=XI), learning_rate=0.8, gain=1.5, speed_mps=0.9, position_m=np.zeros(2)
    )
    xi, z, v, ts = XI.copy(), np.zeros(2), 0.9, 0.1
    for number, x in enumerate((np.array([0.2, -0.1]), np.array([0.35, 0.05]))):
        t, psi = number * ts, np.array([np.cos(0.3 * number), np.sin(0.3 * number)])
        law.step(x, psi, t, ts)
        e = x - z
        phi_x, phi_z = BASIS.values(x, t), BASIS.values(z, t)
        beta = xi @ phi_x - xi @ phi_z + 1.5 * e
        xi, z, v = xi + 0.8 * np.outer(e, phi_x) * ts, z + (xi @ phi_z + v * psi + beta) * ts, v + 0.8 * e @ psi * ts
        np.testing.assert_allclose(law.flow.parameters, xi, rtol=1e-12)
        np.testing.assert_allclose(law.estimated_position_m, z, rtol=1e-12)
        assert law.speed_mps == pytest.approx(v, rel=1e-12)
        np.testing.assert_allclose(law.velocity_mps(t + ts), xi @ BASIS.values(z, t + ts), rtol=1e-12)


def test_equations_25_to_28_line_by_line():
    law = ExplicitLaw(
        FixedBasisFlow(BASIS), learning_rate=0.8, gain=1.5, speed_mps=1.3, position_m=np.zeros(2), speed_limit_mps=1.0
    )
    v, e_delta, z, xi, ts, psi = 1.3, np.zeros(2), np.zeros(2), np.zeros((2, 2)), 0.1, np.array([0.6, 0.8])
    for number in range(5):
        x = np.array([0.2, -0.1]) * (number + 1)
        law.step(x, psi, number * ts, ts)
        phi_x, phi_z = BASIS.values(x, number * ts), BASIS.values(z, number * ts)
        e = x - z
        epsilon = e - e_delta
        moved = xi @ phi_z + v * psi + xi @ phi_x - xi @ phi_z + 1.5 * e
        e_delta = e_delta + (-1.5 * e_delta + (min(v, 1.0) - v) * psi) * ts
        z, xi, v = z + moved * ts, xi + 0.8 * np.outer(epsilon, phi_x) * ts, v + 0.8 * epsilon @ psi * ts
        assert law.speed_mps == pytest.approx(v, rel=1e-12)
        assert law.through_water_mps == pytest.approx(min(v, 1.0), rel=1e-12)
        np.testing.assert_allclose(law.flow.parameters, xi, rtol=1e-12, atol=1e-15)


def test_a_fall_of_speed_is_an_anomaly_and_one_within_the_range_is_none():
    said = judge(CONFIG, poses(2000, speed=lambda t: 0.5 if t >= 150.0 else (0.9 if t >= 100.0 else 1.0)))
    levels = np.array([one.level for one in said])
    assert said[0].level is Level.UNKNOWN
    assert (levels[400:1500] == Level.NORMAL).all()
    found = np.flatnonzero(levels[1500:] == Level.FAULT)[0]
    assert found < 30
    assert said[-1].speed_mps == pytest.approx(0.5, abs=0.1)
    assert said[1500 + found].reason == "too slow"
    assert said[1500 + found].score > 1.0


def test_flags_levels_scores_and_reasons_belong_together():
    said = judge(CONFIG, poses(2000, speed=lambda t: 1.6 if t >= 150.0 else 1.0))
    for one in said[1:]:
        assert one.level is {0: Level.NORMAL, 1: Level.FAULT, 2: Level.UNKNOWN}[one.flag]
        assert one.score == pytest.approx(abs(one.speed_mps - 1.0) / 0.2)
        assert (one.score > 1.0) == (not 0.8 <= one.speed_mps <= 1.2)
        assert (one.flow_error > 0.07) == (one.flag == 2)
        assert (one.speed_min_mps, one.speed_max_mps) == (0.8, 1.2)
        assert (one.reason == "") == (one.level is Level.NORMAL)
    found = next(one for one in said if one.time_s >= 150.0 and one.level is Level.FAULT)
    assert found.time_s < 153.0
    assert found.reason == "too fast"


def test_a_start_that_is_right_stays_right():
    truth = FixedBasisFlow(UNIFORM, parameters=np.array([[0.2], [0.1]]))
    said = judge(CONFIG, poses(600), flow=truth, speed_mps=1.0)
    assert max(abs(one.speed_mps - 1.0) for one in said) < 1e-6


def test_the_given_start_is_left_alone():
    start = FixedBasisFlow(BASIS, parameters=XI)
    judge(replace(CONFIG, basis=BASIS), poses(50), flow=start)
    np.testing.assert_array_equal(start.parameters, XI)


def test_without_a_basis_it_learns_over_one_that_moves():
    said = judge(replace(CONFIG, basis=None), poses(2500))
    assert said[-1].speed_mps == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(said[-1].flow_mps, [0.2, 0.1], atol=0.05)


def test_three_dimensions_have_their_down_component():
    sample = PoseSample(0.0, 1.0, 2.0, heading_rad=pi / 2, down_m=3.0, pitch_rad=pi / 6)
    np.testing.assert_allclose(position_of(sample, 3), [1.0, 2.0, 3.0])
    np.testing.assert_allclose(direction_of(sample, 3), [0.0, np.cos(pi / 6), -0.5], atol=1e-15)  # nose up is upwards
    np.testing.assert_allclose(direction_of(sample, 2), [0.0, 1.0], atol=1e-15)
    said = judge(replace(CONFIG, dimensions=3), [replace(one, down_m=-0.05 * one.time_s) for one in poses(1500)])
    assert len(said[-1].flow_mps) == 3
    assert said[-1].flow_mps[2] == pytest.approx(-0.05, abs=0.02)


def test_the_explicit_step_diverges_where_it_is_too_long_and_says_that_it_knows_nothing():
    said = judge(CONFIG, poses(1500, interval_s=5.0, turn_s=80.0))
    assert all(one.level is Level.UNKNOWN for one in said[200:])
    assert all(np.isfinite([one.score, one.speed_mps, *one.flow_mps]).all() for one in said)
    restarted = [one for one in said[1:] if np.isnan(one.flow_error)]
    assert restarted
    assert all(one.flag == 2 and one.speed_mps == 1.0 for one in restarted)


def test_after_a_leap_of_the_position_it_learns_anew():
    samples = poses(1500)
    leaping = samples[:500] + [replace(one, north_m=one.north_m + 1e5) for one in samples[500:]]
    said = judge(CONFIG, leaping)
    assert {one.level for one in said[501:700]} == {Level.UNKNOWN}
    assert {one.level for one in said[1000:]} == {Level.NORMAL}
    assert said[-1].speed_mps == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("basis", [None, UNIFORM, BASIS, replace(BASIS, squared=True)])
@pytest.mark.parametrize("limit", [None, 1.0])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_any_finite_input_gives_finite_scores(basis, limit, dimensions):
    rng, t = np.random.default_rng(7), 0.0
    method = PublishedMethod(replace(CONFIG, basis=basis, speed_limit_mps=limit, dimensions=dimensions))
    for _ in range(400):
        t += rng.choice([1e-9, 0.02, 1.0, 100.0, 1e6])
        numbers = rng.normal(size=5) * rng.choice([1e-300, 1.0, 1e6, 1e15])
        said = method.judge(PoseSample(float(t), *numbers.tolist()))
        assert np.isfinite([said.score, said.speed_mps, *said.flow_mps]).all()
        assert said.score < inf


def test_it_needs_a_normal_range():
    with pytest.raises(ValueError, match="speed_min_mps"):
        PublishedMethod(SpeedConfig())


def test_pickled_it_goes_on_bit_for_bit():
    samples = poses(60)
    one = PublishedMethod(replace(CONFIG, basis=None))
    other = pickle.loads(pickle.dumps(one))  # noqa: S301
    for sample in samples:
        other = pickle.loads(pickle.dumps(other))  # noqa: S301
        assert repr(other.judge(sample)) == repr(one.judge(sample))

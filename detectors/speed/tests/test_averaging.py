from itertools import pairwise

import numpy as np
import pytest

from detectors.speed.averaging import BLOCK_S, Averaging
from detectors.speed.estimate import Step
from detectors.speed.sample import PoseSample
from detectors.speed.tests.dives import every, irregular
from detectors.speed.way import Way

FLOW, SPEED = np.array([0.4, -0.3]), 1.3


def heading(t):
    return 0.7 * np.sin(t / 4.0)


def averaged(times, *, noise_m=0.0, seed=0, start_m=(0.0, 0.0)):
    """Steps of a vehicle that goes exactly where ways and a flow take it, but for the noise of its positions."""
    rng = np.random.default_rng(seed)
    averaging, way, place = Averaging(2), Way(2, 1.0), np.array(start_m)
    way.begin(PoseSample(times[0], 0.0, 0.0, heading(times[0])), 1.0)
    averaging.begin(place + noise_m * rng.normal(size=2), times[0])
    said, before = [], times[0]
    for t in times[1:]:
        way.extend(PoseSample(t, 0.0, 0.0, heading(t)), 1.0)
        place = place + SPEED * way.ahead_s + FLOW * (t - before)
        said.append(averaging.take(t, place + noise_m * rng.normal(size=2), way, (noise_m, 1e-6)))
        way.restart()
        before = t
    return said


def steps_of(said):
    return [one for one in said if isinstance(one, Step)]


def assert_follows(said):
    """The motion from mean to mean is by the same speed and flow."""
    positions = [one.position_m if isinstance(one, Step) else one for one in said if one is not None]
    assert len(positions) > 5
    for (before, now), step in zip(pairwise(positions), steps_of(said), strict=True):
        np.testing.assert_allclose(now - before, SPEED * step.ahead_s + FLOW * step.interval_s, atol=1e-6)


@pytest.mark.parametrize(
    "times", [every(0.02, 20.0), every(0.1, 20.0), every(0.7, 20.0), every(5.0, 100.0), irregular(60.0, seed=1)]
)
def test_means_move_as_the_vehicle_does(times):
    assert_follows(averaged(times))


def test_far_from_the_origin_and_late_too():
    assert_follows(averaged([1.8e9 + t for t in every(0.125, 30.0)], start_m=(4e6, -2e6)))


@pytest.mark.parametrize(("rate_hz", "count"), [(50.0, 50), (10.0, 10), (5.0, 5)])
def test_a_block_is_about_a_second_and_its_mean_that_much_surer(rate_hz, count):
    steps = steps_of(averaged(every(1.0 / rate_hz, 30.0), noise_m=0.2))
    assert np.mean([step.interval_s for step in steps]) == pytest.approx(BLOCK_S, rel=0.1)
    assert steps[-1].position_noise_m == pytest.approx(0.2 / np.sqrt(count), rel=0.1)
    left_m = np.diff([step.position_m for step in steps], axis=0) - [
        SPEED * step.ahead_s + FLOW * step.interval_s for step in steps[1:]
    ]
    assert left_m.std() == pytest.approx(np.sqrt(2.0) * steps[-1].position_noise_m, rel=0.35)


@pytest.mark.parametrize("interval_s", [1.0, 5.0])
def test_seldom_positions_pass_as_they_are(interval_s):
    times = every(interval_s, 50.0)
    steps = steps_of(averaged(times, noise_m=0.2))
    assert [step.time_s for step in steps] == times[len(times) - len(steps) :]
    for step in steps[1:]:  # the first one comes from a block of two
        assert step.interval_s == pytest.approx(interval_s)
        assert step.position_noise_m == pytest.approx(0.2)


def test_a_new_beginning_joins_nothing_across_it():
    averaging, way = Averaging(2), Way(2, 1.0)
    for origin_m in (0.0, 500.0):
        way.begin(PoseSample(0.0, 0.0, 0.0, 0.0), 1.0)
        averaging.begin(np.array([origin_m, 0.0]), 0.0)
        said = []
        for t in every(0.1, 3.0)[1:]:
            way.extend(PoseSample(t, 0.0, 0.0, 0.0), 1.0)
            said.append(averaging.take(t, np.array([origin_m + t, 0.0]), way, (0.1, 0.01)))
            way.restart()
        first = next(one for one in said if one is not None)
        assert not isinstance(first, Step)
        assert first[0] == pytest.approx(origin_m + 0.45, abs=0.1)
        for step in steps_of(said):
            assert step.ahead_s[0] == pytest.approx(step.interval_s)

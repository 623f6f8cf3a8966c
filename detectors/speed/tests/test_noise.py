import numpy as np
import pytest

from detectors.speed.noise import FLOOR_S, LEAST, PositionNoise


def left_of(errors_m):
    """(N, D) what is left of each step between positions with these errors, where the way was foreseen exactly."""
    return np.diff(errors_m, axis=0)


def learnt(left_m, *, dimensions=2, scale_mps=1.0):
    """Standard deviations after each step from the hundredth on."""
    noise = PositionNoise(None, scale_mps, dimensions)
    said = []
    for one in left_m:
        noise.take(one)
        said.append(noise.deviation_m)
    return np.array(said[100:])


def white(size_m, *, count=1500, dimensions=2, seed=0):
    return size_m * np.random.default_rng(seed).normal(size=(count, dimensions))


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("size_m", [0.02, 0.1, 0.5, 2.0, 20.0])
def test_white_noise_of_any_size_is_learnt_within_fifteen_per_cent(size_m, dimensions):
    for seed in range(3):
        said = learnt(left_of(white(size_m, dimensions=dimensions, seed=seed)), dimensions=dimensions)
        assert said.mean() == pytest.approx(size_m, rel=0.15)
        assert 0.5 * size_m < said.min() <= said.max() < 1.7 * size_m


def test_it_follows_a_noise_that_changes():
    errors_m = np.concatenate((white(0.1, count=500), white(1.0, count=500, seed=1), white(0.1, count=500, seed=2)))
    said = learnt(left_of(errors_m))
    assert said[200] == pytest.approx(0.1, rel=0.4)
    assert said[800] == pytest.approx(1.0, rel=0.4)
    assert said[-1] == pytest.approx(0.1, rel=0.4)


def test_outliers_and_jumps_do_not_count():
    errors_m = white(0.1)
    errors_m[::20] += 40.0
    errors_m[700:] += 30.0
    assert learnt(left_of(errors_m)).mean() == pytest.approx(0.1, rel=0.25)


@pytest.mark.parametrize("interval_s", [0.02, 0.1, 1.0])
def test_a_flow_and_a_speed_that_are_not_known_yet_do_not_count(interval_s):
    """A vehicle in circles of 40 s whose speed and flow are off by as much as they may be."""
    angle = 2.0 * np.pi * interval_s * np.arange(1499) / 40.0
    unknown_mps = np.array([0.9, -0.7]) + 0.5 * np.column_stack((np.cos(angle), np.sin(angle)))
    said = learnt(left_of(white(0.2)) + interval_s * unknown_mps)
    assert said.mean() == pytest.approx(0.2, rel=0.15)


def test_no_noise_at_all_leaves_what_a_model_of_the_way_is_off():
    assert learnt(np.zeros((300, 2)), scale_mps=2.0)[-1] == pytest.approx(2.0 * FLOOR_S)


def test_it_is_known_after_a_few_steps_and_then_rather_too_large_than_too_small():
    noise, errors_m = PositionNoise(None, 1.0, 2), white(0.1, count=LEAST + 3)
    known = []
    for one in left_of(errors_m):
        noise.take(one)
        known.append(noise.known)
    assert known[: LEAST - 1] == [False] * (LEAST - 1)
    assert known[-1]
    first = []
    for seed in range(200):
        noise = PositionNoise(None, 1.0, 2)
        for one in left_of(white(0.1, count=LEAST + 2, seed=seed)):
            noise.take(one)
        first.append(noise.deviation_m)
    assert 0.1 < np.median(first) < 0.16


def test_an_interruption_joins_no_steps_that_do_not_follow_each_other():
    noise = PositionNoise(None, 1.0, 2)
    for number, one in enumerate(left_of(white(0.1))):
        noise.take(one if number % 2 else one + np.array([50.0, 0.0]))  # were they joined, each would be an outlier
        noise.interrupt()
    assert not noise.known


def test_a_configured_noise_is_known_at_once_and_stays():
    noise = PositionNoise(0.3, 1.0, 2)
    assert noise.known
    for one in left_of(white(5.0)):
        noise.take(one)
    assert noise.deviation_m == 0.3

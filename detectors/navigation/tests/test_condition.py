import numpy as np

from detectors.navigation.condition import OFF_LIMIT, OFF_MEMORY, STUCK_SAMPLES, Condition
from detectors.navigation.sample import FaultKind
from detectors.navigation.tests.innovations import NOISE_MPS, depth_innovation, dvl_innovation


def watch(rows, condition=None):
    """A DVL with these innovations, in standard deviations, one a second."""
    condition = Condition() if condition is None else condition
    for number, row in enumerate(NOISE_MPS * np.asarray(rows)):
        condition.update(tuple(row.tolist()), dvl_innovation(float(number), row))
    return condition


def healthy(count, seed=0):
    return np.random.default_rng(seed).normal(size=(count, 3))


def repeating(condition, off, count):
    for number in range(count):
        condition.update((1.5, 0.0, 0.1), dvl_innovation(float(number), off * NOISE_MPS))


def test_nothing_shows_in_healthy_samples():
    condition, highest = Condition(), 0.0
    for row in healthy(4000):
        watch([row], condition)
        highest = max(highest, condition.evidence()[0])
    assert 0.2 < highest < 0.7


def test_new():
    assert Condition().evidence()[0] < 0.3
    assert not Condition().repeated


def test_stuck_is_a_sensor_that_repeats_itself_while_the_vehicle_moves_on():
    condition = Condition()
    repeating(condition, 4.0, STUCK_SAMPLES - 1)
    assert not condition.repeated
    assert condition.evidence()[1] is not FaultKind.STUCK
    repeating(condition, 4.0, 1)
    assert condition.repeated
    assert condition.evidence() == (2.0, FaultKind.STUCK)


def test_repeating_what_is_true_is_not_yet_a_fault():
    condition = Condition()
    repeating(condition, 1.0, 50)
    assert condition.repeated
    assert condition.evidence()[0] < 1.0


def test_alive_again_it_is_not_stuck():
    condition = Condition()
    repeating(condition, 10.0, 10)
    watch(healthy(1), condition)
    assert not condition.repeated
    assert condition.evidence()[1] is not FaultKind.STUCK


def first_found(rows, condition):
    """Number of samples, and kind."""
    for number, row in enumerate(rows, start=1):
        score, kind = watch([row], condition).evidence()
        if score >= 1.0:
            return number, kind
    return None


def test_scatter_is_found_and_forgotten():
    condition = watch(healthy(100))
    number, kind = first_found(6.0 * healthy(40, seed=1), condition)
    assert number <= 20
    assert kind is FaultKind.NOISE
    watch(healthy(60, seed=2), condition)
    assert condition.evidence()[0] < 0.7


def test_little_more_scatter_is_found_later():
    assert 10 < first_found(3.0 * healthy(200, seed=1), watch(healthy(100)))[0] < 100
    assert first_found(1.5 * healthy(200, seed=1), watch(healthy(100))) is None


def test_what_drifts_off_does_not_scatter():
    rows = healthy(60) + np.arange(60)[:, np.newaxis]
    assert watch(rows).evidence()[0] < 0.7


def test_comes_and_goes():
    rows = healthy(5 * OFF_LIMIT)
    rows[::5] += 6.0
    assert watch(rows).evidence()[1] is FaultKind.INTERMITTENT
    once = healthy(5 * OFF_LIMIT)
    once[10:20] += 6.0
    assert watch(once).evidence()[1] is not FaultKind.INTERMITTENT


def test_single_samples_off_now_and_then_are_healthy():
    rows = healthy(3000)
    rows[::15] += 6.0
    condition, highest = Condition(), 0.0
    for row in rows:
        watch([row], condition)
        highest = max(highest, condition.evidence()[0])
    assert highest < 1.0


def test_old_outliers_are_forgotten():
    rows = healthy(5 * OFF_LIMIT)
    rows[::5] += 6.0
    condition = watch(rows)
    watch(healthy(OFF_MEMORY + 30, seed=3), condition)
    assert condition.evidence()[0] < 0.7


def test_cleared_it_begins_anew_but_still_sees_what_repeats():
    condition = watch(6.0 * healthy(40))
    condition.clear()
    assert condition.evidence()[0] < 0.3
    repeating(condition, 10.0, STUCK_SAMPLES - 1)
    condition.clear()
    repeating(condition, 10.0, 1)
    assert condition.evidence() == (2.0, FaultKind.STUCK)


def test_a_depth_has_one_component():
    condition = Condition()
    for number in range(10):
        condition.update((20.0,), depth_innovation(float(number), 0.5))
    assert condition.evidence() == (2.0, FaultKind.STUCK)

from math import isfinite

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.speed.evidence import FAULT_AT, NOTHING_AT, Evidence, Weight, weigh
from detectors.verdict import Level

LOW, HIGH = 0.8, 1.2


def weight(deviations, uncertain=False):
    return Weight(deviations, uncertain)


def until(evidence, level, one, interval_s, most_s=600.0):
    """Seconds of the same weight until the level is reached; None if it never is."""
    for number in range(1, round(most_s / interval_s) + 1):
        evidence.take(one, interval_s)
        if evidence.level is level:
            return number * interval_s
    return None


def faulty():
    evidence = Evidence()
    until(evidence, Level.FAULT, weight(4.0), 0.1)
    return evidence


@pytest.mark.parametrize(
    ("ratio", "sign"), [(1.0, -1.0), (0.85, -1.0), (1.15, -1.0), (0.75, 1.0), (1.25, 1.0), (-0.3, 1.0)]
)
def test_deviations_are_counted_from_the_nearer_limit_outwards(ratio, sign):
    assert weigh(ratio, 0.05, LOW, HIGH).deviations * sign > 0.0
    assert weigh(0.8 - 0.05, 0.05, LOW, HIGH).deviations == pytest.approx(1.0, rel=0.1)
    assert weigh(1.2 + 0.15, 0.05, LOW, HIGH).deviations == pytest.approx(2.0, rel=0.1)  # takes more


def test_a_speed_that_is_known_exactly_is_not_infinitely_many_deviations_off():
    assert isfinite(weigh(0.5, 0.0, LOW, HIGH).deviations)


def test_an_error_as_wide_as_the_range_is_uncertain():
    assert not weigh(1.0, 0.1, LOW, HIGH).uncertain
    assert weigh(1.0, 0.3, LOW, HIGH).uncertain
    assert weigh(1.0, float("inf"), LOW, HIGH).uncertain


@pytest.mark.parametrize("interval_s", [0.02, 0.1, 0.5])
def test_three_deviations_take_about_a_second_at_any_rate(interval_s):
    assert until(Evidence(), Level.FAULT, weight(3.0), interval_s) == pytest.approx(1.0, abs=0.51)


def test_the_farther_off_the_sooner_and_a_little_off_is_never_a_fault():
    a_little = NOTHING_AT + np.array([0.2, 0.5, 1.0, 2.0])
    times = [until(Evidence(), Level.FAULT, weight(deviations), 0.1) for deviations in a_little.tolist()]
    assert times == sorted(times, reverse=True)
    assert times[0] > times[-1]
    assert until(Evidence(), Level.FAULT, weight(0.95 * NOTHING_AT), 0.1) is None


@pytest.mark.parametrize("interval_s", [0.1, 1.0, 5.0, 1000.0])
def test_one_estimate_is_no_fault_however_far_off_and_however_seldom(interval_s):
    evidence = Evidence()
    evidence.take(weight(1e6), interval_s)
    assert evidence.level < Level.FAULT
    evidence.take(weight(-3.0), interval_s)
    assert evidence.level is Level.NORMAL


def test_a_suspicion_comes_before_a_fault_and_goes_again():
    evidence = Evidence()
    assert until(evidence, Level.SUSPECT, weight(2.5), 0.1) is not None
    assert 0.0 < evidence.score < 1.0
    assert until(evidence, Level.NORMAL, weight(-1.0), 0.1) is not None
    assert evidence.score < 0.5


def test_the_score_of_a_fault_is_one_or_more():
    assert faulty().score >= 1.0
    assert faulty().level is Level.FAULT


def test_a_fault_stays_while_the_speed_is_only_just_back_and_ends_when_it_is_well_inside():
    evidence = faulty()
    evidence.take(weight(-0.5), 0.1)
    assert evidence.level is Level.FAULT
    assert until(evidence, Level.NORMAL, weight(-4.0), 0.1) < 10.0
    assert evidence.score == 0.0


def test_after_hours_of_fault_it_ends_as_soon_as_after_a_minute():
    times = []
    for seconds in (60, 36000):
        evidence = Evidence()
        for _ in range(seconds):
            evidence.take(weight(6.0), 1.0)
        times.append(until(evidence, Level.NORMAL, weight(-3.0), 0.1))
    assert times[0] == times[1]


def test_what_is_not_known_speaks_neither_for_nor_against():
    healthy, broken = Evidence(), faulty()
    score = broken.score
    for _ in range(100):
        healthy.take(weight(0.9, uncertain=True), 0.1)
        broken.take(weight(-0.9, uncertain=True), 0.1)
    assert (healthy.level, healthy.score) == (Level.UNKNOWN, 0.0)
    assert (broken.level, broken.score) == (Level.FAULT, score)


def test_a_best_guess_outside_the_range_is_not_called_normal():
    evidence = Evidence()
    evidence.take(weight(1.0), 0.1)
    assert evidence.level is Level.UNKNOWN


def test_without_anything_to_hold_on_to_a_fault_stays_and_a_suspicion_goes():
    suspicious, broken = Evidence(), faulty()
    until(suspicious, Level.SUSPECT, weight(2.5), 0.1)
    for evidence in (suspicious, broken):
        evidence.nothing()
    assert (suspicious.level, suspicious.score) == (Level.UNKNOWN, 0.0)
    assert broken.level is Level.FAULT


def test_cleared_it_is_as_new():
    evidence = faulty()
    evidence.clear()
    assert (evidence.level, evidence.score) == (Level.UNKNOWN, 0.0)
    assert until(evidence, Level.FAULT, weight(3.0), 0.1) == until(Evidence(), Level.FAULT, weight(3.0), 0.1)


weights = st.builds(Weight, st.floats(-1e9, 1e9), st.booleans())


@given(st.lists(st.tuples(weights, st.floats(1e-3, 20.0)), max_size=60))
def test_score_and_level_agree_whatever_comes(taken):
    evidence = Evidence()
    for one, interval_s in taken:
        before = evidence.level
        evidence.take(one, interval_s)
        level = evidence.level
        assert 0.0 <= evidence.score * FAULT_AT < 1e3
        if evidence.score >= 1.0:
            assert level is Level.FAULT
        elif before is not Level.FAULT:
            assert level is not Level.FAULT

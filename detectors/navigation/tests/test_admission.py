from dataclasses import replace
from math import inf, nan

import pytest

from detectors.navigation.admission import LARGEST, SILENT_INTERVALS, SILENT_S, Admission, numbers_of
from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample, ImuSample

SAMPLES = (
    ImuSample(1.0, (0.1, 0.2, -9.8), (0.01, 0.02, 0.03)),
    DvlSample(1.0, (1.0, 0.1, -0.1)),
    DepthSample(1.0, 20.0),
    FixSample(1.0, 0.5, 0.6),
    AttitudeSample(1.0, (0.1, 0.2, 3.0)),
)
NUMBERS = ((0.1, 0.2, -9.8, 0.01, 0.02, 0.03), (1.0, 0.1, -0.1), (20.0,), (0.5, 0.6), (0.1, 0.2, 3.0))
KINDS = [type(sample).__name__ for sample in SAMPLES]


def with_number(sample, place, value):
    """The sample with one of its numbers replaced."""
    changed = list(numbers_of(sample))
    changed[place] = value
    match sample:
        case ImuSample():
            return ImuSample(sample.time_s, tuple(changed[:3]), tuple(changed[3:]))
        case DepthSample() | FixSample():
            return type(sample)(sample.time_s, *changed)
        case _:
            return type(sample)(sample.time_s, tuple(changed))


@pytest.mark.parametrize(("sample", "numbers"), list(zip(SAMPLES, NUMBERS, strict=True)), ids=KINDS)
def test_all_that_a_sample_says_is_looked_at(sample, numbers):
    assert numbers_of(sample) == numbers
    for place in range(len(numbers)):
        for value, cause in ((nan, "not finite"), (-inf, "not finite"), (-1.01 * LARGEST, "out of range")):
            admission = Admission()
            assert not admission.admits(with_number(sample, place, value))
            assert admission.refused == {cause: 1}
            assert not admission.heard(type(sample))


@pytest.mark.parametrize("sample", SAMPLES, ids=KINDS)
def test_samples_of_a_kind_come_in_the_order_of_their_times(sample):
    admission = Admission()
    assert admission.admits(sample)
    for late_s in (0.0, 0.5):
        assert not admission.admits(replace(sample, time_s=1.0 - late_s))
    assert not admission.admits(replace(sample, time_s=nan))
    assert admission.refused == {"late or repeated": 2, "not finite": 1}
    assert admission.admits(replace(sample, time_s=1.0 + 1e-9))


def test_each_kind_has_an_order_of_its_own():
    admission = Admission()
    for number, sample in enumerate(SAMPLES):
        assert admission.admits(replace(sample, time_s=10.0 - number))
    assert not admission.refused


def heard_every(interval_s, count=50):
    admission = Admission()
    for number in range(count):
        admission.admits(DepthSample(number * interval_s, 5.0 + 0.01 * number))
    return admission, (count - 1) * interval_s


@pytest.mark.parametrize(("interval_s", "patience_s"), [(0.1, SILENT_S), (2.0, SILENT_INTERVALS * 2.0)])
def test_silent_after_some_seconds_and_some_intervals(interval_s, patience_s):
    admission, last_s = heard_every(interval_s)
    assert not admission.silent(DepthSample, last_s + 0.99 * patience_s)
    assert admission.silent(DepthSample, last_s + 1.01 * patience_s)


def test_a_pause_does_not_make_patient():
    admission, last_s = heard_every(0.1)
    admission.admits(DepthSample(last_s + 1000.0, 5.0))
    assert admission.silent(DepthSample, last_s + 1000.0 + 1.1 * SILENT_S)


def test_what_was_never_heard_is_not_silent():
    admission, last_s = heard_every(0.1)
    assert not admission.heard(DvlSample)
    assert not admission.silent(DvlSample, last_s + 1e6)

"""What holds for every detector, whatever it watches."""

import pickle
from dataclasses import FrozenInstanceError, replace
from math import inf, isfinite, nan

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from detectors.tests.subjects import SUBJECTS, all_bits, bits
from detectors.verdict import Level, Verdict

pytestmark = pytest.mark.parametrize("subject", SUBJECTS, ids=lambda subject: subject.name)


def test_a_fault_is_found_and_a_healthy_series_is_not_one(subject):
    assert max(verdict.level for verdict in subject.judge(subject.make(), subject.healthy)) == Level.NORMAL
    assert subject.verdicts[-1].level is Level.FAULT
    first = next(verdict for verdict in subject.verdicts if verdict.level is Level.FAULT)
    assert first.score >= 1.0


def test_says_verdicts_of_each_sample(subject):
    for sample, verdict in zip(subject.faulty, subject.verdicts, strict=True):
        assert isinstance(verdict, Verdict)
        assert verdict.time_s == sample.time_s
        assert type(verdict.level) is Level
        assert isfinite(verdict.score)
        assert verdict.score >= 0.0
    with pytest.raises(FrozenInstanceError):
        verdict.level = Level.NORMAL


def test_silent_while_learning(subject):
    verdicts = subject.judge(subject.make(), subject.healthy)
    assert {verdict.level for verdict in verdicts[: subject.warmup]} == {Level.UNKNOWN}
    assert Level.NORMAL in {verdict.level for verdict in verdicts}


def test_replay_is_identical(subject):
    detector = subject.make()
    assert all_bits(map(detector.update, subject.faulty)) == all_bits(subject.verdicts)


def test_pickled_and_resumed_it_goes_on_bit_for_bit(subject):
    cuts = set(np.random.default_rng(0).integers(0, len(subject.faulty), 40).tolist())
    detector, said = subject.make(), []
    for number, sample in enumerate(subject.faulty):
        if number in cuts:
            detector = pickle.loads(pickle.dumps(detector))  # noqa: S301
        said.append(bits(detector.update(sample)))
    assert said == all_bits(subject.verdicts)


def test_a_pickled_copy_does_not_share_what_the_original_learns(subject):
    half = len(subject.faulty) - 100
    original = subject.make()
    subject.judge(original, subject.faulty[:half])
    copy = pickle.loads(pickle.dumps(original))  # noqa: S301
    subject.judge(original, subject.healthy[half:])
    assert all_bits(subject.judge(copy, subject.faulty[half:])) == all_bits(subject.verdicts[half:])


def with_value(sample, name, value):
    """The sample with another value of a field; with another last component, where it has several."""
    was = getattr(sample, name)
    return replace(sample, **{name: (*was[:-1], value) if isinstance(was, tuple) else value})


def spoilt(subject, number):
    """Samples to be refused, offered just after this one was taken."""
    sample, first = subject.faulty[number], subject.healthy[0]
    names = [name for name in subject.measured if hasattr(sample, name)]
    bad = [with_value(sample, name, value) for name in names for value in (nan, inf, -inf)]
    return [*bad, sample, replace(subject.healthy[number], time_s=sample.time_s), first]


def test_refused_samples_change_nothing_and_are_counted(subject):
    rng = np.random.default_rng(1)
    detector, untouched, said, offered = subject.make(), subject.make(), [], 0
    subject.judge(untouched, subject.faulty)
    for number, sample in enumerate(subject.faulty):
        verdict = detector.update(sample)
        said.append(bits(verdict))
        if rng.random() < 0.2:
            for refused in spoilt(subject, number):
                stands = detector.update(refused)
                assert bits(stands)[0] == bits(verdict)[0]  # the last verdict, of the last sample taken
                assert (stands.level, stands.score) == (verdict.level, verdict.score)
                offered += 1
    assert said == all_bits(subject.verdicts)
    assert detector.refused.total() - untouched.refused.total() == offered > 500


def test_refused_samples_do_not_clear_a_fault(subject):
    detector = subject.make()
    subject.judge(detector, subject.faulty)
    refused = spoilt(subject, len(subject.faulty) - 1)
    for _ in range(100):
        assert {detector.update(sample).level for sample in refused} == {Level.FAULT}
    assert detector.update(subject.still_faulty[0]).level is Level.FAULT


def test_an_operator_can_accept_a_change_for_good(subject):
    detector = subject.make()
    subject.judge(detector, subject.faulty)
    detector.accept()
    verdicts = subject.judge(detector, subject.still_faulty)
    assert {verdict.level for verdict in verdicts[100:]} <= {Level.NORMAL, Level.UNKNOWN}


def changed(subject, change):
    return subject.judge(subject.make(), [change(sample) for sample in subject.faulty])


def test_what_must_not_matter_does_not(subject):
    expected = [(verdict.level, verdict.score) for verdict in subject.verdicts]
    for name, change in subject.exactly.items():
        assert [(verdict.level, verdict.score) for verdict in changed(subject, change)] == expected, name


def test_what_matters_by_rounding_only_leaves_the_levels(subject):
    expected = [verdict.level for verdict in subject.verdicts]
    for name, change in subject.nearly.items():
        assert [verdict.level for verdict in changed(subject, change)] == expected, name


extreme = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e-308, 1e300, -1e300, 1e15, -1e15, 65535.0, inf, nan]),
    st.floats(),
)


@settings(max_examples=5, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@example(palette=[0.0], seed=0, noisy=False)
@given(palette=st.lists(extreme, min_size=1, max_size=6), seed=st.integers(0, 99), noisy=st.booleans())
def test_no_data_raises_or_is_a_fault_while_learning(subject, palette, seed, noisy):
    rng = np.random.default_rng(seed)
    count = subject.warmup + 150
    rows = rng.choice(np.array(palette), (count, 8))
    if noisy:
        ordinary = rng.random((count, 8)) < 0.7
        rows = np.where(ordinary, rng.normal(0.0, 1000.0, (count, 8)), rows)
    detector = subject.make()
    verdicts = [detector.update(subject.garbage(subject.interval_s * number, row)) for number, row in enumerate(rows)]
    assert {verdict.level for verdict in verdicts[: subject.warmup]} == {Level.UNKNOWN}
    assert all(isfinite(verdict.score) for verdict in verdicts)


@pytest.mark.parametrize("scale", [1.0, 1e300])
def test_random_garbage_raises_nothing(subject, scale):
    rows = np.random.default_rng(7).normal(0.0, 1.0, (1500, 8)) * scale
    samples = [subject.garbage(subject.interval_s * number, row) for number, row in enumerate(rows)]
    assert all(isfinite(verdict.score) for verdict in subject.judge(subject.make(), samples))


def test_senseless_times_raise_nothing(subject):
    rng = np.random.default_rng(3)
    times = rng.choice([-1.0, 1.0], len(subject.faulty)) * 10.0 ** rng.uniform(-300, 300, len(subject.faulty))
    detector = subject.make()
    subject.judge(detector, [replace(s, time_s=t) for s, t in zip(subject.faulty, times.tolist(), strict=True)])
    assert detector.refused.total() > 0.5 * len(subject.faulty)

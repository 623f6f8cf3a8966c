import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_model import ACCELEROMETER_BIAS, GYROSCOPE_BIAS
from detectors.navigation.innovation import Innovation
from detectors.navigation.installation import ALL_STATES, SCALE
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.ratio import (
    FAMILIES,
    ONSET_S,
    SAMPLE_LIMIT,
    SAMPLE_LIMIT_RATE,
    LikelihoodRatio,
)
from detectors.navigation.sample import DepthSample, DvlSample, FaultKind, FixSample, ImuSample, Sensor
from detectors.navigation.tests.dives import Dive, changed_depth, changed_dvl, changed_imu

# the noise is known, so that it is not learnt from a fault, and the mounting, so that the filter is nearly linear
CONFIG = NavigationConfig(estimate_installation=False)


def weaving(time_s):
    """Gentle curves, faster and slower: little noise, and yet a wrong scale is no offset."""
    t, still = time_s, np.zeros_like(time_s)
    return np.array(
        [still, 0.05 * np.sin(0.2 * t), 0.4 * np.sin(0.12 * t), 1.3 + 0.4 * np.sin(0.2 * t), still, still]
    )


DIVE = Dive(motion=weaving, duration_s=60.0, imu_hz=20.0, seed=3)
NEXT_S = 0.075  # a measurement is compared after the next inertial sample
BEGIN_S, ONSET, END_S = 20.0, 30.0, 42.0  # of what the ratio sees, of the fault, and of it all

SIZES = {
    (Sensor.DVL, FaultKind.STEP): (0.15, -0.12, 0.05),
    (Sensor.DVL, FaultKind.DRIFT): (0.02, 0.03, 0.01),
    (Sensor.DVL, FaultKind.SCALE): (0.15, 0.0, 0.0),
    (Sensor.DEPTH, FaultKind.STEP): (0.5, 0.0, 0.0),
    (Sensor.DEPTH, FaultKind.DRIFT): (0.1, 0.0, 0.0),
    (Sensor.ACCELEROMETER, FaultKind.STEP): (0.08, 0.1, -0.05),
    (Sensor.GYROSCOPE, FaultKind.STEP): (0.004, -0.003, 0.0),
}
NAMES = [f"{family.sensor} {family.kind}" for family in FAMILIES]


def spoilt(samples, family, size, onset_s=ONSET):
    """With a fault of this family."""
    x, y, z = size
    match family.sensor, family.kind:
        case Sensor.DVL, FaultKind.STEP:
            return changed_dvl(samples, lambda age_s, velocity: velocity + size, since_s=onset_s)
        case Sensor.DVL, FaultKind.DRIFT:
            drift = np.array(size)
            return changed_dvl(samples, lambda age_s, velocity: velocity + drift * (age_s + ONSET_S), since_s=onset_s)
        case Sensor.DVL, FaultKind.SCALE:
            return changed_dvl(samples, lambda age_s, velocity: velocity * (1.0 + x), since_s=onset_s)
        case Sensor.DEPTH, FaultKind.STEP:
            return changed_depth(samples, lambda age_s, depth_m: depth_m + x, since_s=onset_s)
        case Sensor.DEPTH, FaultKind.DRIFT:
            return changed_depth(samples, lambda age_s, depth_m: depth_m + x * (age_s + ONSET_S), since_s=onset_s)
        case Sensor.ACCELEROMETER, _:
            return changed_imu(samples, since_s=onset_s + NEXT_S, force_mps2=(x, y, z))
        case _:
            return changed_imu(samples, since_s=onset_s + NEXT_S, rate_radps=(x, y, z))


def innovations(samples):
    navigation = IntegratedFilter(CONFIG, DIVE.initial)
    found = []
    for sample in samples:
        if isinstance(sample, ImuSample):
            found += navigation.advance(sample)
        else:
            navigation.measure(sample)
    return found


@cache
def samples():
    return [sample for sample in DIVE.samples() if sample.time_s <= END_S]


@cache
def healthy():
    return innovations(samples())


@cache
def with_fault(family, size):
    return innovations(spoilt(samples(), family, size))


def watched(found, since_s=BEGIN_S):
    ratio = LikelihoodRatio()
    for one in found:
        if one.time_s >= since_s:
            ratio.update(one)
    return ratio


def explanation_of(sensor, found):
    return next(one for one in watched(found, 0.0).explanations() if one.family.sensor is sensor)


def linear_system(count=60, seed=5):
    """Any system: (kind, time, transition, process, observation, noise, used) of each measurement, two or three a
    second."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        for kind, size in ((DvlSample, 3), (DepthSample, 1), (FixSample, 2)):
            if number % size:
                continue
            same_time = kind is not DvlSample
            changes = np.zeros((ALL_STATES, ALL_STATES)) if same_time else 0.02 * rng.normal(size=(ALL_STATES,) * 2)
            process = np.zeros((ALL_STATES, ALL_STATES)) if same_time else 0.02 * np.eye(ALL_STATES)
            observation = rng.normal(size=(size, ALL_STATES))
            noise = np.diag(rng.uniform(0.5, 2.0, size))
            used = rng.random() < 0.9
            yield kind, 0.5 * number, np.eye(ALL_STATES) + changes, process, observation, noise, used


def measured(kind, time_s, values):
    match len(values):
        case 3:
            return DvlSample(time_s, tuple(values))
        case 1:
            return DepthSample(time_s, values[0])
        case _:
            return FixSample(time_s, 0.0, 0.0)


def textbook_filter(fault=None, onset_s=15.0, *, noisy=True):
    """Innovations of a Kalman filter on that system, with a fault of unit size: (family, component)."""
    rng, silent = np.random.default_rng(6), np.zeros(3)
    truth, estimate, covariance = np.zeros(ALL_STATES), np.zeros(ALL_STATES), np.eye(ALL_STATES)
    begun, found = False, []
    for kind, time_s, transition, process, observation, noise, used in linear_system():
        pushed = np.sqrt(process) @ rng.normal(size=ALL_STATES) if noisy else np.zeros(ALL_STATES)
        truth, estimate = transition @ truth + pushed, transition @ estimate
        covariance = transition @ covariance @ transition.T + process
        if fault is not None and not begun and time_s >= onset_s:
            begun = True
            jump = {Sensor.ACCELEROMETER: ACCELEROMETER_BIAS.start, Sensor.GYROSCOPE: GYROSCOPE_BIAS.start}
            place = jump.get(fault[0].sensor, SCALE if fault[0].kind is FaultKind.SCALE else None)
            if place is not None:
                truth[place + fault[1]] += 1.0
        values = observation @ truth + (
            np.sqrt(noise) @ rng.normal(size=len(noise)) if noisy else silent[: len(noise)]
        )
        if begun and kind is {Sensor.DVL: DvlSample, Sensor.DEPTH: DepthSample}.get(fault[0].sensor):
            grown = {FaultKind.STEP: 1.0, FaultKind.DRIFT: time_s - onset_s + ONSET_S}.get(fault[0].kind, 0.0)
            values[fault[1]] += grown
        expected = observation @ covariance @ observation.T + noise
        gain = covariance @ observation.T @ np.linalg.inv(expected) if used else None
        off = values - observation @ estimate
        found.append(
            Innovation(measured(kind, time_s, off), off, expected, observation, transition, process, gain, noise)
        )
        if gain is not None:
            estimate = estimate + gain @ off
            covariance = covariance - gain @ observation @ covariance
    return found


def with_fault_of(family, size):
    base = textbook_filter()
    for component in range(family.components):
        unit = textbook_filter((family, component), noisy=False)
        base = [replace(one, values=one.values + size * more.values) for one, more in zip(base, unit, strict=True)]
    return base


def evidence_at_once(family, found, onset_s):
    """Twice the logarithm of the likelihood ratio, and the size, (C,): from all innovations since the onset."""
    units = [textbook_filter((family, component), onset_s, noisy=False) for component in range(family.components)]
    traces, values, last_s = [], [], {}
    for number, one in enumerate(found):
        kind = type(one.measurement)
        limit = np.clip(SAMPLE_LIMIT_RATE * (one.time_s - last_s.get(kind, one.time_s - 1.0)), *SAMPLE_LIMIT)
        last_s[kind] = one.time_s
        if one.time_s < onset_s:
            continue
        root = np.linalg.cholesky(one.covariance * max(1.0, one.squared / limit))
        traces.append(np.linalg.solve(root, np.array([unit[number].values for unit in units]).T))
        values.append(np.linalg.solve(root, one.values))
    traces, values = np.concatenate(traces), np.concatenate(values)
    prior = family.size**2 * np.eye(family.components)
    spread = np.eye(len(values)) + traces @ prior @ traces.T
    explained = np.linalg.solve(spread, values)
    ratio = values @ values - values @ explained - np.linalg.slogdet(spread)[1]
    return ratio, prior @ traces.T @ explained


@pytest.mark.parametrize("family", FAMILIES, ids=NAMES)
def test_equals_the_evidence_of_all_innovations_at_once(family):
    """A fault's trace is the difference of two filters' innovations, one with it and one without."""
    found = with_fault_of(family, 20.0 * family.size)
    explanation = explanation_of(family.sensor, found)
    ratio, size = evidence_at_once(explanation.family, found, explanation.onset_s)
    assert explanation.ratio == pytest.approx(ratio, rel=1e-9)
    np.testing.assert_allclose(explanation.size[: explanation.family.components], size, rtol=1e-9)


@pytest.mark.parametrize("family", FAMILIES, ids=NAMES)
def test_each_fault_is_its_own_best_explanation(family):
    size = SIZES[family.sensor, family.kind]
    ratio = watched(with_fault(family, size))
    best = max(ratio.explanations(), key=lambda one: one.weight)
    assert best.family is family
    assert best.ratio > 30.0
    assert best.onset_s == pytest.approx(ONSET, abs=3.0)
    seen = 2 if family.sensor is Sensor.GYROSCOPE else 3  # without a compass its third axis shows in nothing
    np.testing.assert_allclose(best.size[:seen], size[:seen], atol=0.35 * np.linalg.norm(size))
    assert ratio.ratios()[FAMILIES.index(family)] == best.ratio


@pytest.mark.parametrize("family", FAMILIES, ids=NAMES)
def test_says_how_large_the_error_is_now(family):
    size = np.array(SIZES[family.sensor, family.kind])
    explanations = watched(with_fault(family, tuple(size))).explanations()
    found = next(one for one in explanations if one.family is family)
    if family.kind is FaultKind.DRIFT:
        size = size * (END_S - ONSET + ONSET_S)
    elif family.kind is FaultKind.SCALE:
        size = 0.0 * size
    if family.sensor is Sensor.DEPTH:
        size = np.roll(size, 2)
    seen = 2 if family.sensor is Sensor.GYROSCOPE else 3
    np.testing.assert_allclose(found.size_now[:seen], size[:seen], atol=0.4 * np.linalg.norm(size) + 1e-12)


def test_nothing_explains_what_is_healthy():
    assert watched(healthy()).ratios().max() < 15.0


def test_a_single_outlier_is_no_fault():
    once = changed_dvl(samples(), lambda age_s, velocity: velocity + 3.0 * (age_s < 0.1), since_s=ONSET)
    once = changed_depth(once, lambda age_s, depth_m: depth_m + 30.0 * (age_s < 0.1), since_s=ONSET + 4.0)
    assert watched(innovations(once)).ratios().max() < 22.0


def test_what_does_not_count_is_no_evidence():
    with_it, without = LikelihoodRatio(), LikelihoodRatio()
    for one in with_fault(FAMILIES[0], SIZES[Sensor.DVL, FaultKind.STEP]):
        if one.time_s >= BEGIN_S:
            with_it.update(one)
            without.update(one, counts=not isinstance(one.measurement, DvlSample))
    assert with_it.ratios()[0] > 30.0
    assert without.ratios()[0] < 15.0


def test_new_and_cleared_it_knows_nothing():
    ratio = watched(with_fault(FAMILIES[0], SIZES[Sensor.DVL, FaultKind.STEP]))
    assert ratio.ratios().max() > 30.0
    ratio.clear()
    for empty in (ratio, LikelihoodRatio()):
        assert empty.explanations() == []
        np.testing.assert_array_equal(empty.ratios(), np.zeros(len(FAMILIES)))


@pytest.mark.parametrize(
    "number", [0, 1, 5, 6], ids=["dvl step", "dvl drift", "accelerometer step", "gyroscope step"]
)
def test_consequences_are_what_the_filter_errs_by(number):
    """Beside the same dive without the fault."""
    family = FAMILIES[number]
    size = SIZES[family.sensor, family.kind]
    ends = []
    for dived in (samples(), spoilt(samples(), family, size)):
        navigation = IntegratedFilter(CONFIG, DIVE.initial)
        found = []
        for sample in dived:
            if isinstance(sample, ImuSample):
                found += navigation.advance(sample)
            else:
                navigation.measure(sample)
        strapdown = navigation.strapdown
        ends.append(
            np.array([*strapdown.velocity_mps, *strapdown.accelerometer_bias_mps2, *strapdown.gyroscope_bias_radps])
        )
    ratio = watched(found)
    explanation = next(one for one in ratio.explanations() if one.family is family)
    error, covariance = ratio.consequences(explanation)
    truth = ends[0] - ends[1]
    if family.sensor is Sensor.ACCELEROMETER:
        truth[3:6] += size  # what the bias should now be
    elif family.sensor is Sensor.GYROSCOPE:
        truth[6:9] += size
    states = np.concatenate((error[3:6], error[9:15]))
    for part in (slice(0, 3), slice(3, 6), slice(6, 8)):
        np.testing.assert_allclose(states[part], truth[part], atol=0.35 * np.abs(truth[part]).max() + 2e-3)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9


def test_old_onsets_are_thinned_out_and_forgotten():
    """It follows no more of them, however long a dive is, and still knows of a fault of a minute ago."""
    ratio, sizes = LikelihoodRatio(), []
    for one in healthy() * 4:
        ratio.update(one)
        sizes.append(len(pickle.dumps(ratio)))
    assert max(sizes) < 400_000


def test_pickled_it_goes_on_bit_for_bit():
    found = [one for one in with_fault(FAMILIES[1], SIZES[Sensor.DVL, FaultKind.DRIFT]) if one.time_s >= BEGIN_S]
    whole, parts = LikelihoodRatio(), LikelihoodRatio()
    for number, one in enumerate(found):
        whole.update(one)
        parts.update(one)
        if number % 7 == 0:
            parts = pickle.loads(pickle.dumps(parts))  # noqa: S301
    said = [[(one.family, one.ratio, one.size) for one in each.explanations()] for each in (parts, whole)]
    assert said[0] == said[1] != []
    np.testing.assert_array_equal(parts.ratios(), whole.ratios())

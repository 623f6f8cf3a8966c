import pickle
from dataclasses import replace
from functools import cache
from math import isfinite

import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.detector import NavigationDetector
from detectors.navigation.sample import DepthSample, DvlSample, FaultKind, ImuSample, Sensor
from detectors.navigation.settling import SETTLING_S
from detectors.navigation.tests.dives import Dive, Mounting, changed_depth, changed_dvl, changed_imu, legs
from detectors.verdict import Level

# as a second dive finds it: the mounting is known
KNOWN = NavigationConfig(estimate_installation=False)
ONSET_S, END_S = 70.0, 125.0
DIVE = Dive(motion=legs, duration_s=END_S, imu_hz=20.0, seed=1)


@cache
def series():
    """Samples before the onset, and after it."""
    samples = DIVE.samples()
    return tuple(tuple(one for one in samples if (one.time_s < ONSET_S) is before) for before in (True, False))


@cache
def healthy_until_onset(config=KNOWN):
    """A detector at the onset, pickled."""
    detector = NavigationDetector(config, DIVE.initial)
    for sample in series()[0]:
        detector.update(sample)
    return pickle.dumps(detector)


def verdicts_of(samples, config=KNOWN):
    """From the onset on."""
    detector = pickle.loads(healthy_until_onset(config))  # noqa: S301
    return [detector.update(sample) for sample in samples]


def dvl(change):
    return changed_dvl(series()[1], change, since_s=ONSET_S)


@cache
def with_dvl_fault(name, config=KNOWN):
    return tuple(verdicts_of(dvl(DVL_FAULTS[name][2]), config))


@cache
def with_depth_fault(name):
    return tuple(verdicts_of(depth(DEPTH_FAULTS[name][2])))


@cache
def with_jump(name):
    return tuple(verdicts_of(changed_imu(series()[1], since_s=ONSET_S, **JUMPS[name][2])))


def depth(change):
    return changed_depth(series()[1], change, since_s=ONSET_S)


def metres_off(verdict):
    truth, state = DIVE.truth(verdict.time_s), verdict.state
    north_m = 6.37e6 * (state.latitude_rad - truth.latitude_rad)
    east_m = 6.37e6 * np.cos(truth.latitude_rad) * (state.longitude_rad - truth.longitude_rad)
    return float(np.hypot(north_m, east_m))


def speed_off(verdict):
    return float(np.linalg.norm(np.subtract(verdict.state.velocity_mps, DIVE.truth(verdict.time_s).velocity_mps)))


def first_fault(verdicts, sensor):
    """Seconds after the onset at which a sensor alone is said to be faulty, and that verdict."""
    found = next(one for one in verdicts if one.of(sensor).level is Level.FAULT)
    return found.time_s - ONSET_S, found


def noisy(age_s, velocity):
    return velocity + 0.4 * np.random.default_rng(round(1000.0 * age_s)).normal(size=3)


OFFSET, AHEAD = np.array([0.5, 0.3, 0.0]), np.array([1.0, 0.0, 0.0])
# kind that is said first, seconds within which it is found, and the change of the velocity
DVL_FAULTS = {
    "step": (FaultKind.STEP, 4.0, lambda age_s, velocity: velocity + OFFSET),
    "drift": (FaultKind.DRIFT, 10.0, lambda age_s, velocity: velocity + 0.04 * age_s * AHEAD),
    "stuck": (FaultKind.STUCK, 4.0, lambda age_s, velocity: np.array([1.5, 0.0, 0.2])),
    "zero": (FaultKind.STUCK, 4.0, lambda age_s, velocity: np.zeros(3)),
    "scale": (FaultKind.SCALE, 5.0, lambda age_s, velocity: 1.4 * velocity),
    "noise": (FaultKind.NOISE, 15.0, noisy),
}
DEPTH_FAULTS = {
    "step": (FaultKind.STEP, 3.0, lambda age_s, depth_m: depth_m + 2.0),
    "drift": (FaultKind.DRIFT, 8.0, lambda age_s, depth_m: depth_m + 0.2 * age_s),
    "stuck": (None, 20.0, lambda age_s, depth_m: 31.0),
}


@pytest.mark.parametrize("name", DVL_FAULTS)
def test_a_fault_of_the_dvl_is_found_named_and_isolated(name):
    kind, within_s, _ = DVL_FAULTS[name]
    verdicts = with_dvl_fault(name)
    took_s, verdict = first_fault(verdicts, Sensor.DVL)
    assert took_s <= within_s
    assert verdict.level is Level.FAULT
    assert verdict.score >= 1.0
    assert verdict.isolated == ("dvl",)
    assert verdict.of(Sensor.DVL).kind is kind
    assert f"dvl {kind}" in {one.reason for one in verdicts[verdicts.index(verdict) :]}
    assert all(verdict.of(one).level is not Level.FAULT for one in Sensor if one is not Sensor.DVL)


@pytest.mark.parametrize("name", DEPTH_FAULTS)
def test_a_fault_of_the_depth_sensor_is_found_named_and_isolated(name):
    kind, within_s, _ = DEPTH_FAULTS[name]
    verdicts = with_depth_fault(name)
    took_s, verdict = first_fault(verdicts, Sensor.DEPTH)
    assert took_s <= within_s
    assert verdict.isolated == ("depth",)
    assert kind in (None, verdict.of(Sensor.DEPTH).kind)
    assert {one.of(Sensor.DVL).level for one in verdicts} == {Level.NORMAL}
    assert abs(verdicts[-1].state.depth_m - DIVE.truth(END_S).depth_m) < 0.5


def test_says_how_large_a_step_is_and_how_fast_a_drift_grows():
    step = with_dvl_fault("step")[-1].of(Sensor.DVL)
    np.testing.assert_allclose(step.size, OFFSET, atol=0.3)
    drift = first_fault(with_dvl_fault("drift"), Sensor.DVL)[1].of(Sensor.DVL)
    assert drift.rate == pytest.approx(0.04, rel=0.5)
    sunk = first_fault(with_depth_fault("step"), Sensor.DEPTH)[1].of(Sensor.DEPTH)
    np.testing.assert_allclose(sunk.size, (0.0, 0.0, 2.0), atol=0.4)


@pytest.mark.parametrize("name", ["step", "drift", "stuck"])
def test_isolated_it_stays_close_to_the_truth(name):
    """Thirty seconds without a DVL."""
    verdicts = [one for one in with_dvl_fault(name) if one.time_s <= ONSET_S + 30.0]
    assert speed_off(verdicts[-1]) < 0.5
    assert metres_off(verdicts[-1]) < 3.0 * verdicts[-1].position_error_m < 40.0
    before = verdicts_of(series()[1][:1])[-1]
    assert verdicts[-1].position_error_m > before.position_error_m + 0.5


def test_a_drift_that_goes_on_is_not_let_in_again():
    verdicts = with_dvl_fault("drift")
    found_s, _ = first_fault(verdicts, Sensor.DVL)
    after = [one for one in verdicts if one.time_s > ONSET_S + found_s]
    assert {one.isolated for one in after} == {("dvl",)}
    assert {one.level for one in after} == {Level.FAULT}


@pytest.mark.parametrize("name", ["step", "drift"])
def test_a_sensor_that_is_well_again_is_used_again(name):
    change, ended_s = DVL_FAULTS[name][2], 15.0
    verdicts = verdicts_of(dvl(lambda age_s, velocity: change(age_s, velocity) if age_s < ended_s else velocity))
    last_s = max(one.time_s for one in verdicts if one.isolated) - ONSET_S
    assert ended_s + KNOWN.healthy_s - 1.0 <= last_s <= ended_s + KNOWN.healthy_s + 10.0
    assert verdicts[-1].level is Level.NORMAL
    assert verdicts[-1].reason == ""
    assert speed_off(verdicts[-1]) < 0.4


def test_what_comes_and_goes_stays_isolated():
    change = dvl(lambda age_s, velocity: velocity + 4.0 * OFFSET * (age_s % 12.0 < 6.0))
    verdicts = verdicts_of(change)
    found_s, _ = first_fault(verdicts, Sensor.DVL)
    assert {one.isolated for one in verdicts if one.time_s > ONSET_S + found_s} == {("dvl",)}


JUMPS = {
    "gyroscope": (Sensor.GYROSCOPE, 10.0, {"rate_radps": (0.0, 0.006, 0.0)}),
    "gyroscope's heading": (Sensor.GYROSCOPE, 30.0, {"rate_radps": (0.0, 0.0, 0.03)}),
    "accelerometer ahead": (Sensor.ACCELEROMETER, 15.0, {"force_mps2": (0.3, 0.0, 0.0)}),
    "accelerometer to the right": (Sensor.ACCELEROMETER, 15.0, {"force_mps2": (0.0, 0.3, 0.0)}),
    "accelerometer upwards": (Sensor.ACCELEROMETER, 15.0, {"force_mps2": (0.0, 0.0, -0.3)}),
}


@pytest.mark.parametrize("name", JUMPS)
def test_the_jump_of_an_inertial_sensor_is_found_and_named(name):
    sensor, within_s, _ = JUMPS[name]
    verdicts = with_jump(name)
    took_s, verdict = first_fault(verdicts, sensor)
    assert took_s <= within_s
    assert verdict.of(sensor).kind is FaultKind.STEP
    assert verdict.isolated == ()
    assert verdicts[-1].of(Sensor.DVL).level is Level.NORMAL
    assert speed_off(verdicts[-1]) < 1.0


def test_says_how_large_a_jump_is():
    for name, axis, size in (("gyroscope", 1, 0.006), ("accelerometer ahead", 0, 0.3)):
        sensor = JUMPS[name][0]
        _, verdict = first_fault(with_jump(name), sensor)
        assert verdict.of(sensor).size[axis] == pytest.approx(size, rel=0.6)


def test_what_cannot_be_told_apart_yet_is_unknown():
    """An offset that came a second ago, and not yet whose."""
    first = next(one for one in with_dvl_fault("step") if " or " in one.reason)
    named = first.reason.split(" or ")
    assert set(named) == {"accelerometer", "dvl"}
    assert first.level is Level.FAULT
    assert {first.of(Sensor(sensor)).level for sensor in named} == {Level.UNKNOWN}
    assert first.isolated == ()


@pytest.mark.parametrize("seed", [2, 3])
def test_healthy_dives_are_not_faulty(seed):
    mounting = Mounting(lever_arm_m=(-1.0, 0.1, 0.3), rotation_rad=(0.0, 0.01, -0.01), dvl_delay_s=0.4)
    dive = Dive(duration_s=100.0, imu_hz=20.0, seed=seed, mounting=mounting, fix_hz=0.1)
    detector = NavigationDetector(NavigationConfig(), dive.initial)
    verdicts = [detector.update(sample) for sample in dive.samples()]
    assert Level.FAULT not in {one.level for one in verdicts}
    assert not detector.refused


@pytest.mark.parametrize("name", ["step", "zero"])
def test_on_a_first_dive_a_fault_of_the_dvl_is_found_before_its_mounting_is_known(name):
    """A mounting that nobody told explains much, but not everything."""
    verdicts = with_dvl_fault(name, NavigationConfig())
    took_s, verdict = first_fault(verdicts, Sensor.DVL)
    assert took_s < 12.0
    assert verdict.isolated == ("dvl",)
    assert speed_off(verdicts[-1]) < 1.0


def test_silent_until_the_filter_has_found_itself():
    detector = NavigationDetector(KNOWN, DIVE.initial)
    verdicts = [detector.update(sample) for sample in series()[0]]
    settled_s = next(one.time_s for one in verdicts if one.level is not Level.UNKNOWN)
    assert SETTLING_S <= settled_s <= SETTLING_S + 5.0
    assert verdicts[0].reason == "no sample of the DVL yet"
    waiting = next(one for one in verdicts if one.time_s > 0.5 * SETTLING_S)
    assert waiting.reason == "finding out how the sensors are mounted"
    assert {one.level for one in verdicts if one.time_s > settled_s} == {Level.NORMAL}
    assert {one.reason for one in verdicts if one.time_s > settled_s} == {""}


def test_a_verdict_says_where_the_vehicle_is_and_what_was_measured():
    verdicts = verdicts_of(series()[1])
    for one, sample in zip(verdicts, series()[1], strict=True):
        assert one.time_s == one.state.time_s == sample.time_s
        assert all(map(isfinite, one.innovation))
        assert isfinite(one.position_error_m)
        assert one.score == max(sensor.score for sensor in one.sensors)
        assert {sensor.sensor for sensor in one.sensors} == set(Sensor)
    assert max(speed_off(one) for one in verdicts[::50]) < 0.3
    assert max(metres_off(one) for one in verdicts[::50]) < 8.0


def test_not_to_isolate_it_goes_on_using_what_it_faults():
    config = NavigationConfig(estimate_installation=False, isolate=False)
    verdicts = with_dvl_fault("drift", config)
    assert {one.isolated for one in verdicts} == {()}
    _, verdict = first_fault(verdicts, Sensor.DVL)
    assert verdict.of(Sensor.DVL).kind is FaultKind.DRIFT
    isolating = with_dvl_fault("drift")
    assert metres_off(verdicts[-1]) > 2.0 * metres_off(isolating[-1]) > 0.0


def test_what_the_operator_accepts_is_normal_from_then_on():
    detector = pickle.loads(healthy_until_onset())  # noqa: S301
    faulty = depth(DEPTH_FAULTS["step"][2])
    half = next(number for number, sample in enumerate(faulty) if sample.time_s > ONSET_S + 10.0)
    for sample in faulty[:half]:
        before = detector.update(sample)
    assert before.isolated == ("depth",)
    detector.accept()
    verdicts = [detector.update(sample) for sample in faulty[half:]]
    assert verdicts[0].isolated == ()
    assert {one.level for one in verdicts} <= {Level.UNKNOWN, Level.NORMAL}
    assert verdicts[-1].level is Level.NORMAL


@pytest.mark.parametrize("method", ["chi_square", "cusum", "lstm"])
def test_each_published_method_finds_a_step(method):
    config = NavigationConfig(method=method, isolate=False, estimate_installation=False)
    verdicts = verdicts_of(dvl(lambda age_s, velocity: velocity + 2.0 * OFFSET), config)
    took_s, verdict = first_fault(verdicts, Sensor.DVL)
    assert took_s <= 3.0
    assert verdict.of(Sensor.DVL).kind is FaultKind.UNCLEAR
    assert verdict.statistics[method] >= 1.0
    assert verdict.reason == "dvl unclear"


def test_compared_each_method_says_its_statistic():
    config = NavigationConfig(estimate_installation=False, compare=True)
    quiet, loud = (
        verdicts_of(samples[:200], config)[-1].statistics
        for samples in (series()[1], dvl(lambda age_s, velocity: velocity + 3.0 * OFFSET))
    )
    assert set(quiet) == set(loud) == {"ratio", "chi_square", "cusum", "lstm"}
    assert quiet["chi_square"] < 1.0 < loud["chi_square"]


def without(kind, samples, since_s=ONSET_S):
    return [one for one in samples if not (isinstance(one, kind) and one.time_s >= since_s)]


@pytest.mark.parametrize(
    ("kind", "unknown", "reason"),
    [
        (DvlSample, {Sensor.DVL, Sensor.GYROSCOPE, Sensor.ACCELEROMETER}, "dvl silent"),
        (DepthSample, {Sensor.DEPTH}, "depth silent"),
        (ImuSample, set(Sensor), "imu silent"),
    ],
)
def test_who_is_silent_is_not_judged(kind, unknown, reason):
    last = verdicts_of(without(kind, series()[1]))[-1]
    assert {one.sensor for one in last.sensors if one.level is Level.UNKNOWN} == unknown
    assert reason in last.reason


def test_without_a_depth_sensor_the_dvl_is_judged_all_the_same():
    detector = NavigationDetector(KNOWN, DIVE.initial)
    before, after = series()
    for sample in without(DepthSample, (*before, *dvl(DVL_FAULTS["step"][2])), 0.0):
        verdict = detector.update(sample)
        if verdict.isolated:
            break
    assert after[0].time_s <= verdict.time_s < ONSET_S + 5.0
    assert verdict.of(Sensor.DEPTH).level is Level.UNKNOWN
    assert np.isnan(verdict.innovation[3])


def test_the_epoch_does_not_matter():
    shift_s = 2.0**30
    detector = NavigationDetector(KNOWN, replace(DIVE.initial, time_s=shift_s))
    for sample in series()[0]:
        detector.update(replace(sample, time_s=sample.time_s + shift_s))
    found = None
    for sample in dvl(DVL_FAULTS["drift"][2]):
        verdict = detector.update(replace(sample, time_s=sample.time_s + shift_s))
        if found is None and verdict.isolated:
            found = verdict.time_s - shift_s - ONSET_S
    assert found == pytest.approx(first_fault(with_dvl_fault("drift"), Sensor.DVL)[0], abs=1.5)


def test_what_was_learnt_of_the_mounting_is_there_for_the_next():
    first = pickle.loads(healthy_until_onset())  # noqa: S301
    second = NavigationDetector(NavigationConfig(), DIVE.initial, first.installation)
    np.testing.assert_array_equal(second.installation.values, first.installation.values)

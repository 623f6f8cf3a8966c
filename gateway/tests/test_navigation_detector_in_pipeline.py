"""The real navigation detector in the pipeline: a drifting DVL is found, and the same however the calls are cut."""

import math
import random

import numpy as np
import pytest

from detectors.verdict import Level
from drivers.readings import Attitude, AutopilotHeartbeat, BodyVelocity, Inertial, WaterPressure
from gateway.channel import NavigationJudgement
from gateway.config import parse
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Pipeline
from gateway.tests.conftest import NAVIGATION_WATCH, TWO_THRUSTERS, ThresholdDetector, over_the_disk

START_S = 1.7e9
SPEED_MPS, G = 1.0, 9.80619  # at 45 degrees
FORCE_NOISE_MPS2, RATE_NOISE_RADPS, DVL_NOISE_MPS, DEPTH_NOISE_M = 0.01, 0.001, 0.005, 0.01


def swim(seconds: float, fault_s: float = math.inf, drift_mps2: float = 0.0) -> list[tuple[str, list]]:
    """In wide bends at 1 m/s, level; a DVL at 5 Hz, in the place of the IMU, that drifts from `fault_s` on."""
    chance, yaw, arrivals = np.random.default_rng(11), 0.0, []
    for n in range(round(seconds * 50)):
        at_s, boot_s = START_S + n / 50, 20.0 + n / 50
        rate = 0.12 * math.sin(0.35 * n / 50)
        yaw += rate / 50
        force = np.array([0.0, SPEED_MPS * rate, -G]) + FORCE_NOISE_MPS2 * chance.normal(size=3)
        turning = np.array([0.0, 0.0, rate]) + RATE_NOISE_RADPS * chance.normal(size=3)
        readings: list = [Inertial(at_s, boot_s, "RAW_IMU", tuple(force.tolist()), tuple(turning.tolist()))]
        if n % 5 == 0:
            pressure = 101_325.0 + 1025.0 * 9.80665 * (5.0 + DEPTH_NOISE_M * chance.normal())
            readings += [
                Attitude(at_s, 0.0, 0.0, math.remainder(yaw, math.tau), 0.0, 0.0, rate, boot_s),
                WaterPressure(at_s, boot_s, 2, pressure, None),
            ]
        if n % 10 == 3:
            offset = drift_mps2 * max(n / 50 - fault_s, 0.0)
            velocity = np.array([SPEED_MPS + offset, 0.0, 0.0]) + DVL_NOISE_MPS * chance.normal(size=3)
            readings.append(BodyVelocity(at_s, None, tuple(velocity.tolist()), "VISION_POSITION_DELTA 255.0"))
        if n % 50 == 0:
            readings.append(AutopilotHeartbeat(at_s, 1, 1, 3, 12, True, 19, 4))
        arrivals.append(("mavlink", readings))
    return arrivals


def watching(config) -> Pipeline:
    return Pipeline(config, Factories(thruster=ThresholdDetector))


def play(pipeline: Pipeline, arrivals: list) -> list:
    return [outcome for link, readings in arrivals for outcome in pipeline.feed(link, readings)]


def findings(outcomes: list) -> list[Finding]:
    return [one for one in outcomes if isinstance(one, Finding) and one.detector == "navigation"]


@pytest.fixture(scope="module")
def config_once(tmp_path_factory):
    text = TWO_THRUSTERS + NAVIGATION_WATCH + "[detector.navigation]\nestimate_installation = false"
    return parse(text, tmp_path_factory.mktemp("config"))


@pytest.fixture(scope="module")
def whole(config_once):
    """A dive whose DVL drifts from 40 s on, and what came of it in one piece, each reading by itself."""
    arrivals = swim(60.0, fault_s=40.0, drift_mps2=0.08)
    return arrivals, play(watching(config_once), arrivals)


def test_a_drifting_dvl_is_found_named_and_isolated_and_nothing_before(whole):
    _, outcomes = whole
    (fault,) = (one for one in findings(outcomes) if one.level is Level.FAULT)
    assert fault.subject == "dvl"
    assert 40.0 < fault.time_s - START_S < 55.0
    assert fault.text.startswith("DVL drifting 0.0") and fault.text.endswith(" m/s/s, isolated")
    last = [one for one in outcomes if isinstance(one, NavigationJudgement)][-1].verdict
    assert last.isolated == ("dvl",)
    assert math.hypot(*last.state.velocity_mps[:2]) == pytest.approx(SPEED_MPS, abs=0.3)


def test_the_real_detector_says_the_same_in_batches_bit_for_bit(config_once, whole):
    arrivals, expected = whole
    chance, watched, outcomes, start = random.Random(5), watching(config_once), [], 0
    while start < len(arrivals):
        stop = start + chance.choice([1, 2, 7, 50, 400])
        outcomes += watched.take([Arrival(link, readings) for link, readings in arrivals[start:stop]])
        start = stop
    assert repr(outcomes) == repr(expected)


@pytest.mark.parametrize("cut", [200, 2100])
def test_restored_from_a_snapshot_the_real_detector_goes_on_bit_for_bit(config_once, whole, cut):
    arrivals, expected = whole
    first = watching(config_once)
    before = play(first, arrivals[:cut])
    after = play(Pipeline.restore(first.snapshot()), arrivals[cut : cut + 300])
    assert repr(before + after) == repr(expected[: len(before) + len(after)])


def test_what_was_learnt_of_the_installation_is_read_back_from_disk(config_once):
    old, new = watching(config_once), watching(config_once)
    play(old, swim(12.0))
    assert new.recall(over_the_disk(old.learnt())) == []
    learnt, recalled = old.learnt()["navigation"].detector, new.learnt()["navigation"].detector
    np.testing.assert_array_equal(recalled.values, learnt.values)
    outcomes = play(new, swim(12.0))
    assert {one.verdict.level for one in outcomes if isinstance(one, NavigationJudgement)} == {Level.UNKNOWN}

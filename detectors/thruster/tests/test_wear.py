"""Slow losses are found though the model follows them; a curve outlives the detector; an operator may accept it."""

import numpy as np
import pytest

from detectors.thruster import CommissionedCurve, FaultKind, ThrusterConfig, ThrusterDetector
from detectors.thruster.tests.simulation import RATE_HZ, Thruster, cruising, lasting
from detectors.verdict import Level

HEALTHY = 1000  # samples before the loss begins


def first(verdicts, level):
    found = np.flatnonzero(verdicts.level >= level)
    assert len(found), f"never {level.name}"
    return int(found[0])


@pytest.mark.parametrize("seconds", [30, 60, 150])
def test_a_slow_loss_of_70_percent_is_found_before_20(seconds):
    ramp = int(seconds * RATE_HZ)
    count = HEALTHY + ramp * 2 // 3  # to a loss of 47 %
    loss = 0.7 * np.clip((np.arange(count) - HEALTHY) / ramp, 0.0, 1.0)
    series = Thruster().simulate(cruising(count, seconds), gain=1.0 - loss, seed=seconds)
    verdicts = ThrusterDetector().run(*series.arguments)
    suspect = first(verdicts, Level.SUSPECT)
    assert 0.0 < loss[suspect] < 0.20
    assert loss[first(verdicts, Level.FAULT)] < 0.30
    assert verdicts.level[-1] >= Level.SUSPECT
    if seconds >= 150:  # faster ones may be taken for an entanglement
        assert verdicts.kind[suspect] == FaultKind.WORN
        assert "commissioned" in verdicts.reason[suspect]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_healthy_drift_of_6_percent_is_no_finding(sign):
    count = 3500
    gain = 1.0 + sign * 0.06 * np.clip((np.arange(count) - 600) / 1200.0, 0.0, 1.0)
    verdicts = ThrusterDetector().run(*Thruster().simulate(cruising(count, 8), gain=gain, seed=8).arguments)
    assert set(verdicts.level.tolist()) == {Level.UNKNOWN, Level.NORMAL}
    assert verdicts.wear[-1] == pytest.approx(sign * 0.06, abs=0.02)


def test_accepted_wear_is_the_new_normal_and_the_watch_goes_on_from_there():
    count = 6500
    loss = 0.16 * np.clip((np.arange(count) - HEALTHY) / 2500.0, 0.0, 1.0)
    loss += 0.16 * np.clip((np.arange(count) - 4800) / 1700.0, 0.0, 1.0)
    series = Thruster().simulate(cruising(count, 2), gain=1.0 - loss, seed=2)
    detector = ThrusterDetector()
    before = detector.run(*series[:4000].arguments)
    assert before.level[-1] == Level.SUSPECT
    assert before.kind[-1] == FaultKind.WORN
    detector.accept()
    after = detector.run(*series[4000:].arguments)
    assert set(after.level[:800].tolist()) == {Level.NORMAL}
    assert abs(after.wear[700]) < 0.03
    assert after.kind[first(after, Level.SUSPECT)] == FaultKind.WORN
    assert loss[4000 + first(after, Level.SUSPECT)] < 0.32


def test_an_accepted_fault_is_over_and_the_next_one_is_found_on_top():
    count = 4000
    gain = lasting(count, 1500, 0.85) * lasting(count, 3000, 0.85)
    series = Thruster().simulate(cruising(count, 4), gain=gain, seed=4)
    detector = ThrusterDetector()
    assert detector.run(*series[:1600].arguments).level[-1] == Level.FAULT
    was = detector.commissioned
    detector.accept()
    assert detector.commissioned is not None
    ratio = np.interp(0.5, detector.commissioned.command, detector.commissioned.speed_rpm)
    ratio /= np.interp(0.5, was.command, was.speed_rpm)
    assert ratio == pytest.approx(0.85, abs=0.02)
    after = detector.run(*series[1600:].arguments)
    assert set(after.level[:1400].tolist()) <= {Level.NORMAL, Level.UNKNOWN}
    assert after.level[1399] == Level.NORMAL
    assert 1400 <= first(after, Level.FAULT) < 1425


def test_accept_before_there_is_a_model_changes_nothing():
    detector = ThrusterDetector()
    detector.accept()
    assert detector.commissioned is None
    verdicts = detector.run(*Thruster().simulate(cruising(600, 1), seed=1).arguments)
    assert set(verdicts.level.tolist()) == {Level.UNKNOWN, Level.NORMAL}


@pytest.fixture(scope="module")
def yesterday():
    detector = ThrusterDetector()
    detector.run(*Thruster().simulate(cruising(1500, 3), seed=3).arguments)
    return detector.commissioned


def test_yesterdays_curve_is_today_s_measure(yesterday):
    worn = Thruster().simulate(cruising(1200, 5), gain=0.84, seed=5).arguments
    verdicts = ThrusterDetector(commissioned=yesterday).run(*worn)
    found = first(verdicts, Level.SUSPECT)
    assert found < 600
    assert verdicts.kind[found] == FaultKind.WORN
    assert verdicts.wear[-1] == pytest.approx(-0.16, abs=0.02)
    # without it, today's is all that the detector knows
    assert set(ThrusterDetector().run(*worn).level.tolist()) == {Level.UNKNOWN, Level.NORMAL}


def test_yesterdays_curve_does_not_accuse_a_healthy_thruster(yesterday):
    healthy = Thruster().simulate(cruising(1200, 6), seed=6).arguments
    detector = ThrusterDetector(ThrusterConfig(), yesterday)
    assert detector.commissioned == yesterday
    verdicts = detector.run(*healthy)
    assert set(verdicts.level.tolist()) == {Level.UNKNOWN, Level.NORMAL}
    assert abs(verdicts.wear[-1]) < 0.02


@pytest.mark.parametrize(
    ("command", "speed_rpm", "named"),
    [
        ((0.1, 0.2), (300.0,), "2 commands, 1 speeds"),
        ((), (), "at least one"),
        ((0.1, np.nan), (300.0, 600.0), "not finite"),
        ((0.1, 0.2), (300.0, np.inf), "not finite"),
        ((0.2, 0.1), (300.0, 600.0), "increase"),
        ((0.1, 0.1), (300.0, 600.0), "increase"),
    ],
)
def test_a_senseless_curve_is_refused(command, speed_rpm, named):
    with pytest.raises(ValueError, match=named):
        CommissionedCurve(command, speed_rpm)


def test_a_sagging_battery_is_no_fault_and_hides_none():
    count, seed = 2600, 1
    supply_v = np.linspace(16.8, 14.0, count)
    command = cruising(count, seed + 20)
    healthy = Thruster().simulate(command, voltage_v=supply_v, seed=seed)
    assert set(ThrusterDetector().run(*healthy.arguments).level.tolist()) == {Level.UNKNOWN, Level.NORMAL}
    weeds = Thruster().simulate(command, voltage_v=supply_v, gain=lasting(count, 2000, 0.9), seed=seed)
    verdicts = ThrusterDetector().run(*weeds.arguments)
    assert 2000 <= first(verdicts, Level.FAULT) < 2025
    assert verdicts.kind[first(verdicts, Level.FAULT)] == FaultKind.ENTANGLED

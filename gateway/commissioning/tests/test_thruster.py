"""One thruster is learnt from dives: what it is, how sure that is, and what speaks against it."""

import numpy as np
import pytest

from detectors.thruster.tests.simulation import TOP_RPM, Thruster, working
from detectors.verdict import Level
from gateway.commissioning.dive import ThrusterSamples
from gateway.commissioning.steady_curve import steady_curve
from gateway.commissioning.tests.made_thrusters import RATE_HZ, config, dive, fault, samples
from gateway.commissioning.thruster import commission_thruster
from gateway.commissioning.thruster_response import response

MADE = Thruster(delay=2, lag=2.0)


@pytest.fixture
def settings(tmp_path):
    return config(tmp_path)


def learnt(settings, dives, vouched=False):
    return commission_thruster(settings.thruster[0], settings, dives, vouched)


def test_curve_delay_and_lag_are_those_of_the_thruster(settings):
    answer = response([samples(300.0, 1, MADE), samples(300.0, 2, MADE)], settings.detector.thruster)
    assert answer.delay_s.value + answer.lag_s.value == pytest.approx(4.0 / RATE_HZ, abs=0.03)
    curve = answer.curve
    side = np.where(curve.command < 0.0, -MADE.astern, 1.0)
    expected = TOP_RPM * side * np.abs(curve.command) ** MADE.bend
    fast = np.abs(expected) > 0.2 * TOP_RPM
    np.testing.assert_allclose(curve.speed_rpm[fast], expected[fast], rtol=0.02)
    assert np.mean(np.abs(curve.speed_rpm - expected)[fast] < 3.0 * curve.error_rpm[fast]) > 0.9
    assert answer.noise_rpm.low <= answer.noise_rpm.value <= answer.noise_rpm.high


def test_a_thruster_that_answers_late_is_looked_for_further_out(settings):
    late = Thruster(delay=17, lag=3.0)
    answer = response([samples(300.0, 1, late)], settings.detector.thruster)
    assert answer.config.delay_max >= 17
    assert answer.delay_s.value + answer.lag_s.value == pytest.approx(20.0 / RATE_HZ, abs=0.1)


def test_what_two_stretches_disagree_in_is_not_sure(settings):
    agreed = response([samples(300.0, 1), samples(300.0, 2)], settings.detector.thruster)
    torn = response([samples(300.0, 1), samples(300.0, 2, gain=0.96)], settings.detector.thruster)
    assert torn.curve.relative_error() > 1.5 * agreed.curve.relative_error()
    assert torn.gains == pytest.approx((0.02, -0.02), abs=0.01)


def test_no_stretch_gives_no_curve():
    assert steady_curve([]) is None


def test_a_sound_thruster_misses_nothing(settings):
    found = learnt(settings, [dive({1: samples()})])
    assert found.sound
    assert found.part.missing == ()
    told = {one.name: one for one in found.part.quantities}
    assert told["commanded"].value == "-91% to +90%"
    assert told["steady speed"].sureness.endswith("from 6 stretches")
    assert [figure.name for figure in found.part.figures] == ["thruster-1-curve", "thruster-1-steps"]


def test_a_thruster_that_was_never_heard_is_told(settings):
    (line,) = learnt(settings, [dive({2: samples()})]).part.missing
    assert "no sample in these logs" in line
    assert "of this vehicle" in line


def test_a_dive_with_a_fault_is_refused_unless_the_user_knows_better(settings):
    ill = dive({1: samples()}, "ill", [fault(1030.0), fault(1090.0), fault(1120.0), fault(1015.0, "thruster 2")])
    (line,) = learnt(settings, [ill]).part.missing
    assert line.startswith("ill is not healthy: 0:00:30 T1 entangled? 900 rpm, want 1200, 0:01:30 T1")
    assert "and 1 more" in line
    assert learnt(settings, [ill], vouched=True).sound


def test_a_suspicion_is_no_fault(settings):
    assert learnt(settings, [dive({1: samples()}, findings=[fault(1030.0, level=Level.SUSPECT)])]).sound


def test_a_dive_of_another_thruster_is_told(settings):
    other = samples(seed=2, gain=0.8)
    lines = learnt(settings, [dive({1: samples(seed=1)}, "ours"), dive({1: other}, "theirs")]).part.missing
    assert any("in theirs it is" in line and "slower at the same command" in line for line in lines)


def test_a_thruster_whose_speed_follows_nothing_cannot_be_learnt(settings):
    still = samples()
    stuck = ThrusterSamples(RATE_HZ, still.time_s, still.command, 0.0 * still.speed_rpm, *still.columns()[3:])
    found = learnt(settings, [dive({1: stuck})])
    assert any(line.startswith("no model of it can be learnt") for line in found.part.missing)
    assert not found.sound


def test_a_speed_without_a_sign_is_noticed(settings):
    unsigned = samples(thruster=Thruster(delay=1, lag=1.5, signed=False))
    (remark,) = learnt(settings, [dive({1: unsigned})]).part.remarks
    assert "add signed = false to its rpm" in remark


def test_a_speed_the_wrong_way_round_is_noticed(settings):
    plain = samples()
    turned = ThrusterSamples(RATE_HZ, plain.time_s, plain.command, -plain.speed_rpm, *plain.columns()[3:])
    (remark,) = learnt(settings, [dive({1: turned})]).part.remarks
    assert "add reverse = true" in remark


def test_a_direction_that_is_never_driven_is_said(settings):
    command = np.abs(working(3600, 3))
    made = MADE.simulate(command, seed=3)
    blank = np.full(3600, np.nan)
    ahead = ThrusterSamples(RATE_HZ, np.arange(3600) / RATE_HZ, command, made.speed_rpm, blank, blank)
    found = learnt(settings, [dive({1: ahead})])
    assert found.sound
    assert any("never driven astern" in remark for remark in found.part.remarks)


def test_dives_at_another_rate_are_not_used(settings):
    slow, fast = samples(200.0, 1), samples(500.0, 2, rate_hz=20.0)
    found = learnt(settings, [dive({1: slow}, "slow"), dive({1: fast}, "fast")])
    assert [one.name for one in found.dives] == ["fast"]
    assert "do not come at 20 Hz there: slow" in found.part.remarks[0]


def test_a_stretch_that_knows_nothing_of_a_command_has_no_say_there(settings):
    ahead = samples(200.0, 3)
    pushed = ThrusterSamples(
        RATE_HZ, ahead.time_s, np.abs(ahead.command), np.abs(ahead.speed_rpm), *ahead.columns()[3:]
    )
    both = response([samples(200.0, 1), pushed], settings.detector.thruster)
    alone = response([samples(200.0, 1)], settings.detector.thruster)
    astern = both.curve.command < -0.3
    expected = np.interp(both.curve.command[astern], alone.curve.command, alone.curve.speed_rpm)
    np.testing.assert_allclose(both.curve.speed_rpm[astern], expected, rtol=0.01)

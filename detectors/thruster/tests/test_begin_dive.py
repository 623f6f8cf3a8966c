"""Another dive is judged with what was learnt before, and then learnt from by itself."""

import numpy as np

from detectors.thruster import ThrusterConfig, ThrusterDetector
from detectors.thruster.tests.simulation import Thruster, cruising, lasting, working
from detectors.verdict import Level

LIVELY, CALM, FAULT_AT = 2000, 1200, 900
THRUSTER = Thruster(noise=0.002)
AGAIN_S = 500.0


def after_a_lively_dive():
    detector = ThrusterDetector(ThrusterConfig())
    inflow = 1.0 + 0.03 * np.sin(np.arange(LIVELY) * 0.11) * np.sin(np.arange(LIVELY) * 0.017)
    detector.run(*THRUSTER.simulate(working(LIVELY, 2), gain=inflow, seed=2).arguments)
    return detector


def calm_dive(gain=1.0):
    return THRUSTER.simulate(cruising(CALM, 4), gain=gain, seed=4, start_s=AGAIN_S)


def test_it_is_judged_from_its_first_samples():
    detector = after_a_lively_dive()
    detector.begin_dive()
    first = detector.run(*calm_dive()[:300].arguments)
    assert (first.level == Level.NORMAL).mean() > 0.8
    assert not first.refitted.any()


def test_it_is_learnt_from_by_itself():
    detector = after_a_lively_dive()
    detector.begin_dive()
    verdicts = detector.run(*calm_dive().arguments)
    refits = np.flatnonzero(verdicts.refitted)
    assert refits[0] >= ThrusterConfig().spans[2] - 1
    assert verdicts.window[refits[0]] < refits[0] + 1
    assert (verdicts.level != Level.FAULT).all()


def test_a_small_loss_is_seen_that_the_noise_of_the_dive_before_would_hide():
    plain, begun = after_a_lively_dive(), after_a_lively_dive()
    begun.begin_dive()
    series = calm_dive(lasting(CALM, FAULT_AT, 0.96))
    found = [(one.run(*series.arguments).level == Level.FAULT) for one in (plain, begun)]
    assert not found[0][: FAULT_AT + 30].any()
    assert found[1][FAULT_AT : FAULT_AT + 30].any()
    assert not found[1][:FAULT_AT].any()


def test_without_a_model_it_is_nothing():
    fresh, begun = ThrusterDetector(), ThrusterDetector()
    begun.begin_dive()
    series = calm_dive()
    np.testing.assert_array_equal(fresh.run(*series.arguments).score, begun.run(*series.arguments).score)
    paper = ThrusterDetector(ThrusterConfig(dynamics=False, threshold_rpm=80.0, search="exact"))
    paper.begin_dive()
    assert paper.learnt is None

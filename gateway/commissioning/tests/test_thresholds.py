"""The threshold of the thrusters is set for a rate of false alarms, and what is said of it is so."""

import numpy as np
import pytest

from detectors.thruster import ThrusterConfig, ThrusterDetector
from gateway.commissioning.peaks import BLOCK_S, tail
from gateway.commissioning.tests.made_thrusters import config, dive, samples
from gateway.commissioning.thresholds import caution_for, commission_thresholds, dive_peaks, held_out, threshold
from gateway.commissioning.thruster import commission_thruster


def peaks(blocks, seed, level=0.5, scale=0.1):
    return level + np.random.default_rng(seed).exponential(scale, blocks)


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    return config(tmp_path_factory.mktemp("config"))


@pytest.fixture(scope="module")
def learnt(settings):
    """Two thrusters in one dive."""
    dives = [dive({1: samples(360.0, 1), 2: samples(360.0, 11)})]
    return [commission_thruster(thruster, settings, dives, False) for thruster in settings.thruster]


def test_rarer_false_alarms_need_more_caution():
    found = threshold([peaks(150, 1), peaks(150, 2)], 0.1)
    assert threshold([peaks(150, 1), peaks(150, 2)], 0.01).caution > found.caution > 1.0
    assert found.tail.rate(found.caution).per_hour == pytest.approx(0.1, rel=0.15)


def test_less_caution_than_usual_is_had_only_where_that_is_sure():
    calm = tail(peaks(3000, 3, level=0.2, scale=0.05))
    assert caution_for(calm, 0.1) == pytest.approx(max(0.8, calm.sure_threshold(0.1)), abs=0.01)
    few = tail(peaks(40, 3, level=0.4, scale=0.07))
    assert few.threshold(0.1) < 1.0 < few.sure_threshold(0.1)
    assert caution_for(few, 0.1) == 1.0


def test_a_dive_is_judged_by_the_threshold_of_the_others():
    quiet, loud = peaks(200, 4), peaks(200, 5) + 1.0
    found = held_out([quiet, loud], 0.1)
    alone = caution_for(tail(quiet), 0.1)
    assert found.events == int((loud >= alone).sum()) > 0
    assert found.hours == pytest.approx(400 * BLOCK_S / 3600.0)


def test_a_single_dive_is_judged_by_halves():
    found = held_out([np.concatenate([peaks(100, 6), peaks(100, 7) + 1.0])], 0.1)
    assert found.events > 50


def test_too_little_for_any_threshold_is_none():
    assert threshold([peaks(10, 1)], 0.1) is None
    assert threshold([], 0.1) is None


@pytest.fixture(scope="module")
def single_peaks(learnt, settings):
    """Of each thruster alone."""
    return [dive_peaks([one], settings.detector.thruster) for one in learnt]


def test_peaks_are_those_of_a_detector_without_caution(learnt, single_peaks):
    found = single_peaks[0]
    usual = ThrusterDetector(ThrusterConfig(seed=1)).run(*learnt[0].samples[0].columns())
    lasting = np.minimum(usual.score[1:], usual.score[:-1])
    assert found[0].max() == pytest.approx(lasting.max(), rel=1e-6)
    assert [len(one) for one in found] == [pytest.approx(360.0 / BLOCK_S, abs=5)]


def test_of_thrusters_in_one_dive_the_greatest_counts(learnt, settings, single_peaks):
    both = dive_peaks(learnt, settings.detector.thruster)
    for together, first, second in zip(both, *single_peaks, strict=True):
        np.testing.assert_array_equal(together, np.maximum(first, second))


def test_a_caution_is_set_with_what_it_means(learnt, settings):
    part = commission_thresholds(learnt, settings.detector.thruster, 0.1)
    (setting,) = part.settings
    assert setting.key == "detector.thruster.caution"
    assert setting.comment == "for 0.1 false alarms per hour, from 0.09 h of healthy dives"
    told = {one.name: one.value for one in part.quantities}
    assert told["false alarms, reached"] == "0 in 0.09 h"
    assert float(told["caution"]) == setting.value
    assert part.figures[0].name == "thrusters-threshold"


def test_too_short_a_dive_is_refused(settings):
    short = dive({1: samples(150.0)})
    learnt = commission_thruster(settings.thruster[0], settings, [short], False)
    part = commission_thresholds([learnt], settings.detector.thruster, 0.1)
    assert part.settings == ()
    assert "minutes of healthy driving could be judged, 5 are wanted" in part.missing[0]


def test_without_a_sound_thruster_there_is_no_threshold(settings):
    unheard = commission_thruster(settings.thruster[0], settings, [], False)
    (line,) = commission_thresholds([unheard], settings.detector.thruster, 0.1).missing
    assert line.startswith("no thruster has enough")

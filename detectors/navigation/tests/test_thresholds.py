from math import e, exp

import pytest

from detectors.navigation.thresholds import ONCE_AN_HOUR, PER_E_FOLD, ratio_threshold


def test_rarer_alarms_want_more_evidence():
    assert ratio_threshold(1.0) == ONCE_AN_HOUR
    assert ratio_threshold(1.0 / e) == pytest.approx(ONCE_AN_HOUR + PER_E_FOLD)
    assert ratio_threshold(1e-9) > ratio_threshold(1e-8) > ONCE_AN_HOUR


def test_no_wish_makes_noise_evidence():
    assert ratio_threshold(exp(100.0)) == ratio_threshold(exp(50.0)) == 10.0

import numpy as np
import pytest

from detectors.navigation.gate import OUTLIER, OUTLIERS_MAX, InnovationGate, outlying
from detectors.navigation.sample import DepthSample, DvlSample

COVARIANCE = np.diag([0.04, 0.01, 0.01])
NEAR, FAR = np.array([0.2, 0.1, -0.1]), np.array([2.0, 0.0, 0.0])


@pytest.mark.parametrize(("share", "far"), [(0.99, False), (1.01, True)])
def test_far_off_is_by_standard_deviations_and_components(share, far):
    direction = np.array([0.2, 0.1, 0.1])  # one standard deviation along each axis
    assert outlying(np.sqrt(OUTLIER * share) * direction, COVARIANCE) is far
    assert outlying(np.sqrt(OUTLIER * share) * direction[:1], COVARIANCE[:1, :1]) is far


def admitted(gate, kind, innovations):
    return [gate.admits(kind, one, COVARIANCE) for one in innovations]


def test_outliers_are_refused_until_there_are_too_many_in_a_row():
    gate = InnovationGate()
    assert admitted(gate, DvlSample, [NEAR, *[FAR] * OUTLIERS_MAX]) == [True] + [False] * OUTLIERS_MAX
    assert gate.insists(DvlSample)
    assert not gate.insists(DepthSample)
    assert admitted(gate, DvlSample, [FAR, FAR]) == [True, False]  # then it is counted anew


def test_a_good_one_ends_the_row():
    gate = InnovationGate()
    row = [*[FAR] * (OUTLIERS_MAX - 1), NEAR]
    assert admitted(gate, DvlSample, row * 3) == ([False] * (OUTLIERS_MAX - 1) + [True]) * 3

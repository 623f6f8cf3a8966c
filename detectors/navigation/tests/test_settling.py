from dataclasses import replace

import numpy as np

from detectors.navigation.sample import DvlSample
from detectors.navigation.settling import SETTLED_MPS, SETTLING_S, SETTLING_SAMPLES, Settling
from detectors.navigation.tests.innovations import depth_innovation, dvl_innovation

BEGAN_S = 1000.0


def settling_at(every_s, *, doubt_mps=0.5 * SETTLED_MPS):
    """After how many seconds and samples of the DVL, when one comes so often."""
    settling = Settling(BEGAN_S)
    for number in range(1, 1000):
        one = dvl_innovation(BEGAN_S + number * every_s, 0.0, noise_mps=doubt_mps)
        if settling.expects(one):
            return number * every_s, settling.samples
    return None


def test_the_filter_has_to_have_had_time_and_samples():
    assert settling_at(0.5) == (SETTLING_S, SETTLING_S / 0.5)
    assert settling_at(10.0) == (10.0 * SETTLING_SAMPLES, SETTLING_SAMPLES)


def test_it_has_to_expect_the_dvl_well():
    assert settling_at(0.5, doubt_mps=1.01 * SETTLED_MPS) is None


def test_what_the_depth_sensor_says_does_not_matter():
    settling = Settling(BEGAN_S)
    assert not any(settling.expects(depth_innovation(BEGAN_S + number, 0.0)) for number in range(100))
    assert settling.samples == 0


def test_begun_anew_it_waits_again():
    settling = Settling(BEGAN_S)
    for number in range(100):
        settling.expects(dvl_innovation(BEGAN_S + number, 0.0))
    settling.settled = True
    settling.begin(BEGAN_S + 100.0)
    assert (settling.settled, settling.samples) == (False, 0)
    assert not settling.expects(dvl_innovation(BEGAN_S + 101.0, 0.0))


def test_one_component_that_is_badly_known_counts():
    settling = Settling(BEGAN_S)
    one = replace(
        dvl_innovation(BEGAN_S + SETTLING_S, 0.0),
        measurement=DvlSample(BEGAN_S + SETTLING_S, (0.0, 0.0, 0.0)),
        covariance=np.diag([0.01, 0.01, 2.0]) ** 2,
    )
    assert not any(settling.expects(one) for _ in range(2 * SETTLING_SAMPLES))

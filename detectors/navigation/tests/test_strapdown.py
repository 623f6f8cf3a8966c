from math import radians

import numpy as np
import pytest

from detectors.navigation.rotation import matrix
from detectors.navigation.sample import NavigationState
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.tests.ecef import Motion, every

DURATIONS_S = {0.0: 240.0, 45.0: 600.0, -60.0: 240.0, 85.0: 240.0}  # by latitude in degrees


def eased(time_s):
    """0 until 60 s, 1 from 90 s on, smooth to the second derivative; and its rate."""
    share = np.clip((time_s - 60.0) / 30.0, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2), share**2 * (1.0 - share) ** 2


def rocking_circles(time_s):
    """Stands still for a minute; then circles in half a minute, rolls by 9 degrees in 7 s and dives in waves."""
    share, rate = eased(time_s)
    roll, pitch, yaw = 0.15 * np.sin(0.9 * time_s), 0.3 * np.sin(0.25 * time_s), 0.2 * (time_s - 60.0)
    rates = 0.135 * np.cos(0.9 * time_s), 0.075 * np.cos(0.25 * time_s), np.full_like(time_s, 0.2)
    angles = np.array([roll, pitch, yaw])
    return share * angles, share * np.array(rates) + rate * angles


def circling(time_s):
    share, _ = eased(time_s)
    return share * np.array([0.4 * np.cos(0.2 * time_s), 0.4 * np.sin(0.2 * time_s), 0.05 * np.sin(0.1 * time_s)])


def resting(time_s):
    return np.zeros((3, len(time_s)))


def ahead(time_s):
    return np.zeros((3, len(time_s))), np.zeros((3, len(time_s)))


def begun(motion, **biases):
    attitude = tuple(motion.attitude(np.zeros(1))[0][:, 0].tolist())
    start = NavigationState(
        0.0, motion.latitude_rad, motion.longitude_rad, motion.depth_m, motion.velocity_mps, attitude
    )
    return Strapdown(start, **biases)


def driven(strapdown, samples):
    for sample in samples:
        strapdown.advance(*sample)
    return strapdown


def error_m(strapdown, truth):
    return truth.distance_m(strapdown.latitude_rad, strapdown.longitude_rad, strapdown.depth_m)


@pytest.fixture(scope="module", params=DURATIONS_S.items(), ids=lambda param: f"{param[0]} degrees")
def mission(request):
    latitude_deg, duration_s = request.param
    motion = Motion(rocking_circles, circling, radians(latitude_deg))
    return motion, duration_s, motion.truth([duration_s])[0]


@pytest.mark.parametrize(
    ("interval_s", "error_max_m"), [(0.01, 0.002), (0.1, 0.2)], ids=["100 Hz", "10 Hz"]
)  # measured at 600 s: 1 mm and 14 cm; without the terms of coning and sculling 14 cm and 14 m
def test_dead_reckoning_equals_an_integration_in_the_frame_of_the_earth(mission, interval_s, error_max_m):
    motion, duration_s, truth = mission
    ours = driven(begun(motion), motion.samples(every(interval_s, duration_s)))
    assert error_m(ours, truth) < error_max_m * (duration_s / 600.0) ** 2
    np.testing.assert_allclose(ours.velocity_mps, truth.velocity_mps, atol=0.005 * error_max_m)
    np.testing.assert_allclose(matrix(ours.attitude), truth.cosines, atol=3e-5 * error_max_m)

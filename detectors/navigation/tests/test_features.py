import pickle

import numpy as np
import pytest

from detectors.navigation.features import MotionFeatures
from detectors.navigation.rotation import from_euler

VELOCITY = (1.5, -0.2, 0.1)


def test_means_of_what_the_imu_said_since_the_last_time():
    features = MotionFeatures()
    features.add((9.0, 9.0, 9.0), (9.0, 9.0, 9.0))
    features.take(VELOCITY, from_euler((0.0, 0.0, 0.0)))
    features.add((1.0, 2.0, -9.0), (0.1, 0.2, 0.3))
    features.add((3.0, 4.0, -11.0), (0.3, 0.4, 0.5))
    seen = features.take(VELOCITY, from_euler((0.0, 0.0, 0.0)))
    np.testing.assert_allclose(seen, [*VELOCITY, 0.2, 0.3, 0.4, 2.0, 3.0, -10.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("heading_rad", [0.0, 1.0, -3.0])
def test_attitude_is_the_direction_of_down_whatever_the_heading(heading_rad):
    features = MotionFeatures()
    features.add((0.0, 0.0, -9.8), (0.0, 0.0, 0.0))
    seen = features.take(VELOCITY, from_euler((0.1, 0.2, heading_rad)))
    down = [-np.sin(0.2), np.sin(0.1) * np.cos(0.2), np.cos(0.1) * np.cos(0.2)]
    np.testing.assert_allclose(seen[9:], down, atol=1e-12)


def test_nothing_between_two_calls_is_nothing_to_tell():
    features = MotionFeatures()
    assert features.take(VELOCITY, from_euler((0.0, 0.0, 0.0))) is None
    features.add((0.0, 0.0, -9.8), (0.0, 0.0, 0.0))
    copy = pickle.loads(pickle.dumps(features))  # noqa: S301
    assert copy.take(VELOCITY, from_euler((0.0, 0.0, 0.0))) is not None
    assert copy.take(VELOCITY, from_euler((0.0, 0.0, 0.0))) is None

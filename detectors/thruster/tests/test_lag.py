import numpy as np
import pytest

from detectors.thruster.lag import follow_gain, followed, lagged


def looped(target, gain, speed):
    out = []
    for goal in target:
        speed += gain * (goal - speed)
        out.append(speed)
    return np.array(out)


@pytest.mark.parametrize("lag", [0.0, 0.3, 2.5, 12.0])
def test_follows_its_target(lag):
    target = np.random.default_rng(0).uniform(-1.0, 1.0, 300)
    gain = follow_gain(lag)
    np.testing.assert_allclose(followed(target, 0.4, gain), looped(target, gain, 0.4), atol=1e-12)
    np.testing.assert_allclose(lagged(target[None, :], lag)[0], looped(target, gain, target[0]), atol=1e-12)


def test_in_pieces_it_is_the_same_bit_for_bit():
    target = np.random.default_rng(1).uniform(-1.0, 1.0, 97)
    gain = follow_gain(2.5)
    speed, pieces = 0.1, []
    for part in np.split(target, [1, 2, 40, 41]):
        pieces.append(followed(part, speed, gain))
        speed = float(pieces[-1][-1])
    np.testing.assert_array_equal(np.concatenate(pieces), followed(target, 0.1, gain))

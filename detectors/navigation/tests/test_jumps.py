import pytest

from detectors.navigation.blame import Suspicion
from detectors.navigation.jumps import RECOVERED, SHAKEN_S, Jumps
from detectors.navigation.ratio import FAMILIES, Explanation
from detectors.navigation.sample import FaultKind, NavigationState, Sensor
from detectors.navigation.strapdown import Strapdown

INITIAL = NavigationState(0.0, 0.5, 0.6, 10.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
FAMILY = {family.sensor: family for family in FAMILIES}


def found(sensor, size):
    explanation = Explanation(FAMILY[sensor], 50.0, 0.0, size, size)
    return Suspicion(sensor, FaultKind.STEP, 1.5, explanation)


def strapdown_with(*, gyroscope=(0.0, 0.0, 0.0), accelerometer=(0.0, 0.0, 0.0)):
    strapdown = Strapdown(INITIAL)
    strapdown.gyroscope_bias_radps, strapdown.accelerometer_bias_mps2 = gyroscope, accelerometer
    return strapdown


@pytest.mark.parametrize(
    ("sensor", "size", "name"),
    [
        (Sensor.GYROSCOPE, 0.01, "gyroscope"),
        (Sensor.ACCELEROMETER, 0.3, "accelerometer"),
    ],
)
def test_a_jump_is_over_when_the_bias_is_what_it_was(sensor, size, name):
    jumps, usual = Jumps(), 0.1 * size
    jumps.add(found(sensor, (size, 0.0, 0.0)), strapdown_with(**{name: (usual, 0.0, 0.0)}), 5.0)
    for share, left in ((1.0, {sensor}), (1.1 * RECOVERED, {sensor}), (0.9 * RECOVERED, set())):
        jumps.forgive(strapdown_with(**{name: (usual + share * size, 0.0, 0.0)}))
        assert jumps.found.keys() == left


def test_after_a_second_jump_healthy_is_what_was_before_the_first():
    jumps = Jumps()
    jumps.add(found(Sensor.GYROSCOPE, (0.01, 0.0, 0.0)), strapdown_with(), 5.0)
    second = found(Sensor.GYROSCOPE, (0.02, 0.0, 0.0))
    jumps.add(second, strapdown_with(gyroscope=(0.01, 0.0, 0.0)), 90.0)
    jumps.forgive(strapdown_with(gyroscope=(0.01, 0.0, 0.0)))
    assert jumps.found == {Sensor.GYROSCOPE: second}
    jumps.forgive(strapdown_with())
    assert jumps.found == {}


def test_for_a_while_after_it_the_filter_is_shaken():
    jumps = Jumps()
    assert not jumps.shaken(5.0)
    jumps.add(found(Sensor.GYROSCOPE, (0.01, 0.0, 0.0)), strapdown_with(), 5.0)
    jumps.clear()
    assert jumps.shaken(5.0 + 0.99 * SHAKEN_S)
    assert not jumps.shaken(5.0 + SHAKEN_S)

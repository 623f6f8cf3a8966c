import numpy as np
import pytest

from detectors.navigation.blame import INERTIAL, NAMED, Blame, blame, named, suspicions
from detectors.navigation.condition import Condition
from detectors.navigation.ratio import FAMILIES, Explanation
from detectors.navigation.sample import FaultKind, Sensor
from detectors.navigation.tests.innovations import dvl_innovation

FAMILY = {(family.sensor, family.kind): family for family in FAMILIES}


def explained(sensor, ratio, kind=FaultKind.STEP, size=(0.3, 0.0, 0.4)):
    return Explanation(FAMILY[sensor, kind], ratio, 10.0, size, (3.0, 0.0, 4.0))


def names(**weights):
    """Of explanations that weigh so much."""
    found = []
    for sensor, weight in weights.items():
        rarer = explained(Sensor(sensor), 0.0).weight
        found.append(explained(Sensor(sensor), weight - rarer))
    return set(named(found))


def test_the_sensor_that_explains_it_much_better_is_named():
    assert names(dvl=50.0, depth=50.0 - NAMED) == {"dvl"}
    assert names(dvl=50.0, depth=50.1 - NAMED) == {"dvl", "depth"}
    assert names(gyroscope=50.0, accelerometer=50.1 - NAMED, dvl=20.0) == {"gyroscope", "accelerometer"}
    assert names(accelerometer=50.0, dvl=50.0 - NAMED) == {"accelerometer"}


def test_inertial_sensors_fail_more_rarely():
    for sensor in INERTIAL:
        assert explained(sensor, 50.0).weight < explained(Sensor.DVL, 50.0).weight == 50.0
    assert explained(Sensor.DVL, 50.0, FaultKind.SCALE).weight < 50.0


def test_nobody_is_named_without_an_explanation():
    assert named([]) == ()
    assert suspicions([], 30.0, {}) == []


def test_the_gravest_comes_first():
    found = suspicions([explained(Sensor.DEPTH, 15.0), explained(Sensor.DVL, 45.0, FaultKind.DRIFT)], 30.0, {})
    assert [(one.sensor, one.kind, one.score) for one in found] == [
        (Sensor.DVL, FaultKind.DRIFT, 1.5),
        (Sensor.DEPTH, FaultKind.STEP, 0.5),
    ]


def test_only_a_drift_has_a_rate():
    drift, step = suspicions([explained(Sensor.DVL, 45.0, FaultKind.DRIFT), explained(Sensor.DEPTH, 40.0)], 30.0, {})
    assert drift.rate == pytest.approx(0.5)
    assert step.rate == 0.0
    assert drift.size == (3.0, 0.0, 4.0)


def stuck():
    condition = Condition()
    for number in range(10):
        condition.update((1.0, 0.0, 0.0), dvl_innovation(float(number), 1.0))
    return condition


@pytest.mark.parametrize(("ratio", "size"), [(40.0, (3.0, 0.0, 4.0)), (3.0, (0.0, 0.0, 0.0))])
def test_what_shows_in_the_samples_takes_its_size_from_a_likely_explanation(ratio, size):
    found = suspicions([explained(Sensor.DVL, ratio)], 30.0, {Sensor.DVL: stuck()})
    assert (found[0].sensor, found[0].kind) == (Sensor.DVL, FaultKind.STUCK)
    np.testing.assert_array_equal(found[0].size, size)


def test_it_is_doubtful_when_several_explain_enough_and_as_well():
    dvl, accelerometer = explained(Sensor.DVL, 50.0), explained(Sensor.ACCELEROMETER, 50.0)
    assert set(blame([dvl, accelerometer], 40.0, {}).doubtful) == {Sensor.DVL, Sensor.ACCELEROMETER}
    assert blame([dvl, accelerometer], 60.0, {}).doubtful == ()
    assert blame([dvl, explained(Sensor.ACCELEROMETER, 30.0)], 40.0, {}).doubtful == ()
    assert blame([], 40.0, {}).doubtful == ()


def test_what_an_inertial_sensor_may_explain_too_is_not_said_twice():
    both = [explained(Sensor.DVL, 50.0), explained(Sensor.ACCELEROMETER, 50.0)]
    found = blame(both, 40.0, {}, explained=True)
    assert found.doubtful == ()
    assert [one.sensor for one in found.suspicions] == [Sensor.DVL]
    assert found.explanations == both


def test_of_a_sensor_the_gravest_suspicion_is_told():
    found = blame([explained(Sensor.DVL, 36.0)], 30.0, {Sensor.DVL: stuck()})
    assert found.against(Sensor.DVL) is found.suspicions[0]
    assert found.against(Sensor.DEPTH) is None
    assert found.worst == found.suspicions[0].score == 2.0
    assert Blame().worst == 0.0

import pytest

from detectors.navigation.blame import Blame, Suspicion
from detectors.navigation.conclusion import NOTHING_HEARD, Conclusion, Situation, conclude
from detectors.navigation.isolation import Isolation
from detectors.navigation.sample import DepthSample, DvlSample, FaultKind, ImuSample, Sensor, SensorVerdict
from detectors.navigation.thresholds import SUSPECT_SHARE
from detectors.verdict import Level

DVL, DEPTH, GYROSCOPE, ACCELEROMETER = Sensor.DVL, Sensor.DEPTH, Sensor.GYROSCOPE, Sensor.ACCELEROMETER


def judged(**known):
    return conclude(Situation(settled=True, begun=True, **known))


def levels(conclusion):
    return {one.sensor: one.level for one in conclusion.sensors}


def blamed(sensor, score, kind=FaultKind.STEP):
    return Blame([Suspicion(sensor, kind, score)])


def test_where_nothing_is_wrong_all_are_normal():
    said = judged()
    assert levels(said) == dict.fromkeys(Sensor, Level.NORMAL)
    assert (said.level, said.score, said.reason) == (Level.NORMAL, 0.0, "")


def test_before_the_filter_has_found_itself_all_are_unknown():
    assert conclude(Situation()).reason == Conclusion().reason == NOTHING_HEARD
    said = conclude(Situation(begun=True, blame=blamed(DVL, 2.0)))
    assert levels(said) == dict.fromkeys(Sensor, Level.UNKNOWN)
    assert said.level is Level.UNKNOWN
    assert said.reason == "finding out how the sensors are mounted"


@pytest.mark.parametrize(
    ("score", "level", "reason"),
    [
        (0.99 * SUSPECT_SHARE, Level.NORMAL, ""),
        (SUSPECT_SHARE, Level.SUSPECT, "depth drift"),
        (0.99, Level.SUSPECT, "depth drift"),
        (1.0, Level.FAULT, "depth drift"),
    ],
)
def test_a_suspicion_counts_by_its_share_of_the_threshold(score, level, reason):
    said = judged(blame=blamed(DEPTH, score, FaultKind.DRIFT))
    assert (said.level, said.score, said.reason) == (level, score, reason)
    assert {sensor for sensor, one in levels(said).items() if one is not Level.NORMAL} <= {DEPTH}


def test_only_the_gravest_suspicion_of_a_sensor_is_told():
    said = judged(blame=Blame([Suspicion(DVL, FaultKind.STUCK, 2.0), Suspicion(DVL, FaultKind.STEP, 1.5)]))
    assert (said.score, said.reason) == (2.0, "dvl stuck")


def test_where_it_can_be_one_of_two_both_are_unknown_and_there_is_a_fault():
    doubt = Blame([Suspicion(DVL, FaultKind.STEP, 1.5)], doubtful=(ACCELEROMETER, DVL))
    said = judged(blame=doubt)
    assert {sensor for sensor, level in levels(said).items() if level is Level.UNKNOWN} == {ACCELEROMETER, DVL}
    assert (said.level, said.score, said.reason) == (Level.FAULT, 1.5, "accelerometer or dvl")


def test_an_isolated_sensor_is_as_it_is_followed():
    isolation = Isolation(DVL, FaultKind.DRIFT, (0.5, 0.0, 0.0), 0.04)
    said = judged(isolated={DVL: isolation}, blame=blamed(DVL, 0.1))
    expected = SensorVerdict(DVL, Level.FAULT, 1.0, FaultKind.DRIFT, (0.5, 0.0, 0.0), 0.04, isolated=True)
    assert said.sensors[0] == expected
    assert said.reason == "dvl drift"


def test_a_bias_that_has_jumped_stays_a_fault():
    said = judged(jumped={GYROSCOPE: Suspicion(GYROSCOPE, FaultKind.STEP, 0.9)})
    assert said.level is Level.FAULT
    assert (said.score, said.reason) == (1.0, "gyroscope step")
    assert not any(one.isolated for one in said.sensors)


@pytest.mark.parametrize(
    ("kind", "unknown", "reason"),
    [
        (DvlSample, {DVL, GYROSCOPE, ACCELEROMETER}, "dvl silent"),
        (DepthSample, {DEPTH}, "depth silent"),
        (ImuSample, set(Sensor), "imu silent"),
    ],
)
def test_who_is_not_heard_is_not_judged(kind, unknown, reason):
    silent, unheard = judged(silent=frozenset({kind})), judged(unheard=frozenset({kind}))
    for said in (silent, unheard):
        assert {sensor for sensor, level in levels(said).items() if level is Level.UNKNOWN} == unknown
    assert (silent.reason, unheard.reason) == (reason, "")


def test_all_that_is_wrong_is_told():
    said = judged(blame=blamed(DVL, 1.0), silent=frozenset({DepthSample}))
    assert said.reason == "dvl step, depth silent"

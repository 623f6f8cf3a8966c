"""What is said of navigation sensors: short enough for a pilot, the sensor first."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.navigation import (
    DepthSample,
    DvlSample,
    FaultKind,
    ImuSample,
    NavigationState,
    NavigationVerdict,
    Sensor,
    SensorVerdict,
)
from detectors.verdict import Level
from drivers.mavlink.messages import TEXT_MAX
from gateway.channel import NavigationJudgement
from gateway.observation import Observation
from gateway.rules import observations

STATE = NavigationState(0.0, 0.8, 0.2, 5.0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
DVL, DEPTH = DvlSample(0.0, (0.0, 0.0, 0.0)), DepthSample(0.0, 12.34)
HEALTHY = tuple(SensorVerdict(sensor, Level.NORMAL) for sensor in Sensor)


def told(*sensors, level=None, reason="", sample=DVL, changed=False) -> dict[str, Observation]:
    worst = max((one.level for one in sensors), default=Level.UNKNOWN) if level is None else level
    verdict = NavigationVerdict(time_s=0.0, level=worst, score=1.0, state=STATE, sensors=sensors, reason=reason)
    return {one.subject: one for one in observations(NavigationJudgement(sample, verdict, DVL, DEPTH, changed))}


def fault(sensor, kind, size=(0.0, 0.0, 0.0), rate=0.0, isolated=True, level=Level.FAULT):
    return SensorVerdict(sensor, level, 1.2, kind, size, rate, isolated)


WORDS = {
    "DVL drifting 0.04 m/s/s, isolated": fault(Sensor.DVL, FaultKind.DRIFT, (0.3, 0.0, 0.0), 0.0412),
    "DVL stuck at 0.00 m/s, isolated": fault(Sensor.DVL, FaultKind.STUCK),
    "DVL off by 1.0 m/s forward, isolated": fault(Sensor.DVL, FaultKind.STEP, (1.02, 0.1, 0.0)),
    "DVL off by 0.30 m/s left, isolated": fault(Sensor.DVL, FaultKind.STEP, (0.1, -0.3, 0.0)),
    "DVL scale off by 0.12 m/s backward, isolated": fault(Sensor.DVL, FaultKind.SCALE, (-0.12, 0.0, 0.0)),
    "DVL scale off, isolated": fault(Sensor.DVL, FaultKind.SCALE, (0.001, 0.0, 0.0)),
    "DVL noisy, isolated": fault(Sensor.DVL, FaultKind.NOISE),
    "DVL intermittent, isolated": fault(Sensor.DVL, FaultKind.INTERMITTENT),
    "DVL abnormal, isolated": fault(Sensor.DVL, FaultKind.UNCLEAR),
    "DVL off by 0.20 m/s up?": fault(
        Sensor.DVL, FaultKind.STEP, (0.0, 0.0, -0.2), isolated=False, level=Level.SUSPECT
    ),
    "Depth off by 2.1 m, isolated": fault(Sensor.DEPTH, FaultKind.STEP, (0.0, 0.0, 2.11)),
    "Depth off by -2.1 m, isolated": fault(Sensor.DEPTH, FaultKind.STEP, (0.0, 0.0, -2.11)),
    "Depth drifting 0.003 m/s, isolated": fault(Sensor.DEPTH, FaultKind.DRIFT, rate=-0.003),
    "Depth stuck at 12.3 m, isolated": fault(Sensor.DEPTH, FaultKind.STUCK),
    "Gyro off by 1.1 deg/s yaw": fault(Sensor.GYROSCOPE, FaultKind.STEP, (0.0, 0.0, 0.02), isolated=False),
    "Gyro drifting 0.06 deg/s/s": fault(Sensor.GYROSCOPE, FaultKind.DRIFT, rate=0.001, isolated=False),
    "Gyro stuck": fault(Sensor.GYROSCOPE, FaultKind.STUCK, isolated=False),
    "Accel off by 0.30 m/s/s backward": fault(Sensor.ACCELEROMETER, FaultKind.STEP, (-0.3, 0.0, 0.0), isolated=False),
}


@pytest.mark.parametrize("words", WORDS)
def test_words(words):
    verdict = WORDS[words]
    said = told(verdict)
    (one,) = (one for one in said.values() if one.label != "Nav")
    assert one.text() == words
    assert one.subject in ("dvl", "depth sensor", "gyroscope", "accelerometer")


def test_healthy_sensors_each_have_a_level():
    said = told(*HEALTHY)
    assert {one.text() for one in said.values()} == {"DVL ok", "Depth ok", "Gyro ok", "Accel ok", "Nav ok"}
    assert said["dvl"].over_text() == "DVL ok again"


def test_what_no_sensor_can_be_blamed_for_is_the_whole_ones():
    unknown = [SensorVerdict(sensor, Level.UNKNOWN) for sensor in (Sensor.DVL, Sensor.ACCELEROMETER)]
    said = told(*unknown, level=Level.FAULT, reason="dvl or accelerometer")
    assert said["navigation"].text() == "Nav: DVL or accelerometer off"
    assert said["navigation"].level is Level.FAULT
    assert said["dvl"].text() == "DVL unknown: dvl or accelerometer"


def test_four_that_it_could_be_have_room():
    every = " or ".join(Sensor)
    assert told(level=Level.FAULT, reason=every)["navigation"].text() == "Nav: DVL or Depth or Gyro or Accel off"


def test_a_blamed_sensor_is_not_told_twice():
    said = told(WORDS["DVL noisy, isolated"], reason="dvl noise")
    assert said["navigation"].level is Level.NORMAL
    assert said["navigation"].over_text() == "Nav: it is the DVL"
    assert told(*HEALTHY)["navigation"].over_text() == "Nav ok again"


def test_while_nothing_is_known_it_says_why():
    said = told(SensorVerdict(Sensor.DVL, Level.UNKNOWN), reason="waiting for the DVL")
    assert said["dvl"].text() == "DVL unknown: waiting for the DVL"
    assert said["navigation"].text() == "Nav unknown: waiting for the DVL"


def test_inertial_samples_say_nothing_new_unless_something_changed():
    imu = ImuSample(0.0, (0.0, 0.0, -9.8), (0.0, 0.0, 0.0))
    assert told(*HEALTHY, sample=imu) == {}
    assert len(told(*HEALTHY, sample=imu, changed=True)) == 5


NUMBER = st.floats(-99.0, 99.0)


@given(
    st.sampled_from(Sensor),
    st.one_of(st.none(), st.sampled_from(FaultKind)),
    st.tuples(NUMBER, NUMBER, NUMBER),
    st.floats(0.0, 99.0),
    st.booleans(),
    st.sampled_from([Level.SUSPECT, Level.FAULT]),
)
def test_every_text_is_whole(sensor, kind, size, rate, isolated, level):
    if sensor is Sensor.GYROSCOPE:
        size, rate = tuple(map(math.radians, size)), math.radians(rate)
    said = told(fault(sensor, kind, size, rate, isolated, level))
    (one,) = (one for one in said.values() if one.label != "Nav")
    assert len(one.text()) <= TEXT_MAX
    assert one.text().endswith(", isolated" if isolated else "?" if level is Level.SUSPECT else one.trouble)

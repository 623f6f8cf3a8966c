"""What the autopilot is asked for: what the configuration reads, and nothing else."""

import pytest

from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.tests.peer import messages_in
from drivers.readings import AutopilotHeartbeat
from gateway.config import parse
from gateway.config_sections import Flow, Speed
from gateway.streams import speed_streams, streams
from gateway.tests.conftest import NAVIGATION_WATCH, SPEED_WATCH, TWO_THRUSTERS

ARDUPILOT, PX4 = 3, 12
SYSTEM_TIME, ATTITUDE, LOCAL, GLOBAL, GPS_RAW, SERVO = 2, 30, 32, 33, 24, 36
RPM, ESC_TELEMETRY, ESC_STATUS, ESC_INFO, RAW_IMU, ACTUATORS = 226, 11030, 291, 290, 27, 375

CAN_ONLY = TWO_THRUSTERS.replace('{ link = "mavlink", servo_channel = 3 }', '{ link = "can0", esc_index = 1 }')
ACTUATOR = TWO_THRUSTERS.replace("servo_channel = 3", "actuator = 3")
ESCS = CAN_ONLY.replace('rpm = { link = "can0", esc_index = 1 }', 'rpm = { link = "mavlink", esc_index = 1 }')
SENSOR = CAN_ONLY.replace('rpm = { link = "can0", esc_index = 1 }', 'rpm = { link = "mavlink", rpm_sensor = 2 }')
SPEED = TWO_THRUSTERS.replace("rpm = {", "ahead = 1\nrpm = {", 1) + SPEED_WATCH


def speed(position):
    return SPEED.replace("[speed]", f'[speed]\nposition = "{position}"')


def asked(text, tmp_path, autopilot=ARDUPILOT):
    wanted = streams(parse(text, tmp_path), autopilot)
    ids = [one.message_id for one in wanted]
    assert len(ids) == len(set(ids))
    return set(ids)


@pytest.mark.parametrize(
    ("text", "autopilot", "wanted"),
    [
        (CAN_ONLY, ARDUPILOT, set()),
        (CAN_ONLY, PX4, set()),
        (TWO_THRUSTERS, ARDUPILOT, {SERVO}),
        (ACTUATOR, PX4, {ACTUATORS}),
        (ESCS, ARDUPILOT, {ESC_TELEMETRY}),
        (ESCS, PX4, {ESC_STATUS, ESC_INFO}),
        (SENSOR, ARDUPILOT, {RPM}),
        (SPEED, ARDUPILOT, {SERVO, ATTITUDE, LOCAL, GLOBAL, GPS_RAW}),
        (speed("local"), ARDUPILOT, {SERVO, ATTITUDE, LOCAL}),
        (speed("global"), ARDUPILOT, {SERVO, ATTITUDE, GLOBAL}),
        (speed("fix"), ARDUPILOT, {SERVO, ATTITUDE, GLOBAL, GPS_RAW}),
        (CAN_ONLY + NAVIGATION_WATCH + 'depth = "none"', ARDUPILOT, {RAW_IMU, ATTITUDE}),
    ],
)
def test_only_what_is_read_is_asked_for(text, autopilot, wanted, tmp_path):
    assert asked(text, tmp_path, autopilot) == wanted | {SYSTEM_TIME}


def test_with_an_origin_local_positions_are_of_no_use():
    somewhere = Speed(flow=Flow(latitude_deg=60.0, longitude_deg=10.0))
    assert {one.message_id for one in speed_streams(somewhere)} == {ATTITUDE, GLOBAL, GPS_RAW}


def test_what_two_watches_want_is_asked_for_once_and_as_fast_as_the_faster_wants_it(tmp_path):
    both = streams(parse(SPEED + NAVIGATION_WATCH, tmp_path), ARDUPILOT)
    rates = {one.message_id: one.rate_hz for one in both}
    assert len(rates) == len(both)
    assert (rates[ATTITUDE], rates[GLOBAL], rates[RAW_IMU]) == (20.0, 10.0, 50.0)


def test_requests_are_read_back_by_pymavlink(tmp_path):
    autopilot = AutopilotHeartbeat(0.0, 7, 1, ARDUPILOT, 12, False, 19, 4)
    for one in streams(parse(SPEED + NAVIGATION_WATCH, tmp_path), ARDUPILOT):
        (sent,) = messages_in(MavlinkEncoder(7).encode(one.request(autopilot)))
        assert (sent.command, sent.param1) == (511, one.message_id)
        assert sent.param2 == pytest.approx(1e6 / one.rate_hz)
        assert (sent.target_system, sent.target_component) == (7, 1)

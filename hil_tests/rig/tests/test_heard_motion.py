"""How a vehicle moves, from what its autopilot tells."""

from __future__ import annotations

from math import cos, nan, pi, sin

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.frames import Packet
from hil_tests.rig.geodesy import METRES_PER_DEGREE_NORTH
from hil_tests.rig.heard_motion import HeardMotion
from hil_tests.rig.kinematics import attitude_rad, body_rates

SIMULATED = dict.fromkeys(dialect.MAVLink_sim_state_message.fieldnames, 0)


def packet_of(message: dialect.MAVLink_message) -> Packet:
    message.pack(dialect.MAVLink(None))
    return Packet(message.get_msgId(), 1, 1, bytes(message.get_payload()))


def attitude(roll=0.0, pitch=0.0, yaw=0.0, rates=(0.0, 0.0, 0.0)) -> Packet:
    return packet_of(dialect.MAVLink_attitude_message(1, roll, pitch, yaw, *rates))


def position(place=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)) -> Packet:
    return packet_of(dialect.MAVLink_local_position_ned_message(1, *place, *velocity))


def told(*packets: Packet) -> HeardMotion:
    heard = HeardMotion()
    for packet in packets:
        heard.take(packet, 10.0)
    return heard


def test_velocity_over_ground_is_what_was_told():
    motion = told(attitude(yaw=0.7), position((1.0, 2.0, 3.0), (0.5, -0.2, 0.1))).motion(10.1)
    assert (motion.north_m, motion.east_m, motion.down_m) == (1.0, 2.0, 3.0)
    assert motion.velocity_ned_mps() == pytest.approx((0.5, -0.2, 0.1))
    assert motion.forward_mps == pytest.approx(0.5 * cos(0.7) - 0.2 * sin(0.7))


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.3, -0.4, 2.0), (-1.0, 1.2, -3.0)])
def test_rates_of_the_angles_give_the_bodys_rates_again(angles):
    rates = (0.1, -0.2, 0.3)
    motion = told(attitude(*angles, rates), position()).motion(10.0)
    turned = motion.roll_rate_radps, motion.pitch_rate_radps, motion.yaw_rate_radps
    assert body_rates(attitude_rad(motion), turned) == pytest.approx(rates, abs=1e-6)


def test_straight_up_nothing_is_divided_by_nothing():
    motion = told(attitude(0.1, pi / 2, 0.0, (0.1, 0.2, 0.3)), position()).motion(10.0)
    assert abs(motion.yaw_rate_radps) < 1.0


@pytest.mark.parametrize("packets", [(), (attitude(),), (position(),)])
def test_half_of_it_is_no_motion(packets):
    assert told(*packets).motion(10.0) is None


def test_what_was_told_too_long_ago_is_no_motion():
    heard = told(attitude(), position())
    assert heard.motion(10.9) is not None
    assert heard.motion(11.1) is None


def test_numbers_that_are_none_are_passed_over():
    heard = told(attitude(), position((1.0, 0.0, 0.0)))
    heard.take(position((nan, 0.0, 0.0)), 10.5)
    heard.take(attitude(roll=nan), 10.5)
    heard.take(packet_of(dialect.MAVLink_sim_state_message(**{**SIMULATED, "vn": nan})), 10.5)
    assert heard.motion(10.6).north_m == 1.0


def test_a_simulators_places_count_from_the_first():
    heard = HeardMotion()
    for time_s, north_deg in ((10.0, -35.0), (10.1, -35.0 + 1e-4)):
        state = {**SIMULATED, "lat_int": round(1e7 * north_deg), "lon_int": 1_490_000_000, "alt": -3.0, "vn": 0.5}
        heard.take(packet_of(dialect.MAVLink_sim_state_message(**state)), time_s)
    motion = heard.motion(10.1)
    assert motion.north_m == pytest.approx(1e-4 * METRES_PER_DEGREE_NORTH, rel=1e-3)
    assert (motion.east_m, motion.down_m) == (0.0, 3.0)
    assert motion.velocity_ned_mps() == pytest.approx((0.5, 0.0, 0.0))


def test_when_the_simulator_falls_silent_the_estimate_counts():
    heard = told(attitude(), position((1.0, 0.0, 0.0)), packet_of(dialect.MAVLink_sim_state_message(**SIMULATED)))
    assert heard.motion(10.5).north_m == 0.0
    heard.take(attitude(), 12.0)
    heard.take(position((1.0, 0.0, 0.0)), 12.0)
    assert heard.motion(12.0).north_m == 1.0

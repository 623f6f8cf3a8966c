"""The decoder against pymavlink's own."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.command import CommandScale
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.mavlink.tests.peer import EscInfoMessage, EscStatusMessage, Peer, messages_in
from drivers.readings import (
    Attitude,
    AutopilotConflict,
    AutopilotHeartbeat,
    AutopilotReboot,
    CommandAcknowledgement,
    GlobalPosition,
    LocalPosition,
    ThrusterCommand,
    ThrusterReport,
)

PWM = CommandScale(1100.0, 1500.0, 1900.0)
UINT16 = st.integers(0, 65535)
FLOAT32 = st.floats(width=32)
FOUR_UINT16 = st.tuples(UINT16, UINT16, UINT16, UINT16)


def thruster(number=1, **fields):
    return MavlinkThruster(number, **fields)


def decoder(*thrusters, system=1):
    return MavlinkDecoder(thrusters, autopilot_system=system)


def test_an_answer_by_two_routes_is_one_answer():
    decode, autopilot = decoder(), Peer()
    answer = autopilot.acknowledgement(511, 0)
    assert len(decode.decode(answer + answer, 0.0)) == 1
    assert decode.decode(answer, 0.4) == []
    assert len(decode.decode(autopilot.acknowledgement(511, 0), 0.5)) == 1  # to the next one
    assert decode.drops == {"repeated": 2}


# What comes in ------------------------------------------------------------------------------------


def test_heartbeat():
    frame = Peer().heartbeat(base_mode=0xD1, custom_mode=9, state=5)
    assert decoder().decode(frame, 3.0) == [AutopilotHeartbeat(3.0, 1, 1, 3, 12, True, 9, 5)]


@pytest.mark.parametrize("sender", [Peer(255, 190), Peer(1, 194), Peer(1, 192), Peer(1, 100)])
def test_ground_stations_companions_and_our_own_echo_are_ignored(sender):
    decode = decoder(thruster(servo_channel=1, command_scale=PWM), system=None)
    decode.decode(Peer().heartbeat(), 0.0)
    data = sender.heartbeat(autopilot=8, vehicle_type=18) + sender.attitude() + sender.servo_output([1900])
    assert decode.decode(data, 0.1) == []
    assert decode.autopilot_system == 1


def test_component_1_without_an_autopilot_is_no_autopilot():
    decode = decoder(system=None)
    assert decode.decode(Peer(7).heartbeat(autopilot=8), 0.0) == []
    assert decode.autopilot_system is None


@given(st.tuples(*[FLOAT32] * 6), st.booleans())
def test_attitude(values, mavlink1):
    data = Peer().pack(dialect.MAVLink_attitude_message(1, *values), mavlink1=mavlink1)
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 1.0)
    if readings:
        assert readings == [
            Attitude(1.0, sent.roll, sent.pitch, sent.yaw, sent.rollspeed, sent.pitchspeed, sent.yawspeed, 0.001)
        ]
        assert all(map(math.isfinite, values))
    else:
        assert decode.drops == {"implausible attitude": 1}
        assert not all(abs(value) <= 2 * math.pi for value in values)


@given(st.tuples(*[FLOAT32] * 6))
def test_local_position(values):
    data = Peer().pack(dialect.MAVLink_local_position_ned_message(1, *values))
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 1.0)
    if readings:
        assert readings == [LocalPosition(1.0, (sent.x, sent.y, sent.z), (sent.vx, sent.vy, sent.vz))]
        assert all(map(math.isfinite, values))
    else:
        assert decode.drops == {"implausible local position": 1}
        assert not all(abs(value) <= 100.0 for value in values)


INT32, INT16 = st.integers(-(2**31), 2**31 - 1), st.integers(-(2**15), 2**15 - 1)


@given(INT32, INT32, INT32, INT16, INT16, INT16)
def test_global_position(latitude, longitude, altitude, north, east, down):
    message = dialect.MAVLink_global_position_int_message(
        1, latitude, longitude, altitude, 0, north, east, down, 65535
    )
    decode = decoder()
    readings = decode.decode(Peer().pack(message), 1.0)
    if not readings:
        assert sum(decode.drops.values()) == 1
        assert latitude == longitude == 0 or abs(latitude) > 90e7 or abs(longitude) > 180e7
        return
    (position,) = readings
    assert isinstance(position, GlobalPosition)
    assert math.degrees(position.latitude_rad) * 1e7 == pytest.approx(latitude, abs=1e-3)
    assert math.degrees(position.longitude_rad) * 1e7 == pytest.approx(longitude, abs=1e-3)
    assert position.depth_m == -altitude / 1000
    assert position.velocity_mps == (north / 100, east / 100, down / 100)
    assert position.boot_s == 0.001


def test_latitude_and_longitude_zero_are_no_position():
    decode = decoder()
    message = dialect.MAVLink_global_position_int_message(1, 0, 0, -2000, -2000, 1, 2, 3, 0)
    assert decode.decode(Peer().pack(message), 1.0) == []
    assert decode.drops == {"no global position": 1}


@given(st.lists(UINT16, min_size=16, max_size=16), st.sampled_from([0, 1]))
def test_servo_output(pulses, port):
    thrusters = [thruster(i, servo_channel=i, command_scale=PWM) for i in range(1, 33)]
    decode = decoder(*thrusters)
    data = Peer().servo_output(pulses, port=port)
    (sent,) = messages_in(data)
    wanted = {}
    for i in range(1, 17):
        pulse = getattr(sent, f"servo{i}_raw")
        if pulse and PWM.fraction(pulse) is not None:
            wanted[16 * port + i] = PWM.fraction(pulse)
    readings = decode.decode(data, 2.0)
    assert readings == [ThrusterCommand(2.0, number, fraction) for number, fraction in wanted.items()]
    assert decode.drops["command out of range"] == sum(p > 0 for p in pulses) - len(wanted)


def test_mavlink_1_has_eight_channels_and_the_rest_is_unused():
    thrusters = [thruster(i, servo_channel=i, command_scale=PWM) for i in range(1, 17)]
    frame = Peer().servo_output([1500] * 16, mavlink1=True)
    body = bytes((21,)) + frame[2 : 6 + 21]  # pymavlink appends the MAVLink 2 extension to MAVLink 1 as well
    crc_extra = dialect.MAVLink_servo_output_raw_message.crc_extra
    frame = frame[:1] + body + dialect.x25crc(body + bytes((crc_extra,))).crc.to_bytes(2, "little")
    readings = decoder(*thrusters).decode(frame, 0.0)
    assert [reading.thruster for reading in readings] == list(range(1, 9))


def test_a_port_that_does_not_exist_is_ignored():
    decode = decoder(thruster(servo_channel=1, command_scale=PWM))
    assert decode.decode(Peer().servo_output([1500], port=200), 0.0) == []


@given(st.lists(FLOAT32, min_size=32, max_size=32))
def test_actuator_outputs(outputs):
    decode = decoder(*[thruster(i, actuator=i, command_scale=PWM) for i in range(1, 33)])
    data = Peer().actuator_output(outputs)
    (sent,) = messages_in(data)
    used = {i: PWM.fraction(value) for i, value in enumerate(sent.actuator, start=1) if value != 0.0}
    assert decode.decode(data, 2.0) == [
        ThrusterCommand(2.0, i, fraction) for i, fraction in used.items() if fraction is not None
    ]
    assert decode.drops["command out of range"] == list(used.values()).count(None)
    assert decode.decode(data, 2.1) == []
    assert decode.drops["repeated"] == 1


def test_zero_of_an_actuator_is_a_command_where_it_lies_within_the_scale():
    decode = decoder(
        thruster(1, actuator=1, command_scale=CommandScale(-1.0, 0.0, 1.0)),
        thruster(2, actuator=2, command_scale=PWM),
    )
    assert decode.decode(Peer().actuator_output([0.0, 0.0]), 2.0) == [ThrusterCommand(2.0, 1, 0.0)]
    assert not decode.drops


@given(st.integers(0, 7), FOUR_UINT16, FOUR_UINT16, FOUR_UINT16, st.tuples(*[st.integers(0, 255)] * 4))
def test_esc_telemetry(group, voltage, current, rpm, temperature):
    decode = decoder(*[thruster(i + 1, esc_index=i) for i in range(32)])
    data = Peer().esc_telemetry(group, temperature, voltage, current, rpm, count=(1, 2, 3, 4))
    (sent,) = messages_in(data)
    readings = decode.decode(data, 5.0)
    assert [reading.thruster for reading in readings] == [4 * group + i for i in range(1, 5)]
    for i, reading in enumerate(readings):
        assert reading.speed_rpm == (sent.rpm[i] if sent.rpm[i] < 65535 else None)
        assert reading.voltage_v == (sent.voltage[i] / 100 if 0 < sent.voltage[i] < 65535 else None)
        assert reading.current_a == (sent.current[i] / 100 if 0 < sent.current[i] < 65535 else None)
        known = 0 < sent.temperature[i] < 200
        assert reading.temperature_k == (sent.temperature[i] + 273.15 if known else None)
    assert decode.drops["implausible speed"] == rpm.count(65535)


def speeds(decode, data):
    return [reading.speed_rpm for reading in decode.decode(data, 0.0)]


def test_an_esc_that_never_spoke_is_absent_not_stopped():
    decode, peer = decoder(thruster(1, esc_index=0), thruster(2, esc_index=1)), Peer()
    assert speeds(decode, peer.esc_telemetry()) == [900.0]
    assert decode.drops == {"ESC absent": 1}


def test_an_esc_that_fell_silent_repeats_itself_or_says_zero():
    decode, peer = decoder(thruster(esc_index=0)), Peer()
    assert speeds(decode, peer.esc_telemetry(count=(9, 0, 0, 0))) == [900.0]
    assert speeds(decode, peer.esc_telemetry(count=(9, 0, 0, 0))) == []
    assert speeds(decode, peer.esc_telemetry(count=(9, 0, 0, 0), rpm=(0, 0, 0, 0))) == []
    assert speeds(decode, peer.esc_telemetry(count=(10, 0, 0, 0), rpm=(0, 0, 0, 0))) == [0.0]
    assert decode.drops == {"repeated": 2}


def test_speed_from_a_source_that_does_not_count():
    decode, peer = decoder(thruster(esc_index=0)), Peer()
    nothing = (0, 0, 0, 0)
    for rpm in (900, 900, 910, 0, 0):
        assert speeds(decode, peer.esc_telemetry(0, nothing, nothing, nothing, (rpm, 0, 0, 0), count=nothing)) == [
            rpm
        ]


def test_a_new_speed_is_news_even_between_two_counted_packets():
    decode, peer = decoder(thruster(esc_index=0)), Peer()
    assert speeds(decode, peer.esc_telemetry(rpm=(900, 0, 0, 0))) == [900.0]
    assert speeds(decode, peer.esc_telemetry(rpm=(950, 0, 0, 0))) == [950.0]


def test_zero_current_means_something_only_from_an_esc_that_measures_it():
    decode, peer = decoder(thruster(esc_index=0)), Peer()
    currents = [
        decode.decode(peer.esc_telemetry(current=(centiamperes, 0, 0, 0), count=(count, 0, 0, 0)), 0.0)[0].current_a
        for count, centiamperes in enumerate((0, 150, 0), start=1)
    ]
    assert currents == [None, 1.5, 0.0]


@given(
    st.tuples(*[st.integers(-(2**31), 2**31 - 1).filter(bool)] * 4), st.tuples(*[FLOAT32] * 4),
    st.tuples(*[FLOAT32] * 4), st.integers(0, 15),
)  # fmt: skip
def test_esc_status_of_px4(rpm, voltage, current, group):
    decode = decoder(*[thruster(i + 1, esc_index=i, signed=True, reverse=i % 2 == 1) for i in range(64)])
    readings = decode.decode(Peer().pack(EscStatusMessage(4 * group, 1, rpm, voltage, current)), 1.0)
    assert [reading.thruster for reading in readings] == [4 * group + i for i in range(1, 5)]
    for i, reading in enumerate(readings):
        direction = -1 if i % 2 else 1
        assert reading.speed_rpm == (direction * rpm[i] if abs(rpm[i]) < 65535 else None)
        assert reading.voltage_v == (voltage[i] if 0.0 < voltage[i] < 655.35 else None)
        assert reading.current_a is None or abs(current[i]) < 655.35


def test_unsigned_esc_status_gives_the_magnitude():
    decode = decoder(thruster(esc_index=0, reverse=True))
    data = Peer().pack(EscStatusMessage(0, 1, (-700, 0, 0, 0), (16.0,) * 4, (1.0,) * 4))
    assert speeds(decode, data) == [700.0]


def test_esc_info_of_px4():
    decode = decoder(thruster(1, esc_index=0), thruster(2, esc_index=1), thruster(3, esc_index=2))
    data = Peer().pack(EscInfoMessage(0, 1, 2, (7, 8, 9, 0), (2500, 32767, 100, 0)))
    assert decode.decode(data, 1.0) == [
        ThrusterReport(1.0, 1, temperature_k=298.15, error_count=7),
        ThrusterReport(1.0, 2, error_count=8),
    ]


def test_failures_that_an_esc_reports_are_counted_by_their_names():
    decode = decoder(thruster(3, esc_index=1))
    flags = (0b1, 0b10_0010_0001, 0, 0)
    decode.decode(Peer().pack(EscInfoMessage(0, 1, 2, (0,) * 4, (2500,) * 4, flags)), 1.0)
    assert decode.drops == {
        "ESC of thruster 3 says: over current": 1,
        "ESC of thruster 3 says: motor stuck": 1,
        "ESC of thruster 3 says: ESC over temperature": 1,
    }


def groups(peer, time_us, first, second):
    voltage = (16.0, math.nan, 16.0, 16.0)
    return [
        peer.pack(EscStatusMessage(index, time_us, rpm, voltage, (1.0,) * 4))
        for index, rpm in ((0, first), (4, second))
    ]


def test_px4_versions_that_repeat_the_first_four_escs_as_the_next_four():
    decode, peer = decoder(thruster(1, esc_index=0), thruster(5, esc_index=4)), Peer()

    def numbers(time_us, first, second):
        readings = decode.decode(b"".join(groups(peer, time_us, first, second)), time_us / 1e6)
        return [(reading.thruster, reading.speed_rpm) for reading in readings]

    rest, turning, other = (0,) * 4, (900, 910, 0, 5), (900, 910, 0, 6)
    assert numbers(1_000_000, rest, rest) == [(1, 0), (5, 0)]  # may well be so
    assert numbers(2_000_000, turning, turning) == [(1, 900)]
    assert numbers(3_000_000, rest, rest) == [(1, 0)]
    assert decode.drops == {"ESC group with the values of the first": 2}
    assert numbers(4_000_000, turning, other) == [(1, 900), (5, 900)]


def test_px4_versions_that_repeat_what_they_know_of_the_first_four_escs():
    decode, peer = decoder(thruster(1, esc_index=0), thruster(5, esc_index=4)), Peer()
    data = b"".join(peer.pack(EscInfoMessage(index, 1, 8, (7, 0, 0, 0), (2500, 2600, 0, 0))) for index in (0, 4))
    assert decode.decode(data, 1.0) == [ThrusterReport(1.0, 1, temperature_k=298.15, error_count=7)]
    assert decode.drops == {"ESC group with the values of the first": 1}


@pytest.mark.parametrize(
    ("rpm", "wanted", "cause"),
    [
        (812.5, [812.5], None),
        (-1.0, [], "RPM sensor without a signal"),
        (65535.0, [], "implausible speed"),
        (math.nan, [], "implausible speed"),
    ],
)
def test_rpm_sensors(rpm, wanted, cause):
    decode = decoder(thruster(rpm_sensor=2))
    assert speeds(decode, Peer().pack(dialect.MAVLink_rpm_message(1.0, rpm))) == wanted
    assert decode.drops == ({cause: 1} if cause else {})


@pytest.mark.parametrize(
    ("system", "component", "ours"), [(0, 0, True), (1, 192, True), (255, 190, False), (1, 193, False)]
)
def test_acknowledgements_for_us(system, component, ours):
    readings = decoder().decode(Peer().acknowledgement(511, 2, system, component), 1.0)
    assert readings == ([CommandAcknowledgement(1.0, 1, 1, 511, 2, 255)] if ours else [])


# Repeated, late, restarted ------------------------------------------------------------------------


def test_what_came_already_by_another_route_is_dropped():
    decode, peer = decoder(thruster(servo_channel=1, command_scale=PWM)), Peer()
    for data in (peer.attitude(5000), peer.servo_output([1500], 5_000_000)):
        assert len(decode.decode(data, 0.0)) == 1
        assert decode.decode(data, 0.0) == []
    assert decode.decode(peer.attitude(4900) + peer.servo_output([1500], 4_900_000), 0.1) == []
    assert decode.drops == {"repeated": 2, "late": 2}


def test_microseconds_wrap_after_72_minutes():
    decode, peer = decoder(thruster(servo_channel=1, command_scale=PWM)), Peer()
    for time_us in (2**32 - 10_000, 40_000, 90_000):
        assert len(decode.decode(peer.servo_output([1500], time_us), 0.0)) == 1


def test_a_sender_without_a_clock_is_heard():
    decode, peer = decoder(), Peer()
    assert [len(decode.decode(peer.attitude(0), 0.0)) for _ in range(3)] == [1, 1, 1]


def test_a_restart_shows_once_in_whatever_message_comes_first():
    decode, peer = decoder(), Peer()
    decode.decode(peer.attitude(500_000), 0.0)
    readings = decode.decode(peer.pack(dialect.MAVLink_system_time_message(0, 3000)) + peer.attitude(3010), 7.0)
    assert [type(reading) for reading in readings] == [AutopilotReboot, Attitude]
    assert readings[0] == AutopilotReboot(7.0, 1)


def test_milliseconds_that_wrap_are_no_restart():
    decode, peer = decoder(), Peer()
    for boot_ms in (2**32 - 30, 20):
        assert [type(reading) for reading in decode.decode(peer.attitude(boot_ms), 0.0)] == [Attitude]


# Which autopilot ----------------------------------------------------------------------------------


def test_nothing_is_taken_before_the_first_heartbeat():
    decode, peer = decoder(system=None), Peer(3)
    assert decode.decode(peer.attitude(), 0.0) == []
    assert decode.drops == {"not our autopilot": 1}
    assert len(decode.decode(peer.heartbeat() + peer.attitude(), 0.1)) == 2
    assert decode.decode(peer.acknowledgement(511, 0, 3, 192), 0.2) == [
        CommandAcknowledgement(0.2, 3, 1, 511, 0, 255)
    ]
    assert decode.autopilot_system == 3


def test_two_autopilots_are_none_until_one_is_left():
    decode, ours, other = decoder(system=None), Peer(1), Peer(2)
    decode.decode(ours.heartbeat(), 0.0)
    assert decode.decode(other.heartbeat(), 0.5) == [AutopilotConflict(0.5, (1, 2))]
    assert decode.autopilot_system is None
    assert decode.decode(ours.heartbeat() + ours.attitude() + other.attitude(), 1.0) == []
    assert decode.drops == {"other autopilot": 2, "not our autopilot": 2}
    readings = decode.decode(ours.heartbeat() + ours.attitude(2000), 5.6)
    assert readings[0] == AutopilotConflict(5.6, (1,))
    assert [type(reading) for reading in readings[1:]] == [AutopilotHeartbeat, Attitude]


def test_an_autopilot_that_was_alone_for_a_while_stays_ours():
    decode, ours, other = decoder(system=None), Peer(1), Peer(2)
    for second in range(12):
        decode.decode(ours.heartbeat(), float(second))
    assert decode.decode(other.heartbeat(), 11.5) == [AutopilotConflict(11.5, (1, 2))]
    assert decode.autopilot_system == 1
    readings = decode.decode(other.attitude() + ours.heartbeat() + ours.attitude(), 12.0)
    assert [type(reading) for reading in readings] == [AutopilotHeartbeat, Attitude]
    readings = decode.decode(ours.heartbeat(), 17.0)
    assert [type(reading) for reading in readings] == [AutopilotConflict, AutopilotHeartbeat]
    assert readings[0].system_ids == (1,)


def test_two_that_were_there_from_the_start_never_become_ours_by_lasting():
    decode, ours, other = decoder(system=None), Peer(1), Peer(2)
    for second in range(40):
        decode.decode(ours.heartbeat(), float(second))
        decode.decode(other.heartbeat(), second + 0.5)
    assert decode.autopilot_system is None


def test_a_configured_autopilot_has_no_rival():
    decode, ours, other = decoder(system=2), Peer(2), Peer(1)
    readings = decode.decode(ours.attitude() + other.heartbeat() + other.attitude() + ours.heartbeat(), 0.0)
    assert [type(reading) for reading in readings] == [Attitude, AutopilotHeartbeat]
    assert decode.drops == {"other autopilot": 1, "not our autopilot": 1}


@pytest.mark.parametrize(
    "build",
    [
        lambda: thruster(0),
        lambda: thruster(servo_channel=33, command_scale=PWM),
        lambda: thruster(servo_channel=1),
        lambda: thruster(command_scale=PWM),
        lambda: thruster(actuator=33, command_scale=PWM),
        lambda: thruster(actuator=1),
        lambda: thruster(actuator=1, servo_channel=1, command_scale=PWM),
        lambda: thruster(esc_index=64),
        lambda: thruster(rpm_sensor=3),
        lambda: thruster(rpm_sensor=1, esc_index=0),
        lambda: decoder(thruster(1), thruster(1)),
        lambda: decoder(thruster(1, esc_index=2), thruster(2, esc_index=2)),
        lambda: decoder(system=255),
        lambda: MavlinkDecoder([], own_component=1),
    ],
)
def test_callers_mistakes_are_value_errors(build):
    with pytest.raises(ValueError, match="got"):
        build()

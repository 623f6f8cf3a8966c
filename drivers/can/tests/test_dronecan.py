"""DroneCAN frames to readings: what is right, and what is dropped."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.bus_readings import BusReading, EscConflict
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster, encode_esc_status, encode_raw_command
from drivers.can.dronecan.esc_status import EscStatus
from drivers.can.dronecan.transfer import TRANSFER_TIMEOUT_S
from drivers.can.frame import CanFrame
from drivers.can.tests import dronecan_reference as reference
from drivers.readings import ThrusterCommand, ThrusterReport

EIGHT = [DroneCanThruster(thruster=i + 1, esc_index=i) for i in range(8)]


def status(esc_index=0, speed_rpm=1000, voltage_v=16.0, current_a=2.5, temperature_k=300.0):
    return EscStatus(7, voltage_v, current_a, temperature_k, speed_rpm, 50, esc_index)


def feed(decoder, frames):
    return [reading for frame in frames for reading in decoder.decode(frame)]


def only_status(decoder, values, node=20, transfer_id=0, time_s=5.0):
    (report,) = feed(decoder, encode_esc_status(values, node, transfer_id, time_s=time_s))
    return report


# What is right


@given(st.lists(st.integers(-8192, 8191), min_size=1, max_size=20), st.integers(0, 31))
@settings(max_examples=40)
def test_commands_of_the_package_become_fractions(values, transfer_id):
    decoder = DroneCanDecoder([DroneCanThruster(i + 1, i) for i in range(len(values))])
    frames = reference.encode(reference.esc.RawCommand(cmd=values), 10, transfer_id, time_s=3.0)
    expected = [ThrusterCommand(3.0, i + 1, max(value / 8191, -1.0)) for i, value in enumerate(values)]
    assert feed(decoder, frames) == expected
    assert not decoder.drops


@given(st.integers(-30000, 30000), st.integers(0, 7), st.floats(4.0, 60.0, width=16), st.floats(-50, 50, width=16))
@settings(max_examples=40)
def test_status_of_the_package_becomes_a_report(speed_rpm, esc_index, voltage_v, current_a):
    decoder = DroneCanDecoder(EIGHT)
    values = status(esc_index, speed_rpm, voltage_v, current_a)
    frames = reference.encode(reference.status(values), 20, 4, time_s=3.0)
    (report,) = feed(decoder, frames)
    assert report == ThrusterReport(
        3.0, esc_index + 1, speed_rpm, voltage_v, pytest.approx(current_a, abs=1e-4), 300.0, 7
    )
    assert not decoder.drops


@pytest.mark.parametrize(
    ("options", "command", "fraction"),
    [
        ({}, 4095, 4095 / 8191),
        ({}, -8192, -1.0),
        ({"reverse": True}, 8191, -1.0),
        ({"reverse": True}, 0, 0.0),
        ({"bidirectional_command": False}, 4095, 0.0),
        ({"bidirectional_command": False}, 4096, 0.0),
        ({"bidirectional_command": False}, 8191, 1.0),
        ({"bidirectional_command": False}, 0, -1.0),
        ({"bidirectional_command": False, "reverse": True}, 8191, -1.0),
        ({"bidirectional_command": False}, -500, None),
    ],
)
def test_a_command_is_read_as_the_thruster_is_wired(options, command, fraction):
    decoder = DroneCanDecoder([DroneCanThruster(1, 0, **options)])
    readings = feed(decoder, encode_raw_command([command, 4095], 10, 0))
    assert [reading.fraction for reading in readings] == ([] if fraction is None else [fraction])
    assert decoder.drops == ({"command out of range": 1} if fraction is None else {})


def test_nothing_but_zeros_at_half_scale_is_disarmed_and_not_full_reverse():
    decoder = DroneCanDecoder([DroneCanThruster(1, 0, bidirectional_command=False)])
    (reading,) = feed(decoder, encode_raw_command([0] * 8, 10, 0))
    assert reading.fraction == 0.0


@pytest.mark.parametrize(
    ("options", "speed_rpm"), [({}, -900.0), ({"reverse": True}, 900.0), ({"signed": False}, 900.0)]
)
def test_speed_has_the_sign_that_the_esc_has(options, speed_rpm):
    decoder = DroneCanDecoder([DroneCanThruster(1, 0, **options)])
    assert only_status(decoder, status(speed_rpm=-900)).speed_rpm == speed_rpm


def test_a_commander_that_stops_short_of_an_esc_says_nothing_of_it():
    decoder = DroneCanDecoder([DroneCanThruster(1, 0), DroneCanThruster(2, 3)])
    readings = feed(decoder, encode_raw_command([100, 200], 10, 0))
    assert [reading.thruster for reading in readings] == [1]
    assert decoder.drops == {"command missing": 1}


def test_filters_let_through_what_is_decoded_and_not_its_neighbours():
    filters = DroneCanDecoder(EIGHT).filters()
    wanted = [*encode_raw_command([1] * 8, 10, 0), *encode_esc_status(status(), 99, 0, priority=3)]
    assert all(any(wants.matches(frame) for wants in filters) for frame in wanted)
    rpm_sensor = CanFrame(0.0, 24 << 24 | 1045 << 8 | 20, b"\0" * 8)
    service = CanFrame(0.0, wanted[0].identifier | 0x80, b"\0" * 8)
    standard = CanFrame(0.0, 0x406, b"\0" * 8, extended=False)
    assert not any(wants.matches(frame) for wants in filters for frame in (rpm_sensor, service, standard))


# What is not measured, or not plausible


@pytest.mark.parametrize("speed_rpm", [65535, -65535, 30001, -30001, 131071, -131072])
def test_an_impossible_speed_is_no_speed_and_costs_nothing_else(speed_rpm):
    decoder = DroneCanDecoder(EIGHT)
    report = only_status(decoder, status(speed_rpm=speed_rpm))
    assert report.speed_rpm is None
    assert report.voltage_v == 16.0
    assert decoder.drops == {"implausible speed": 1}


def test_65535_is_a_sentinel_even_below_the_limit():
    decoder = DroneCanDecoder(EIGHT, speed_limit_rpm=100_000.0)
    assert only_status(decoder, status(speed_rpm=65535)).speed_rpm is None
    assert only_status(decoder, status(speed_rpm=65534), transfer_id=1).speed_rpm == 65534.0


def test_what_an_esc_does_not_know_is_none_and_no_drop():
    decoder = DroneCanDecoder(EIGHT)
    report = only_status(decoder, status(voltage_v=math.nan, current_a=math.nan, temperature_k=math.nan))
    assert (report.voltage_v, report.current_a, report.temperature_k) == (None, None, None)
    report = only_status(decoder, status(voltage_v=0.0, current_a=0.0, temperature_k=0.0), transfer_id=1)
    assert (report.voltage_v, report.current_a, report.temperature_k) == (None, 0.0, None)
    assert not decoder.drops


def test_infinity_is_none_and_counted():
    decoder = DroneCanDecoder(EIGHT)
    report = only_status(decoder, status(voltage_v=math.inf, current_a=-math.inf))
    assert (report.voltage_v, report.current_a, report.speed_rpm) == (None, None, 1000.0)
    assert decoder.drops == {"non-finite": 2}


# Who may speak


def test_another_node_than_the_configured_one_is_not_believed():
    decoder = DroneCanDecoder([DroneCanThruster(1, 0, node_id=20)])
    assert feed(decoder, encode_esc_status(status(), 21, 0)) == [EscConflict(0.0, 1, 0, (21,), 20)]
    assert only_status(decoder, status(), node=20).thruster == 1
    assert decoder.drops == {"unknown node": 1}


def test_an_esc_that_is_not_configured_is_counted():
    decoder = DroneCanDecoder(EIGHT)
    assert feed(decoder, encode_esc_status(status(esc_index=9), 20, 0)) == []
    assert decoder.drops == {"unknown ESC": 1}


def test_the_second_node_that_claims_an_esc_index_is_refused_until_the_first_is_offline():
    decoder = DroneCanDecoder(EIGHT)
    assert only_status(decoder, status(speed_rpm=1000), node=20, time_s=0.0)
    assert feed(decoder, encode_esc_status(status(speed_rpm=1), 66, 0, time_s=2.9)) == []
    assert decoder.drops == {"duplicate source": 1}
    assert only_status(decoder, status(speed_rpm=2), node=66, transfer_id=1, time_s=3.1).speed_rpm == 2.0


def test_the_second_commander_is_refused_until_the_first_is_offline():
    decoder = DroneCanDecoder(EIGHT[:1])
    assert feed(decoder, encode_raw_command([100], 10, 0, time_s=0.0))
    assert feed(decoder, encode_raw_command([-8000], 11, 0, time_s=0.1)) == []
    assert feed(decoder, encode_raw_command([200], 10, 1, time_s=0.2))
    assert decoder.drops == {"duplicate source": 1}


def test_one_node_may_speak_for_several_escs():
    decoder = DroneCanDecoder(EIGHT)
    for index in range(4):
        assert only_status(decoder, status(esc_index=index), transfer_id=index).thruster == index + 1


# What is foreign or broken


def test_foreign_frames_pass_uncounted():
    decoder = DroneCanDecoder(EIGHT)
    frame = encode_esc_status(status(), 20, 0)[0]
    for foreign in (
        CanFrame(0.0, 1045 << 8 | 20, bytes(8)),
        CanFrame(0.0, 0x406, bytes(8), extended=False),
        CanFrame(0.0, frame.identifier | 0x80, frame.data),
        CanFrame(0.0, frame.identifier, frame.data, error=True),
    ):
        assert decoder.decode(foreign) == ()
    assert not decoder.drops


@pytest.mark.parametrize(
    ("frame", "cause"),
    [
        (CanFrame(0.0, 1034 << 8 | 20, b""), "empty frame"),
        (CanFrame(0.0, 1034 << 8 | 20, b"\xe0"), "toggle"),
        (CanFrame(0.0, 1034 << 8 | 20, bytes(7) + b"\x20"), "missing start"),
        (CanFrame(0.0, 1034 << 8, bytes(7) + b"\xc0"), "anonymous node"),
        (CanFrame(0.0, 1034 << 8 | 20, bytes(64), fd=True), "CAN FD"),
        (CanFrame(0.0, 1034 << 8 | 20, bytes(7) + b"\xc0"), "wrong length"),
        (CanFrame(0.0, 1030 << 8 | 20, bytes(3) + b"\xc0"), "wrong length"),
        (CanFrame(0.0, 1030 << 8 | 20, bytes(5) + b"\x80"), "wrong length"),
    ],
)
def test_a_broken_frame_is_dropped_and_counted(frame, cause):
    decoder = DroneCanDecoder(EIGHT)
    assert list(decoder.decode(frame)) == []
    assert decoder.drops == {cause: 1}


def test_a_transfer_that_does_not_end_is_cut_off():
    decoder = DroneCanDecoder(EIGHT)
    for i in range(40):
        tail = 0x20 * (i % 2) if i else 0x80
        assert not decoder.decode(CanFrame(0.0, 1030 << 8 | 20, bytes(7) + bytes([tail])))
    assert decoder.drops["wrong length"] > 30


def test_a_flipped_bit_is_found_by_the_crc():
    frames = encode_esc_status(status(), 20, 0)
    for number, frame in enumerate(frames):
        for bit in range(8 * (len(frame.data) - 1)):
            data = bytearray(frame.data)
            data[bit // 8] ^= 1 << bit % 8
            decoder = DroneCanDecoder(EIGHT)
            assert (
                feed(decoder, [*frames[:number], CanFrame(0.0, frame.identifier, bytes(data)), *frames[number + 1 :]])
                == []
            )
            assert decoder.drops == {"CRC": 1}


def test_a_lost_frame_costs_its_node_one_transfer_and_others_none():
    decoder = DroneCanDecoder(EIGHT)
    first, second = encode_esc_status(status(0), 20, 0), encode_esc_status(status(1), 21, 0)
    readings = feed(decoder, [first[0], second[0], second[1], first[2], second[2]])
    assert [reading.thruster for reading in readings] == [2]
    assert decoder.drops == {"toggle": 1}
    assert only_status(decoder, status(0), node=20, transfer_id=1).thruster == 1


def test_a_lost_last_frame_is_noticed_at_the_next_start():
    decoder = DroneCanDecoder(EIGHT)
    feed(decoder, encode_esc_status(status(), 20, 0)[:2])
    assert only_status(decoder, status(), transfer_id=1)
    assert decoder.drops == {"unfinished transfer": 1}


def test_a_repeated_frame_does_not_cost_the_transfer():
    decoder = DroneCanDecoder(EIGHT)
    a, b, c = encode_esc_status(status(), 20, 0)
    assert len(feed(decoder, [a, a, b, b, b, c, c])) == 1
    assert decoder.drops == {"repeated frame": 4}


def test_a_repeated_transfer_is_dropped_until_its_id_is_stale():
    decoder = DroneCanDecoder(EIGHT)
    assert only_status(decoder, status(), time_s=0.0)
    assert feed(decoder, encode_esc_status(status(), 20, 0, time_s=0.1)) == []
    assert decoder.drops == {"repeated transfer": 3}
    assert only_status(decoder, status(), time_s=TRANSFER_TIMEOUT_S + 0.2)


def test_a_repeated_single_frame_transfer_is_dropped():
    decoder = DroneCanDecoder(EIGHT[:1])
    (frame,) = encode_raw_command([100], 10, 3)
    assert len(feed(decoder, [frame, frame])) == 1
    assert decoder.drops == {"repeated transfer": 1}


@pytest.mark.parametrize("late_s", [TRANSFER_TIMEOUT_S + 0.1, -1.0])
def test_a_transfer_that_takes_too_long_or_goes_back_in_time_is_dropped(late_s):
    decoder = DroneCanDecoder(EIGHT)
    a, b, c = encode_esc_status(status(), 20, 0, time_s=10.0)
    late = CanFrame(10.0 + late_s, b.identifier, b.data)
    assert feed(decoder, [a, late, c]) == []
    assert decoder.drops == {"timed out": 2}


def test_frames_of_two_transfers_are_not_joined():
    decoder = DroneCanDecoder(EIGHT)
    first, second = encode_esc_status(status(), 20, 0), encode_esc_status(status(), 20, 1)
    assert feed(decoder, [first[0], second[1], second[2]]) == []
    assert decoder.drops == {"transfer id": 2}


identifiers = st.builds(
    lambda kind, source, priority: priority << 24 | kind << 8 | source,
    st.sampled_from([341, 1030, 1031, 1034, 1036]),
    st.integers(0, 255),
    st.integers(0, 31),
)


@given(st.lists(st.tuples(identifiers, st.binary(max_size=8), st.floats(-5.0, 5.0)), max_size=30))
def test_no_bytes_make_it_raise(frames):
    decoder = DroneCanDecoder(EIGHT)
    for identifier, data, time_s in frames:
        for reading in decoder.decode(CanFrame(time_s, identifier, data)):
            assert isinstance(reading, ThrusterCommand | ThrusterReport | BusReading)


@given(st.data())
def test_lost_repeated_and_reordered_frames_never_make_a_value_that_was_not_sent(data):
    sent = [status(i % 3, 100 * i, 10.0 + i) for i in range(8)]
    frames = [frame for i, values in enumerate(sent) for frame in encode_esc_status(values, 20, i, time_s=0.02 * i)]
    picked = data.draw(st.lists(st.sampled_from(frames), max_size=60) | st.permutations(frames))
    decoder = DroneCanDecoder(EIGHT)
    true = {(values.esc_index + 1, float(values.speed_rpm), values.voltage_v) for values in sent}
    for reading in feed(decoder, picked):
        assert (reading.thruster, reading.speed_rpm, reading.voltage_v) in true


# What callers may not ask for


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"thruster": 0, "esc_index": 0}, "thruster must be at least 1, got 0"),
        ({"thruster": 1, "esc_index": 20}, "esc_index must lie in 0..19, got 20"),
        ({"thruster": 1, "esc_index": -1}, "esc_index"),
        ({"thruster": 1, "esc_index": 0, "node_id": 0}, "node_id must lie in 1..127, got 0"),
        ({"thruster": 1, "esc_index": 0, "node_id": 128}, "node_id"),
    ],
)
def test_an_impossible_thruster_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        DroneCanThruster(**options)


@pytest.mark.parametrize(
    ("thrusters", "limit", "message"),
    [
        ([DroneCanThruster(1, 0), DroneCanThruster(1, 1)], 100.0, "thruster must differ"),
        ([DroneCanThruster(1, 0), DroneCanThruster(2, 0)], 100.0, "esc_index must differ"),
        ([DroneCanThruster(1, 0)], 0.0, "speed_limit_rpm must be positive"),
        ([DroneCanThruster(1, 0)], math.nan, "speed_limit_rpm must be positive"),
    ],
)
def test_an_impossible_bus_is_refused(thrusters, limit, message):
    with pytest.raises(ValueError, match=message):
        DroneCanDecoder(thrusters, speed_limit_rpm=limit)

"""Vendor messages against cantools, and everything that a vendor's file or frame can get wrong."""

import math
from collections import Counter

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.dbc_database import compile_signal
from drivers.can.frame import CanFrame
from drivers.can.messages.field_layout import FieldLayout
from drivers.can.messages.signal_reader import SignalReader
from drivers.command import CommandScale
from drivers.readings import ThrusterCommand, ThrusterReport

PWM = CommandScale(1100.0, 1500.0, 1900.0)

VENDOR = """VERSION ""
NS_ :
BS_:
BU_: ESC
BO_ 256 Command: 8 ESC
 SG_ Pwm1 : 0|16@1+ (1,0) [1100|1900] "us" ESC
 SG_ Pwm2 : 16|16@1+ (1,0) [1100|1900] "us" ESC
 SG_ Percent3 : 32|8@1- (1,0) [-100|100] "%" ESC
BO_ 2147483657 Status1: 8 ESC
 SG_ Rpm : 0|16@1- (1,0) [0|0] "rpm" ESC
 SG_ Voltage : 16|16@1+ (0.01,0) [0|60] "V" ESC
 SG_ Current : 32|16@1- (0.01,0) [-300|300] "A" ESC
BO_ 257 Hall: 6 ESC
 SG_ Pulses1 : 7|16@0+ (0.5,0) [0|0] "1/s" ESC
 SG_ Erpm2 : 23|32@0- (1,0) [0|0] "1/min" ESC
BO_ 258 Count: 2 ESC
 SG_ Pulses : 0|12@1+ (1,0) [0|0] "" ESC
BO_ 259 Floats: 8 ESC
 SG_ Rpm : 0|32@1- (1,0) [0|0] "rpm" ESC
 SG_ RadPerSecond : 39|32@0- (1,0) [0|0] "rad/s" ESC
BO_ 260 Muxed: 8 ESC
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" ESC
 SG_ RpmA m1 : 8|16@1- (1,0) [0|0] "rpm" ESC
 SG_ RpmB m2 : 8|16@1- (1,0) [0|0] "rpm" ESC
 SG_ Load m2 : 24|16@1- (0.1,0) [0|0] "A" ESC
BO_ 261 Overlapping: 1 ESC
 SG_ A : 0|8@1+ (1,0) [0|0] "" ESC
 SG_ B : 4|8@1+ (1,0) [0|0] "" ESC
SIG_VALTYPE_ 259 Rpm : 1;
SIG_VALTYPE_ 259 RadPerSecond : 1;
"""


@pytest.fixture(scope="module")
def vendor(tmp_path_factory):
    path = tmp_path_factory.mktemp("dbc") / "vendor.dbc"
    path.write_text(VENDOR)
    return path


@pytest.fixture(scope="module")
def database(vendor):
    return cantools.database.load_file(vendor, strict=False)


def frame(database, name, values, time_s=1.0, **options):
    message = database.get_message_by_name(name)
    data = bytes(message.encode(values, strict=False))
    return CanFrame(time_s, message.frame_id, data, **({"extended": message.is_extended_frame} | options))


def speeds(decoder, frames):
    return [reading.speed_rpm for frame in frames for reading in decoder.decode(frame)]


# What is right


def test_commands_of_several_thrusters_come_out_of_one_message(vendor, database):
    percent = CommandScale(-100.0, 0.0, 100.0, dead_band=3.0, reverse=True)
    decoder = DbcDecoder(
        vendor,
        [
            DbcThruster(1, command="Command.Pwm1", command_scale=PWM),
            DbcThruster(2, command="Command.Pwm2", command_scale=PWM),
            DbcThruster(3, command="Command.Percent3", command_scale=percent),
        ],
    )
    readings = decoder.decode(frame(database, "Command", {"Pwm1": 1700, "Pwm2": 1100, "Percent3": 40}))
    assert list(readings) == [
        ThrusterCommand(1.0, 1, 0.5),
        ThrusterCommand(1.0, 2, -1.0),
        ThrusterCommand(1.0, 3, -0.4),
    ]


def test_speed_voltage_and_current_come_as_one_report(vendor, database):
    thruster = DbcThruster(4, speed="Status1.Rpm", voltage="Status1.Voltage", current="Status1.Current")
    decoder = DbcDecoder(vendor, [thruster])
    (report,) = decoder.decode(frame(database, "Status1", {"Rpm": -1234, "Voltage": 15.55, "Current": -2.5}))
    assert report == ThrusterReport(1.0, 4, -1234.0, pytest.approx(15.55), pytest.approx(-2.5))
    assert not decoder.drops


@pytest.mark.parametrize(
    ("options", "name", "values", "speed_rpm"),
    [
        ({"speed": "Status1.Rpm", "reverse": True}, "Status1", {"Rpm": -900, "Voltage": 1, "Current": 1}, 900.0),
        ({"speed": "Status1.Rpm", "signed": False}, "Status1", {"Rpm": -900, "Voltage": 1, "Current": 1}, 900.0),
        ({"speed": "Status1.Rpm", "speed_unit": "rps"}, "Status1", {"Rpm": 20, "Voltage": 1, "Current": 1}, 1200.0),
        (
            {"speed": "Hall.Pulses1", "speed_unit": "pulses_per_s", "pole_pairs": 7},
            "Hall",
            {"Pulses1": 140.0, "Erpm2": 0},
            1200.0,
        ),
        (
            {"speed": "Hall.Erpm2", "speed_unit": "erpm", "pole_pairs": 7},
            "Hall",
            {"Pulses1": 0.0, "Erpm2": -8400},
            -1200.0,
        ),
        ({"speed": "Floats.Rpm"}, "Floats", {"Rpm": 812.5, "RadPerSecond": 0.0}, 812.5),
        (
            {"speed": "Floats.RadPerSecond", "speed_unit": "rad_per_s"},
            "Floats",
            {"Rpm": 0.0, "RadPerSecond": -100.0},
            -954.929658551372,
        ),
    ],
)
def test_speed_is_rpm_whatever_the_sensor_counts(vendor, database, options, name, values, speed_rpm):
    decoder = DbcDecoder(vendor, [DbcThruster(1, **options)])
    assert speeds(decoder, [frame(database, name, values)]) == [pytest.approx(speed_rpm)]
    assert not decoder.drops


@pytest.mark.parametrize("signed", [True, False])
def test_a_pulse_count_that_wraps_round_is_a_speed(vendor, database, signed):
    thruster = DbcThruster(1, speed="Count.Pulses", speed_unit="pulse_count", pole_pairs=7, signed=signed)
    decoder = DbcDecoder(vendor, [thruster])
    counts = [frame(database, "Count", {"Pulses": (4000 + 14 * i) % 4096}, 0.1 * i) for i in range(20)]
    assert speeds(decoder, counts) == [pytest.approx(1200.0)] * 19


def test_a_pulse_count_that_falls_is_a_speed_astern_where_the_sensor_knows(vendor, database):
    counts = [frame(database, "Count", {"Pulses": (20 - 14 * i) % 4096}, 0.1 * i) for i in range(4)]
    knows = DbcThruster(1, speed="Count.Pulses", speed_unit="pulse_count", pole_pairs=7)
    assert speeds(DbcDecoder(vendor, [knows]), counts) == [pytest.approx(-1200.0)] * 3


def test_a_pulse_count_is_not_compared_over_a_gap_a_repetition_or_back_in_time(vendor, database):
    thruster = DbcThruster(1, speed="Count.Pulses", speed_unit="pulse_count", pole_pairs=1)
    decoder = DbcDecoder(vendor, [thruster])
    times_and_counts = [(0.0, 0), (0.0, 0), (0.0005, 1), (5.0, 10), (4.0, 20), (4.1, 22)]
    frames = [frame(database, "Count", {"Pulses": count}, time_s) for time_s, count in times_and_counts]
    assert speeds(decoder, frames) == [pytest.approx(1200.0)]


def test_a_multiplexed_signal_is_read_only_when_it_is_there(vendor, database):
    decoder = DbcDecoder(
        vendor,
        [DbcThruster(1, speed="Muxed.RpmA"), DbcThruster(2, speed="Muxed.RpmB", current="Muxed.Load")],
    )
    first = frame(database, "Muxed", {"Which": 1, "RpmA": 500})
    second = frame(database, "Muxed", {"Which": 2, "RpmB": -600, "Load": 1.5})
    neither = CanFrame(1.0, 260, bytes([3, 1, 1, 1, 1, 0, 0, 0]), extended=False)
    assert list(decoder.decode(first)) == [ThrusterReport(1.0, 1, 500.0)]
    assert list(decoder.decode(second)) == [ThrusterReport(1.0, 2, -600.0, None, pytest.approx(1.5))]
    assert not decoder.decode(neither)
    assert not decoder.drops


def test_one_supply_may_be_that_of_every_thruster(vendor, database):
    decoder = DbcDecoder(vendor, [DbcThruster(n, voltage="Status1.Voltage") for n in (1, 2)])
    readings = decoder.decode(frame(database, "Status1", {"Rpm": 0, "Voltage": 16.0, "Current": 0}))
    assert [(reading.thruster, reading.voltage_v) for reading in readings] == [(1, 16.0), (2, 16.0)]


def test_filters_take_the_messages_that_are_read_and_their_kind_of_identifier(vendor):
    decoder = DbcDecoder(vendor, [DbcThruster(1, "Command.Pwm1", PWM, "Status1.Rpm")])
    found = [(wanted.identifier, wanted.mask, wanted.extended) for wanted in decoder.filters()]
    assert found == [(256, 0x7FF, False), (9, 0x1FFFFFFF, True)]


# Differential: any layout that a database can describe


@st.composite
def layouts(draw):
    length = draw(st.integers(1, 8))
    big = draw(st.booleans())
    bits = draw(st.integers(1, 8 * length))
    first = draw(st.integers(0, 8 * length - bits))
    start = 8 * (first // 8) + 7 - first % 8 if big else first
    return {
        "length": length,
        "signal": f"{start}|{bits}@{0 if big else 1}{draw(st.sampled_from('+-'))}",
        "scale": draw(st.sampled_from([1, 0.1, -2, 0.0039, 1000])),
        "offset": draw(st.sampled_from([0, -40, 0.5])),
    }


def both_ways(message, signal, data, drops):
    """The signal's value, read of one frame and as a column."""
    compiled = compile_signal(message, signal)
    layout = FieldLayout(compiled.fields(), message.length)
    reader = SignalReader(compiled, layout, "speed", drops)
    block = np.frombuffer(data.ljust(8, b"\0"), np.uint8)[np.newaxis]
    with np.errstate(invalid="ignore"):
        (column,) = reader.column(layout.columns(block))
    return reader.read(layout.unpack(data)), column


@given(layouts(), st.binary(min_size=8, max_size=8))
def test_every_signal_is_read_as_cantools_reads_it(layout, data):
    text = (
        'VERSION ""\nNS_ :\nBS_:\nBU_: X\n'
        f"BO_ 1 M: {layout['length']} X\n"
        f' SG_ S : {layout["signal"]} ({layout["scale"]},{layout["offset"]}) [0|0] "" X\n'
    )
    message = cantools.database.load_string(text, "dbc").get_message_by_name("M")
    data = data[: layout["length"]]
    alone, column = both_ways(message, message.signals[0], data, Counter())
    assert alone == pytest.approx(message.decode(data)["S"], rel=1e-12, abs=1e-12)
    assert column == alone


@given(st.binary(min_size=8, max_size=8))
def test_floats_are_read_as_cantools_reads_them(database, data):
    message = database.get_message_by_name("Floats")
    for signal in message.signals:
        drops = Counter()
        (value, column), expected = both_ways(message, signal, data, drops), message.decode(data)[signal.name]
        assert value == (expected if math.isfinite(expected) else None)
        assert column == value or (value is None and math.isnan(column))
        assert drops == ({} if math.isfinite(expected) else {"non-finite": 2})


# What is dropped


@pytest.mark.parametrize("size", [0, 1, 5, 7])
def test_a_wrong_dlc_is_dropped_and_counted(vendor, size):
    decoder = DbcDecoder(vendor, [DbcThruster(1, "Command.Pwm1", PWM)])
    assert not decoder.decode(CanFrame(1.0, 256, bytes(size), extended=False))
    assert decoder.drops == {"wrong length": 1}


def test_a_longer_frame_than_described_is_dropped(vendor):
    decoder = DbcDecoder(vendor, [DbcThruster(1, speed="Hall.Pulses1")])
    assert not decoder.decode(CanFrame(1.0, 257, bytes(8), extended=False))
    assert decoder.drops == {"wrong length": 1}


def test_an_identifier_counts_only_with_its_kind(vendor):
    decoder = DbcDecoder(vendor, [DbcThruster(1, "Command.Pwm1", PWM, "Status1.Rpm")])
    assert not decoder.decode(CanFrame(1.0, 9, bytes(8), extended=False))
    assert not decoder.decode(CanFrame(1.0, 256, bytes(8), extended=True))
    assert not decoder.drops


def test_an_error_frame_is_not_taken_for_a_message(vendor):
    decoder = DbcDecoder(vendor, [DbcThruster(1, "Command.Pwm1", PWM)])
    assert not decoder.decode(CanFrame(1.0, 256, bytes(8), extended=False, error=True))
    assert not decoder.drops


@pytest.mark.parametrize("pwm", [0, 1059, 1941, 65535])
def test_a_command_out_of_range_is_dropped_and_counted(vendor, database, pwm):
    decoder = DbcDecoder(vendor, [DbcThruster(1, "Command.Pwm1", PWM)])
    assert not decoder.decode(frame(database, "Command", {"Pwm1": pwm, "Pwm2": 1500, "Percent3": 0}))
    assert decoder.drops == {"command out of range": 1}


def test_a_command_a_little_over_the_range_is_full_thrust_whatever_the_database_says(vendor, database):
    decoder = DbcDecoder(vendor, [DbcThruster(1, "Command.Pwm1", PWM)])
    (reading,) = decoder.decode(frame(database, "Command", {"Pwm1": 1920, "Pwm2": 1500, "Percent3": 0}))
    assert reading.fraction == 1.0


@pytest.mark.parametrize("rpm", [32767, -32768])
def test_a_saturated_speed_is_none_and_costs_nothing_else(vendor, database, rpm):
    decoder = DbcDecoder(vendor, [DbcThruster(1, speed="Status1.Rpm", voltage="Status1.Voltage")])
    (report,) = decoder.decode(frame(database, "Status1", {"Rpm": rpm, "Voltage": 16.0, "Current": 0}))
    assert (report.speed_rpm, report.voltage_v) == (None, 16.0)
    assert decoder.drops == {"implausible speed": 1}


def test_65535_is_no_speed_even_where_its_scale_makes_it_small(vendor):
    decoder = DbcDecoder(vendor, [DbcThruster(1, speed="Hall.Pulses1", speed_unit="pulses_per_s", pole_pairs=140)])
    assert not decoder.decode(CanFrame(1.0, 257, b"\xff\xff\0\0\0\0", extended=False))
    assert decoder.drops == {"implausible speed": 1}


def test_a_speed_beyond_the_limit_is_none(vendor, database):
    decoder = DbcDecoder(vendor, [DbcThruster(1, speed="Hall.Erpm2", speed_unit="erpm", pole_pairs=1)], 5000.0)
    assert speeds(decoder, [frame(database, "Hall", {"Pulses1": 0, "Erpm2": 5001})]) == []
    assert speeds(decoder, [frame(database, "Hall", {"Pulses1": 0, "Erpm2": -5000})]) == [-5000.0]
    assert decoder.drops == {"implausible speed": 1}


def test_a_voltage_outside_the_databases_range_is_none(vendor, database):
    decoder = DbcDecoder(vendor, [DbcThruster(1, speed="Status1.Rpm", voltage="Status1.Voltage")])
    (report,) = decoder.decode(frame(database, "Status1", {"Rpm": 5, "Voltage": 60.1, "Current": 0}))
    assert (report.speed_rpm, report.voltage_v) == (5.0, None)
    assert decoder.drops == {"implausible voltage": 1}


@given(
    st.sampled_from([(256, False), (9, True), (257, False), (258, False), (259, False), (260, False)]),
    st.binary(max_size=8),
    st.floats(-10.0, 10.0),
)
def test_no_bytes_make_it_raise(vendor, identifier, data, time_s):
    decoder = DbcDecoder(
        vendor,
        [
            DbcThruster(1, "Command.Pwm1", PWM, "Status1.Rpm", voltage="Status1.Voltage", current="Status1.Current"),
            DbcThruster(2, speed="Floats.Rpm", current="Muxed.Load"),
            DbcThruster(3, speed="Count.Pulses", speed_unit="pulse_count", pole_pairs=7),
            DbcThruster(4, speed="Hall.Erpm2", speed_unit="erpm", pole_pairs=7, voltage="Floats.RadPerSecond"),
        ],
    )
    for moment_s in (time_s, time_s, time_s + 0.1):
        for reading in decoder.decode(CanFrame(moment_s, identifier[0], data, extended=identifier[1])):
            numbers = (
                [reading.fraction]
                if isinstance(reading, ThrusterCommand)
                else [
                    number
                    for number in (reading.speed_rpm, reading.voltage_v, reading.current_a)
                    if number is not None
                ]
            )
            assert numbers
            assert all(map(math.isfinite, numbers))


# What callers may not ask for


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed": "Statsu1.Rpm"}, "speed of thruster 1: no message is named 'Statsu1', nearest is 'Status1'"),
        ({"speed": "Status1.rpm"}, "no signal of Status1 is named 'rpm', nearest is 'Rpm'"),
        ({"voltage": "Status1"}, "voltage of thruster 1: want \"Message.signal\", got 'Status1'"),
        ({"speed": "Overlapping.B"}, "Overlapping.B: it ends at bit 12, its message has 8"),
    ],
)
def test_a_name_that_the_database_does_not_have_is_refused_with_the_nearest(vendor, options, message):
    with pytest.raises(ValueError, match=message):
        DbcDecoder(vendor, [DbcThruster(1, **options)])


def test_all_problems_come_in_one_go(vendor):
    with pytest.raises(ValueError, match=r"thruster must differ.*'A'.*'B'"):
        DbcDecoder(vendor, [DbcThruster(1, speed="A.x"), DbcThruster(1, speed="B.x")])


def test_a_sloppy_message_that_nobody_uses_is_no_obstacle(vendor):
    assert DbcDecoder(vendor, [DbcThruster(1, speed="Overlapping.A")]).filters()


def test_two_messages_of_one_identifier_are_refused(tmp_path):
    path = tmp_path / "twins.dbc"
    signal = ' SG_ S : 0|8@1+ (1,0) [0|0] "" X\n'
    path.write_text(f'VERSION ""\nNS_ :\nBS_:\nBU_: X\nBO_ 1 A: 1 X\n{signal}BO_ 1 B: 1 X\n{signal}')
    with pytest.raises(ValueError, match="messages A and B have one identifier"):
        DbcDecoder(path, [DbcThruster(1, speed="A.S"), DbcThruster(2, speed="B.S")])


@pytest.mark.parametrize("content", ["", "garbage", "BO_ 1 A: 8", '\0\xff"', None])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content):
    path = tmp_path / "broken.dbc"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ValueError, match=r"broken.dbc cannot be read|no message is named"):
        DbcDecoder(path, [DbcThruster(1, speed="A.x")])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"thruster": 0, "speed": "A.b"}, "thruster must be at least 1, got 0"),
        ({"thruster": 1}, "must name a command, speed, voltage or current signal"),
        ({"thruster": 1, "speed": "A.b", "speed_unit": "hz"}, "speed_unit must be one of rpm, .*got 'hz'"),
        ({"thruster": 1, "speed": "A.b", "speed_unit": "erpm"}, "'erpm' needs pole_pairs"),
        ({"thruster": 1, "speed": "A.b", "pole_pairs": 0}, "pole_pairs must be at least 1, got 0"),
        ({"thruster": 1, "command": "A.b"}, "command and command_scale must be given together"),
    ],
)
def test_an_impossible_thruster_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        DbcThruster(**options)

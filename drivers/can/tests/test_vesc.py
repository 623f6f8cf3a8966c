"""VESC's messages against a database of them that cantools reads, and what a bus can get wrong."""

from __future__ import annotations

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.can.vesc import VescDecoder, VescThruster
from drivers.can.vesc_messages import Status, Status2, Status3, Status4, Status5, encode_command
from drivers.command import CommandScale
from drivers.readings import ThrusterCommand, ThrusterReport

FULL = CommandScale(-1.0, 0.0, 1.0)
CONTROLLER = 7
# The messages as the firmware's documentation describes them, of controller 7; all identifiers are extended.
DATABASE = """VERSION ""
NS_ :
BS_:
BU_: VESC
BO_ 2147483655 SetDuty: 4 VESC
 SG_ Duty : 7|32@0- (0.00001,0) [0|0] "" VESC
BO_ 2147483911 SetCurrent: 4 VESC
 SG_ Current : 7|32@0- (0.001,0) [0|0] "A" VESC
BO_ 2147484423 SetRpm: 4 VESC
 SG_ Erpm : 7|32@0- (1,0) [0|0] "1/min" VESC
BO_ 2147486215 SetCurrentRel: 4 VESC
 SG_ Share : 7|32@0- (0.00001,0) [0|0] "" VESC
BO_ 2147485959 Status: 8 VESC
 SG_ Erpm : 7|32@0- (1,0) [0|0] "1/min" VESC
 SG_ MotorCurrent : 39|16@0- (0.1,0) [0|0] "A" VESC
 SG_ Duty : 55|16@0- (0.001,0) [0|0] "" VESC
BO_ 2147487239 Status2: 8 VESC
 SG_ Drawn : 7|32@0- (0.0001,0) [0|0] "Ah" VESC
 SG_ Returned : 39|32@0- (0.0001,0) [0|0] "Ah" VESC
BO_ 2147487495 Status3: 8 VESC
 SG_ Drawn : 7|32@0- (0.0001,0) [0|0] "Wh" VESC
 SG_ Returned : 39|32@0- (0.0001,0) [0|0] "Wh" VESC
BO_ 2147487751 Status4: 8 VESC
 SG_ FetCelsius : 7|16@0- (0.1,0) [0|0] "degC" VESC
 SG_ MotorCelsius : 23|16@0- (0.1,0) [0|0] "degC" VESC
 SG_ SupplyCurrent : 39|16@0- (0.1,0) [0|0] "A" VESC
 SG_ Position : 55|16@0- (0.02,0) [0|0] "deg" VESC
BO_ 2147490567 Status5: 8 VESC
 SG_ Tachometer : 7|32@0- (1,0) [0|0] "" VESC
 SG_ Voltage : 39|16@0- (0.1,0) [0|0] "V" VESC
"""


@pytest.fixture(scope="module")
def database():
    return cantools.database.load_string(DATABASE, "dbc")


def said(database, frame):
    """The frame as cantools reads it."""
    return database.decode_message(frame.identifier, frame.data, force_extended_id=True)


def encoded(database, name, **values):
    """A frame as cantools writes it."""
    message = database.get_message_by_name(name)
    assert message.is_extended_frame
    return CanFrame(1.0, message.frame_id, message.encode(values))


def decoder(**options):
    settings = {"control": "duty", "command_scale": FULL, "pole_pairs": 7} | options
    return VescDecoder([VescThruster(3, CONTROLLER, **settings)])


# What is sent


def whole(bits, factor):
    """Numbers that a signed integer of so many bits can say."""
    return st.integers(-(1 << bits - 1), (1 << bits - 1) - 1).map(lambda number: number / factor)


@pytest.mark.parametrize(
    ("control", "signal", "factor"),
    [("duty", "Duty", 1e5), ("current", "Current", 1e3), ("rpm", "Erpm", 1.0), ("current_rel", "Share", 1e5)],
)
def test_commands_are_sent_as_the_database_says(database, control, signal, factor):
    @given(whole(32, factor))
    def check(value):
        frame = encode_command(control, value, CONTROLLER)
        assert frame.extended
        assert said(database, frame) == {signal: pytest.approx(value)}

    check()


@given(whole(32, 1), whole(16, 10), whole(16, 1000))
def test_status_is_sent_as_the_database_says(database, erpm, current_a, duty):
    told = said(database, Status(erpm, current_a, duty).frame(CONTROLLER))
    assert list(told.values()) == pytest.approx([erpm, current_a, duty])


@given(whole(32, 1e4), whole(32, 1e4), whole(16, 10), whole(16, 50))
def test_the_other_statuses_are_sent_as_the_database_says(database, drawn, returned, supply, position):
    for status in (Status2(drawn, returned), Status3(drawn, returned)):
        assert list(said(database, status.frame(CONTROLLER)).values()) == pytest.approx([drawn, returned])
    told = said(database, Status4(313.15, 273.15 + supply / 10, supply, position).frame(CONTROLLER))
    assert list(told.values()) == pytest.approx([40.0, supply / 10, supply, position], abs=0.051)
    told = said(database, Status5(round(drawn), supply).frame(CONTROLLER))
    assert list(told.values()) == pytest.approx([round(drawn), supply])


@pytest.mark.parametrize(
    ("send", "message"),
    [
        (lambda: encode_command("duty", 1e6, 7), r"1000000\.0 does not fit into SET_DUTY"),
        (lambda: encode_command("duty", 0.5, 255), r"controller_id must lie in 0\.\.254, got 255"),
        (lambda: Status(0, 4000.0, 0).frame(7), r"current_a=4000\.0.* does not fit into STATUS"),
        (lambda: Status5(0, 12.0).frame(-1), "controller_id must lie in"),
    ],
)
def test_what_does_not_fit_is_refused(send, message):
    with pytest.raises(ValueError, match=message):
        send()


# What is read


@given(whole(32, 1e5))
def test_a_duty_cycle_is_the_command(database, duty):
    found = decoder().decode(encoded(database, "SetDuty", Duty=duty))
    expected = FULL.fraction(duty)
    assert [reading.fraction for reading in found] == ([] if expected is None else [pytest.approx(expected)])


@pytest.mark.parametrize(
    ("control", "maximum", "name", "values", "fraction"),
    [
        ("current_rel", 1.0, "SetCurrentRel", {"Share": -0.25}, -0.25),
        ("rpm", 21000.0, "SetRpm", {"Erpm": 10500}, 0.5),
        ("current", 40.0, "SetCurrent", {"Current": -30.0}, -0.75),
    ],
)
def test_other_commands_are_a_part_of_the_largest(database, control, maximum, name, values, fraction):
    scale = CommandScale(-maximum, 0.0, maximum)
    found = decoder(control=control, command_scale=scale).decode(encoded(database, name, **values))
    assert list(found) == [ThrusterCommand(1.0, 3, pytest.approx(fraction))]


@given(st.integers(-200_000, 200_000), whole(16, 10), whole(16, 1000))
def test_electrical_rpm_becomes_rpm_and_the_current_is_the_motors(database, erpm, current_a, duty):
    frame = encoded(database, "Status", Erpm=erpm, MotorCurrent=current_a, Duty=duty)
    assert list(decoder().decode(frame)) == [
        ThrusterReport(1.0, 3, speed_rpm=pytest.approx(erpm / 7), current_a=pytest.approx(current_a))
    ]


@pytest.mark.parametrize(
    ("options", "speed_rpm"), [({"reverse": True}, 1000.0), ({"signed": False}, 1000.0), ({}, -1000.0)]
)
def test_the_direction_is_that_of_the_propeller(database, options, speed_rpm):
    frame = encoded(database, "Status", Erpm=-7000, MotorCurrent=1.5, Duty=0)
    (report,) = decoder(**options).decode(frame)
    assert (report.speed_rpm, report.current_a) == (pytest.approx(speed_rpm), 1.5)


def test_temperature_and_voltage_are_reported_as_they_come(database):
    one = decoder()
    temperature = encoded(database, "Status4", FetCelsius=41.5, MotorCelsius=50, SupplyCurrent=3, Position=0)
    voltage = encoded(database, "Status5", Tachometer=123456, Voltage=15.8)
    assert list(one.decode(temperature)) == [ThrusterReport(1.0, 3, temperature_k=pytest.approx(314.65))]
    assert list(one.decode(voltage)) == [ThrusterReport(1.0, 3, voltage_v=pytest.approx(15.8))]


def test_older_controllers_send_their_voltage_without_the_bytes_for_later(database):
    frame = encoded(database, "Status5", Tachometer=1, Voltage=15.8)
    (report,) = decoder().decode(CanFrame(1.0, frame.identifier, frame.data[:6]))
    assert report.voltage_v == pytest.approx(15.8)


@pytest.mark.parametrize("packet", [2, 11, 12, 13])
def test_a_brake_asks_for_no_thrust(packet):
    frame = CanFrame(1.0, packet << 8 | CONTROLLER, (40_000).to_bytes(4, "big"))
    assert list(decoder().decode(frame)) == [ThrusterCommand(1.0, 3, 0.0)]


@pytest.mark.parametrize("packet", [1, 3, 4, 10])
def test_a_command_of_another_kind_is_counted(packet):
    one = decoder()
    assert not one.decode(CanFrame(1.0, packet << 8 | CONTROLLER, bytes(4)))
    assert one.drops == {"command of another kind": 1}


@pytest.mark.parametrize(
    ("name", "values", "cause"),
    [
        ("SetDuty", {"Duty": 1.2}, "command out of range"),
        ("Status5", {"Tachometer": 0, "Voltage": 0.0}, "implausible voltage"),
        (
            "Status4",
            {"FetCelsius": -99, "MotorCelsius": 0, "SupplyCurrent": 0, "Position": 0},
            "implausible temperature",
        ),
    ],
)
def test_what_is_no_value_is_counted(database, name, values, cause):
    one = decoder()
    assert not one.decode(encoded(database, name, **values))
    assert one.drops == {cause: 1}


def test_an_impossible_speed_costs_no_current(database):
    one = decoder()
    (report,) = one.decode(encoded(database, "Status", Erpm=210_001, MotorCurrent=2.0, Duty=0))
    assert (report.speed_rpm, report.current_a) == (None, 2.0)
    assert one.drops == {"implausible speed": 1}


@pytest.mark.parametrize(("packet", "length"), [(0, 3), (2, 0), (9, 5), (16, 1), (27, 5)])
def test_short_frames_are_counted(packet, length):
    one = decoder()
    assert not one.decode(CanFrame(1.0, packet << 8 | CONTROLLER, bytes(length)))
    assert one.drops == {"wrong length": 1}


def test_only_extended_frames_of_its_controllers_are_a_vescs(database):
    one = decoder()
    frame = encoded(database, "SetDuty", Duty=0.5)
    assert not one.decode(CanFrame(1.0, frame.identifier, frame.data, extended=False))
    assert not one.decode(CanFrame(1.0, frame.identifier + 1, frame.data))
    assert not one.decode(CanFrame(1.0, frame.identifier, frame.data, error=True))
    assert not one.drops


def test_filters_take_what_the_thruster_has_on_this_bus():
    status_only = VescDecoder([VescThruster(1, 9, pole_pairs=7)]).filters()
    assert [(one.identifier, one.extended) for one in status_only] == [(0x909, True), (0x1009, True), (0x1B09, True)]
    commands_only = VescDecoder([VescThruster(1, 9, "duty", FULL)]).filters()
    assert {one.identifier >> 8 for one in commands_only} == {0, 1, 2, 3, 4, 10, 11, 12, 13}


@given(st.sampled_from([0, 1, 2, 3, 4, 9, 10, 16, 27]), st.binary(max_size=8))
def test_no_bytes_make_it_raise(packet, data):
    for reading in decoder().decode(CanFrame(1.0, packet << 8 | CONTROLLER, data)):
        assert isinstance(reading, ThrusterCommand | ThrusterReport)


# What callers may not ask for


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"thruster": 0}, "thruster must be at least 1, got 0"),
        ({"controller_id": 255}, r"controller_id must lie in 0\.\.254, got 255"),
        ({"control": "speed"}, "control must be one of duty, current, rpm, current_rel, got 'speed'"),
        ({"control": None}, "control and command_scale must be given together"),
        ({"command_scale": CommandScale(0.0, 0.5, 1.0)}, r"neutral of a VESC is 0, got 0\.5"),
        ({"pole_pairs": 0}, "pole_pairs must be at least 1, got 0"),
        ({"control": None, "command_scale": None, "pole_pairs": None}, "must have control or pole_pairs"),
    ],
)
def test_an_impossible_thruster_is_refused(options, message):
    settings = {"thruster": 1, "controller_id": 7, "control": "duty", "command_scale": FULL, "pole_pairs": 7}
    with pytest.raises(ValueError, match=message):
        VescThruster(**settings | options)


def test_two_thrusters_have_two_controllers_and_two_numbers():
    with pytest.raises(ValueError, match="controller_id must differ from thruster to thruster, got 7"):
        VescDecoder([VescThruster(1, 7, pole_pairs=7), VescThruster(2, 7, pole_pairs=7)])
    with pytest.raises(ValueError, match="thruster must differ from thruster to thruster, got 1"):
        VescDecoder([VescThruster(1, 7, pole_pairs=7), VescThruster(1, 8, pole_pairs=7)])
    with pytest.raises(ValueError, match="speed_limit_rpm must be positive"):
        VescDecoder([], 0.0)

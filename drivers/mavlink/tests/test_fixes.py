"""Position fixes of positioning systems: GPS_INPUT of any component of the vehicle, GPS_RAW_INT of its autopilot."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import PositionFix

ALTITUDE, HORIZONTAL_ACCURACY = 1, 64
INT32 = st.integers(-(2**31), 2**31 - 1)
FLOAT32 = st.floats(width=32)
ABROAD = st.one_of(INT32, st.integers(-900_000_000, 900_000_000))


def decoder(system=1):
    return MavlinkDecoder([], autopilot_system=system)


def usbl(component=220):
    """Water Linked's BlueOS extension."""
    return Peer(1, component)


@given(ABROAD, ABROAD, FLOAT32, FLOAT32, st.integers(0, 255), st.integers(0, 255), st.integers(0, 255), st.booleans())
def test_gps_input_against_pymavlink(latitude, longitude, altitude, accuracy, ignored, fix_type, gps_id, mavlink1):
    data = usbl().gps_input(latitude, longitude, altitude, accuracy, ignored, fix_type, gps_id, mavlink1=mavlink1)
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 7.0)
    if not readings:
        assert sum(decode.drops.values()) == 1
        here = (sent.lat, sent.lon) != (0, 0) and abs(sent.lat) <= 90e7 and abs(sent.lon) <= 180e7
        assert not here or not 2 <= sent.fix_type <= 8
        return
    (fix,) = readings
    assert math.degrees(fix.latitude_rad) * 1e7 == pytest.approx(sent.lat, abs=1e-3)
    assert math.degrees(fix.longitude_rad) * 1e7 == pytest.approx(sent.lon, abs=1e-3)
    deep = not ignored & ALTITUDE and abs(sent.alt) <= 12_000
    assert fix.depth_m == (-sent.alt if deep else None)
    said = not ignored & HORIZONTAL_ACCURACY and 0.0 < sent.horiz_accuracy <= 10_000
    assert fix.accuracy_m == (sent.horiz_accuracy if said else None)
    assert (fix.time_s, fix.source) == (7.0, f"GPS_INPUT 220.{gps_id}")


@given(ABROAD, ABROAD, INT32, st.integers(0, 2**32 - 1), st.integers(0, 255))
def test_gps_raw_int_against_pymavlink(latitude, longitude, altitude, accuracy, fix_type):
    data = Peer().gps_raw(latitude, longitude, altitude, accuracy, fix_type)
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 7.0)
    if not readings:
        assert sum(decode.drops.values()) == 1
        here = (sent.lat, sent.lon) != (0, 0) and abs(sent.lat) <= 90e7 and abs(sent.lon) <= 180e7
        assert not here or not 3 <= sent.fix_type <= 8
        return
    (fix,) = readings
    assert math.degrees(fix.latitude_rad) * 1e7 == pytest.approx(sent.lat, abs=1e-3)
    assert fix.depth_m == (-sent.alt / 1000 if abs(sent.alt) <= 12e6 else None)
    assert fix.accuracy_m == (sent.h_acc / 1000 if 0 < sent.h_acc <= 10e6 else None)
    assert fix.source == "GPS_RAW_INT"


def test_fix_of_any_component_of_the_vehicle_but_our_own_is_taken():
    decode = decoder()
    sources = [
        fix.source for component in (1, 25, 194, 220) for fix in decode.decode(usbl(component).gps_input(), 0.0)
    ]
    assert sources == ["GPS_INPUT 1.0", "GPS_INPUT 25.0", "GPS_INPUT 194.0", "GPS_INPUT 220.0"]
    assert decode.decode(usbl(192).gps_input(), 0.0) == []
    assert decode.drops == {"another's, with our ids": 1}


def test_fix_of_another_vehicle_is_counted():
    decode = decoder()
    assert decode.decode(Peer(2, 220).gps_input() + Peer(255, 230).gps_input(), 0.0) == []
    assert decode.drops == {"not our vehicle": 2}


def test_no_fix_before_there_is_an_autopilot():
    decode = decoder(system=None)
    assert decode.decode(usbl().gps_input(), 0.0) == []
    assert len(decode.decode(Peer().heartbeat() + usbl().gps_input(), 0.1)) == 2


def test_two_receivers_of_one_sender_are_two_sources():
    sender, decode = usbl(), decoder()
    data = sender.gps_input(gps_id=0, time_us=5_000_000) + sender.gps_input(gps_id=1, time_us=5_000_000)
    assert [fix.source for fix in decode.decode(data, 0.0)] == ["GPS_INPUT 220.0", "GPS_INPUT 220.1"]


@pytest.mark.parametrize("time_us", [5_000_000, 1_700_000_000_000_000])
def test_what_came_already_by_another_route_is_dropped(time_us):
    decode, sender, autopilot = decoder(), usbl(), Peer()
    for pack in (sender.gps_input, autopilot.gps_raw):
        assert len(decode.decode(pack(time_us=time_us) + pack(time_us=time_us), 0.0)) == 1
        assert decode.decode(pack(time_us=time_us - 400_000), 0.1) == []
    assert decode.drops == {"repeated": 2, "late": 2}


def test_a_sender_without_a_clock_is_heard_each_time():
    decode, sender = decoder(), usbl()
    first, second = decode.decode(sender.gps_input(accuracy=0.5) + sender.gps_input(accuracy=0.5), 1.0)
    place = (math.radians(437_000_000 * 1e-7), math.radians(73_000_000 * 1e-7))
    assert first == second == PositionFix(1.0, *place, 12.5, 0.5, "GPS_INPUT 220.0")


def test_a_receiver_that_lost_its_fix_goes_on_with_its_last_place_and_is_not_believed():
    decode = decoder()
    assert decode.decode(Peer().gps_raw(fix_type=1) + usbl().gps_input(fix_type=0), 0.0) == []
    assert decode.decode(Peer().gps_raw(fix_type=2, time_us=6_000_000), 0.0) == []  # it guesses its altitude
    assert len(decode.decode(usbl().gps_input(fix_type=2), 0.0)) == 1  # the autopilot knows the depth
    assert decode.drops == {"no position fix": 3}

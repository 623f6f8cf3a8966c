"""PX4 logs to readings: written by struct, whole and damaged, and by pyulog's own writer."""

from __future__ import annotations

import io
import math
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyulog import ULog

from drivers.command import CommandScale
from drivers.logs.boot_clock import BY_GPS, SINCE_BOOT
from drivers.logs.damage import DamageReport
from drivers.logs.tests.ulog_writer import data, definitions, flags, message, sync, text
from drivers.logs.ulog import read_ulog, ulog_clock
from drivers.logs.ulog_segments import SegmentReader
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.mavlink.vehicle import VehicleTelemetry
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    BodyVelocity,
    GlobalPosition,
    Inertial,
    LocalPosition,
    Reading,
    ThrusterCommand,
    ThrusterReport,
)

PULSES = CommandScale(1100.0, 1500.0, 1900.0)
COUNTS = CommandScale(-1.0, 0.0, 1.0, reverse=True)
THRUSTERS = [
    MavlinkThruster(1, servo_channel=1, command_scale=PULSES, esc_index=0, signed=True),
    MavlinkThruster(2, servo_channel=18, command_scale=PULSES, esc_index=1),
    MavlinkThruster(3, actuator=3, command_scale=COUNTS),
]
OUTPUTS, OUTPUTS_2, ESCS, ATTITUDE, RATES, LOCAL, GLOBAL, IMU, DVL, STATUS, GPS, LOAD, MOTORS = range(1, 14)
LEVEL = (math.cos(0.5), 0.0, 0.0, math.sin(0.5))  # to the right by 1 rad


def read_with_damage(tmp_path: Path, log: bytes, navigation: bool = True) -> tuple[list[Reading], DamageReport]:
    path = tmp_path / "dive.ulg"
    path.write_bytes(log)
    damage = DamageReport()
    return [one for batch in read_ulog(path, THRUSTERS, damage, navigation) for one in batch], damage


def read(tmp_path: Path, *parts: bytes, navigation: bool = True) -> list[Reading]:
    readings, damage = read_with_damage(tmp_path, definitions() + b"".join(parts), navigation)
    assert not damage.lines()
    return readings


def of_kind(readings: list[Reading], kind: type) -> list[Any]:
    return [reading for reading in readings if isinstance(reading, kind)]


def test_commands_of_servo_outputs_and_actuators(tmp_path):
    readings = read(
        tmp_path,
        data(OUTPUTS, 1_000_000, 16, 1900.0, 0.0, 0.5),
        data(OUTPUTS_2, 1_000_000, 16, 0.0, 1300.0),
        data(OUTPUTS, 1_020_000, 16, 0.0, 0.0, math.nan),
    )
    assert of_kind(readings, ThrusterCommand) == [
        ThrusterCommand(1.0, 1, 1.0),
        ThrusterCommand(1.0, 3, -0.5),
        ThrusterCommand(1.0, 2, -0.5),
    ]


def test_motors_stand_in_where_there_are_no_outputs(tmp_path):
    motors = data(MOTORS, 1_000_000, 0.25, 0.0, math.nan) + data(MOTORS, 1_020_000, 0.5, 0.0, 0.75)
    readings, _ = read_with_damage(tmp_path, definitions(OUTPUTS, OUTPUTS_2) + motors)
    told = [(one.time_s, one.thruster, one.fraction) for one in of_kind(readings, ThrusterCommand)]
    assert told == [(1.0, 1, 0.25), (1.0, 3, 0.0), (1.02, 1, 0.5), (1.02, 3, -0.75)]
    both = read(tmp_path, motors, data(OUTPUTS, 1_000_000, 16, 1500.0))
    assert [one.fraction for one in of_kind(both, ThrusterCommand)] == [0.0, 0.0]


def test_each_esc_is_read_when_it_said_something_new(tmp_path):
    first = (990_000, 3, -1200, 15.5, 2.5, 40.0)
    readings = read(
        tmp_path,
        data(ESCS, 1_000_000, 2, *first, 0, 0, 0, 0.0, 0.0, 0.0),
        data(ESCS, 1_010_000, 2, *first, 1_005_000, 0, -900, 15.0, 0.0, 0.0),
    )
    one, other = of_kind(readings, ThrusterReport)
    assert one == ThrusterReport(1.0, 1, -1200.0, 15.5, 2.5, pytest.approx(313.15), 3)
    assert other == ThrusterReport(1.01, 2, 900.0, 15.0, None, None, 0)


@given(
    quaternion=st.tuples(*[st.floats(-1.0, 1.0, width=32)] * 4).filter(lambda q: math.hypot(*q) > 0.1),
)
@settings(max_examples=30, deadline=None)
def test_attitude_is_that_of_the_link(tmp_path_factory, quaternion):
    length = math.hypot(*quaternion)
    unit = [struct.unpack("<f", struct.pack("<f", part / length))[0] for part in quaternion]
    log = definitions() + data(RATES, 1_000_000, 0.1, 0.2, 0.3) + data(ATTITUDE, 1_000_000, *unit)
    readings, _ = read_with_damage(tmp_path_factory.mktemp("log"), log)
    link = VehicleTelemetry(1, 1, DamageReport().lost)
    (wanted,) = link.attitude_quaternion((1000, *unit, 0.1, 0.2, 0.3), 1.0)
    (attitude,) = of_kind(readings, Attitude)
    for name in ("roll_rad", "pitch_rad", "yaw_rad", "yaw_rate_radps", "boot_s"):
        assert getattr(attitude, name) == pytest.approx(getattr(wanted, name), abs=1e-6)


def test_without_angular_velocity_the_inertial_unit_has_the_rates(tmp_path):
    log = definitions(RATES) + data(IMU, 1_000_000, 0.1, 0.2, 0.3, 0, 0, -9.8) + data(ATTITUDE, 1_000_000, *LEVEL)
    readings, _ = read_with_damage(tmp_path, log)
    (attitude,) = of_kind(readings, Attitude)
    assert attitude.yaw_rad == pytest.approx(1.0)
    assert attitude.yaw_rate_radps == pytest.approx(0.3)
    (inertial,) = of_kind(readings, Inertial)
    assert (inertial.source, inertial.boot_s) == ("HIGHRES_IMU", 1.0)
    assert inertial.specific_force_mps2 == pytest.approx((0.0, 0.0, -9.8))


def test_positions(tmp_path):
    readings = read(
        tmp_path,
        data(LOCAL, 1_000_000, 1, 2, 3, 0.5, 0.25, 0.125, True, True),
        data(GLOBAL, 1_000_000, 45.5, -8.25, -12.0),
    )
    assert of_kind(readings, LocalPosition) == [LocalPosition(1.0, (1.0, 2.0, 3.0), (0.5, 0.25, 0.125))]
    assert of_kind(readings, GlobalPosition) == [
        GlobalPosition(1.0, math.radians(45.5), math.radians(-8.25), 12.0, (0.5, 0.25, 0.125), 1.0)
    ]


def test_a_dvl_speaks_in_the_frame_of_the_body(tmp_path):
    log = definitions() + data(DVL, 1_000_000, 3, 0.5, 0.25, 0.125) + data(DVL, 1_100_000, 1, 0.5, 0.25, 0.125)
    readings, damage = read_with_damage(tmp_path, log)
    assert of_kind(readings, BodyVelocity) == [BodyVelocity(1.0, None, (0.5, 0.25, 0.125), "ODOMETRY ulog")]
    assert damage.lines() == ["odometry in another frame: 1 (1.100 s)"]
    assert not of_kind(read_with_damage(tmp_path, log, navigation=False)[0], BodyVelocity)


def test_heartbeats_have_the_modes_of_the_link(tmp_path):
    beats = of_kind(
        read(
            tmp_path,
            data(STATUS, 1_000_000, 1, 2, False, 12, 7),
            data(STATUS, 2_500_000, 2, 2, False, 12, 7),
            data(STATUS, 3_000_000, 2, 4, True, 12, 7),
        ),
        AutopilotHeartbeat,
    )
    told = [(beat.time_s, beat.armed, beat.custom_mode, beat.system_status) for beat in beats]
    posctl, loiter = 3 << 16, 4 << 16 | 3 << 24
    assert told == [
        (1.0, False, posctl, 3),
        (2.0, False, posctl, 3),
        (2.5, True, posctl, 4),
        (3.0, True, loiter, 5),
    ]
    assert {(beat.system_id, beat.autopilot, beat.vehicle_type) for beat in beats} == {(7, 12, 12)}


def test_gps_tells_the_time(tmp_path):
    fix = data(GPS, 5_000_000, 1_700_000_005_000_000, 3)
    readings = read(tmp_path, fix, data(OUTPUTS, 6_000_000, 16, 1500.0))
    assert of_kind(readings, ThrusterCommand)[0].time_s == 1_700_000_006.0
    assert ulog_clock(tmp_path / "dive.ulg").source == BY_GPS
    read(tmp_path, data(GPS, 5_000_000, 5_000_000, 0))
    assert ulog_clock(tmp_path / "dive.ulg").source == SINCE_BOOT


def dive(count: int) -> list[bytes]:
    return [
        data(OUTPUTS, 1_000_000 + 10_000 * number, 16, 1500.0)
        + data(LOAD, 1_000_001 + 10_000 * number, 0.5)
        + (sync() if number % 10 == 0 else b"")
        + text("a line of the autopilot", 10_000 * number)
        for number in range(count)
    ]


def command_times(readings: list[Reading]) -> list[float]:
    return [round(one.time_s, 6) for one in of_kind(readings, ThrusterCommand) if one.thruster == 1]


@given(lost=st.binary(min_size=1, max_size=400), place=st.integers(0, 20), chunk_bytes=st.integers(1, 4000))
@settings(max_examples=50, deadline=None)
def test_all_but_the_neighbours_of_damage_is_read(lost, place, chunk_bytes):
    parts = dive(20)
    log = definitions() + b"".join(parts[:place]) + lost + b"".join(parts[place:])
    damage = DamageReport()
    segments = list(SegmentReader({"actuator_outputs"}, damage, chunk_bytes).segments(io.BytesIO(log)))
    times = [us for one in segments for us in ULog(io.BytesIO(one)).data_list[0].data["timestamp"].tolist()]
    wanted = [1_000_000 + 10_000 * number for number in range(20)]
    missing = set(wanted) - set(times)
    assert missing <= set(wanted[max(place - 1, 0) : place + 4])
    again = DamageReport()
    list(SegmentReader({"actuator_outputs"}, again, len(log) + 1).segments(io.BytesIO(log)))
    assert (again.records, again.lost, again.places) == (damage.records, damage.lost, damage.places)


@pytest.mark.parametrize("filling", [b"\0", b"D", b"\x0a\0D", b"\x28\0B" + bytes(40), bytes(range(256))])
def test_damage_of_any_length_is_passed_over_in_bounded_memory(tmp_path, filling):
    parts, lost = dive(4), (filling * 200_000)[:200_000]
    log = definitions() + parts[0] + parts[1] + lost + parts[2] + parts[3]
    damage = DamageReport()
    reader = SegmentReader({"actuator_outputs"}, damage, 50_000)
    tracemalloc.start()
    segments = list(reader.segments(io.BytesIO(log)))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    times = [us for one in segments for us in ULog(io.BytesIO(one)).data_list[0].data["timestamp"].tolist()]
    assert {1_000_000, 1_030_000} <= set(times) <= {1_000_000, 1_010_000, 1_020_000, 1_030_000}
    assert peak < 2_000_000


def test_a_log_that_was_cut_off_is_read_to_its_end(tmp_path):
    log = definitions() + b"".join(dive(5))
    readings, damage = read_with_damage(tmp_path, log[:-12])
    assert command_times(readings) == [1.0, 1.01, 1.02, 1.03, 1.04]
    (line,) = damage.lines()
    assert "bytes that are no message" in line
    assert "offset" in line


def test_what_a_crash_dump_was_appended_to_is_read(tmp_path):
    parts = dive(4)
    head = definitions()
    whole = head + parts[0] + parts[1]
    begin = whole + parts[2][:10]
    log = begin.replace(flags(), flags(len(begin)), 1) + parts[3]
    readings, damage = read_with_damage(tmp_path, log)
    assert command_times(readings) == [1.0, 1.01, 1.03]
    assert damage.lost == {"bytes that are no message": 10}


def test_an_announcement_that_was_lost_costs_its_topic_only(tmp_path):
    log = definitions(LOAD) + b"".join(dive(5))
    readings, damage = read_with_damage(tmp_path, log)
    assert len(command_times(readings)) == 5
    assert not damage.lost


def test_a_format_that_contains_itself_describes_nothing(tmp_path):
    log = definitions() + message("F", b"cpuload2:uint64_t timestamp;cpuload2 inner;")
    log += message("A", struct.pack("<BH", 0, 99) + b"cpuload2") + b"".join(dive(3))
    readings, _ = read_with_damage(tmp_path, log)
    assert len(command_times(readings)) == 3


def test_a_log_of_a_later_kind_is_refused(tmp_path):
    log = definitions().replace(flags(), flags(unknown=0x10), 1)
    with pytest.raises(ValueError, match="flags"):
        read_with_damage(tmp_path, log)


@pytest.mark.parametrize(("content", "what"), [(b"", "empty"), (b"\xa3\x95\x80" + bytes(86), "dataflash")])
def test_what_is_no_ulog_is_refused_by_what_it_is(tmp_path, content, what):
    with pytest.raises(ValueError, match=what):
        read_with_damage(tmp_path, content)


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_no_bytes_make_the_reader_raise(tmp_path_factory, draw):
    log = bytearray(definitions() + b"".join(dive(3)))
    log += data(ESCS, 1_000_000, 2) + data(STATUS, 1_000_000, 2, 2) + data(GPS, 1_000_000, 17 * 10**14, 3)
    log += data(LOCAL, 1_000_000, 1, 2, 3) + data(GLOBAL, 1_000_000, 45, 8) + data(IMU, 1_000_000)
    log += data(ATTITUDE, 1_000_000, 1.0) + data(DVL, 1_000_000, 3) + data(RATES, 1_000_000)
    for place, byte in draw.draw(
        st.lists(st.tuples(st.integers(16, len(log) - 1), st.integers(0, 255)), max_size=20)
    ):
        log[place] = byte
    start = draw.draw(st.integers(16, len(log)))
    del log[start : draw.draw(st.integers(start, len(log)))]
    try:
        readings, _ = read_with_damage(tmp_path_factory.mktemp("log"), bytes(log))
    except ValueError as error:
        assert "flags" in str(error)
    else:
        times = [reading.time_s for reading in readings]
        assert times == sorted(times)


def test_a_log_that_pyulog_wrote_reads_the_same(tmp_path):
    source = ULog(io.BytesIO(definitions() + b"".join(dive(50)) + data(ESCS, 1_400_000, 2, 5, 0, 900, 15.0)))
    path = tmp_path / "written.ulg"
    source.write_ulog(str(path))
    damage = DamageReport()
    readings = [one for batch in read_ulog(path, THRUSTERS, damage) for one in batch]
    (outputs,) = [one for one in source.data_list if one.name == "actuator_outputs"]
    assert command_times(readings) == [us / 1e6 for us in outputs.data["timestamp"].tolist()]
    assert len(of_kind(readings, ThrusterReport)) == 1
    assert not damage.lost

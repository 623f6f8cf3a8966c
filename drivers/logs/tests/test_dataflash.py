"""Dataflash logs to readings: real ones and written ones, beside pymavlink's reading of the same bytes."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from pymavlink.DFReader import DFReader_binary

from drivers.command import CommandScale
from drivers.logs.boot_clock import BY_GPS, SINCE_BOOT
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import dataflash_clock, read_dataflash
from drivers.logs.tests.dataflash_writer import description, heading, record
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    BodyVelocity,
    GlobalPosition,
    Inertial,
    LocalPosition,
    PositionFix,
    Reading,
    ThrusterCommand,
    ThrusterReport,
    WaterPressure,
)

RECORDED = Path(__file__).parents[3].parent / "shared" / "data" / "ardusub_logs" / "small.BIN"
PULSES = CommandScale(1100.0, 1500.0, 1900.0, dead_band=25.0)
THRUSTERS = [
    MavlinkThruster(1, servo_channel=1, command_scale=PULSES, esc_index=0, signed=True),
    MavlinkThruster(2, servo_channel=2, command_scale=PULSES, esc_index=1),
    MavlinkThruster(3, servo_channel=16, command_scale=PULSES, rpm_sensor=2),
]


def read(tmp_path: Path, *parts: bytes, navigation: bool = True, start: bytes | None = None) -> list[Reading]:
    readings, damage = read_with_damage(tmp_path, *parts, navigation=navigation, start=start)
    assert not damage.lines()
    return readings


def read_with_damage(
    tmp_path: Path, *parts: bytes, navigation: bool = True, start: bytes | None = None
) -> tuple[list[Reading], DamageReport]:
    path = tmp_path / "dive.BIN"
    path.write_bytes((heading() if start is None else start) + b"".join(parts))
    damage = DamageReport()
    batches = read_dataflash(path, THRUSTERS, damage, navigation)
    return [reading for batch in batches for reading in batch], damage


def of_kind(readings: list[Reading], kind: type) -> list[Any]:
    return [reading for reading in readings if isinstance(reading, kind)]


def test_commands_of_all_servo_outputs(tmp_path):
    readings = read(
        tmp_path,
        record("RCOU", 1_000_000, 1900, 1300),
        record("RCO2", 1_000_010, 1500, 1100),
        record("RCOU", 1_100_000, 1520, 0),
    )
    assert of_kind(readings, ThrusterCommand) == [
        ThrusterCommand(1.0, 1, 1.0),
        ThrusterCommand(1.0, 2, -0.5),
        ThrusterCommand(1.00001, 3, -1.0),
        ThrusterCommand(1.1, 1, 0.0),
    ]


def test_a_pulse_that_is_no_command_is_counted(tmp_path):
    readings, damage = read_with_damage(tmp_path, record("RCOU", 1_000_000, 2500, 1500))
    assert of_kind(readings, ThrusterCommand) == [ThrusterCommand(1.0, 2, 0.0)]
    assert damage.lost == {"command out of range": 1}


def test_esc_speed_is_what_the_esc_said_and_has_its_sign_where_configured(tmp_path):
    readings = read(
        tmp_path,
        record("ESC", 2_000_000, 0, -1000, -1200, 15.5, 2.5, 40.0),
        record("ESC", 2_000_001, 1, -900, math.nan, 15.5, 0.0, 0.0),
    )
    one, other = of_kind(readings, ThrusterReport)
    assert one == ThrusterReport(2.0, 1, -1200.0, 15.5, 2.5, pytest.approx(313.15))
    assert other == ThrusterReport(2.000001, 2, 900.0, 15.5, None, None)


def test_an_esc_that_never_measured_a_current_does_not_measure_zero(tmp_path):
    currents = (0.0, 0.0, 1.5, 0.0)
    parts = [record("ESC", 10_000 * n, 0, 100, 100, 15.0, current) for n, current in enumerate(currents, 1)]
    reports = of_kind(read(tmp_path, *parts), ThrusterReport)
    assert [report.current_a for report in reports] == [None, None, 1.5, 0.0]


def test_rpm_sensors(tmp_path):
    readings, damage = read_with_damage(
        tmp_path, record("RPM", 1_000_000, 7.0, 1234.0), record("RPM", 1_100_000, 7.0, -1.0)
    )
    assert of_kind(readings, ThrusterReport) == [ThrusterReport(1.0, 3, 1234.0)]
    assert damage.lost == {"RPM sensor without a signal": 1}


def test_attitude_with_the_newest_rates(tmp_path):
    readings, damage = read_with_damage(
        tmp_path,
        record("ATT", 900_000, 0, 1.0, 0, 2.0, 0, 90.0),
        record("RATE", 1_000_000, 0.0, 10.0, 0.0, -20.0, 0.0, 30.0),
        record("ATT", 1_000_000, 0, -90.0, 0, 45.0, 0, 270.0),
    )
    (attitude,) = of_kind(readings, Attitude)
    angles = (attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    assert angles == pytest.approx((-math.pi / 2, math.pi / 4, -math.pi / 2))
    rates = (attitude.roll_rate_radps, attitude.pitch_rate_radps, attitude.yaw_rate_radps)
    assert rates == pytest.approx([math.radians(rate) for rate in (10.0, -20.0, 30.0)])
    assert (attitude.time_s, attitude.boot_s) == (1.0, 1.0)
    assert damage.lost == {"attitude without rates": 1}


def test_without_rate_records_the_first_inertial_unit_has_the_rates(tmp_path):
    readings = read(
        tmp_path,
        record("IMU", 1_000_000, 0, 0.1, 0.2, 0.3, 0, 0, -9.8),
        record("IMU", 1_000_000, 1, 7.0, 7.0, 7.0, 0, 0, -9.8),
        record("ATT", 1_000_000),
    )
    (attitude,) = of_kind(readings, Attitude)
    assert attitude.yaw_rate_radps == pytest.approx(0.3)


def test_the_estimate_that_the_autopilot_uses_is_read(tmp_path):
    def estimate(name: str, core: int, north_m: float) -> bytes:
        return record(name, 1_000_000, core, 0, 0, 0, 0.5, 0.6, 0.7, 0, north_m, 2.0, 3.0)

    readings = read(
        tmp_path,
        record("RATE", 1_000_000),
        record("ATT", 1_000_000, 0, 0, 0, 0, 0, 0, 0, 0, 3),
        record("XKF4", 1_000_000, 0, *([0] * 12), 1),
        estimate("NKF1", 1, 10.0),
        estimate("XKF1", 0, 20.0),
        estimate("XKF1", 1, 30.0),
        record("POS", 1_000_000, 45.5, -8.25, -12.0),
    )
    assert of_kind(readings, LocalPosition) == [LocalPosition(1.0, (30.0, 2.0, 3.0), pytest.approx((0.5, 0.6, 0.7)))]
    (position,) = of_kind(readings, GlobalPosition)
    assert (position.latitude_rad, position.longitude_rad) == pytest.approx(
        (math.radians(45.5), math.radians(-8.25)), abs=1e-9
    )
    assert position.depth_m == 12.0
    assert position.velocity_mps == pytest.approx((0.5, 0.6, 0.7))


def test_sensors_are_named_as_the_messages_that_have_the_same(tmp_path):
    parts = (
        record("IMU", 1_000_000, 0, 0.1, 0.2, 0.3, 1.0, 2.0, -9.8),
        record("IMU", 1_000_000, 1, 0.1, 0.2, 0.3, 1.0, 2.0, -9.8),
        record("BARO", 1_000_000, 1, 0.0, 200_000.0, 12.5, 0, 0, 0, 0, 1),
        record("VISO", 1_000_000, 0.1, 0, 0, 0, 0.05, -0.01, 0.02, 90.0),
    )
    readings = read(tmp_path, *parts)
    assert [reading.source for reading in of_kind(readings, Inertial)] == ["RAW_IMU", "SCALED_IMU2"]
    assert of_kind(readings, WaterPressure) == [WaterPressure(1.0, 1.0, 2, 200_000.0, pytest.approx(285.65))]
    (velocity,) = of_kind(readings, BodyVelocity)
    assert velocity.source.split()[0] == "VISION_POSITION_DELTA"
    assert velocity.velocity_mps == pytest.approx((0.5, -0.1, 0.2), rel=1e-6)
    kinds = Counter(map(type, read(tmp_path, *parts, navigation=False)))
    assert not kinds.keys() & {Inertial, WaterPressure, BodyVelocity}


def test_a_dvl_without_confidence_has_lost_the_bottom(tmp_path):
    readings, damage = read_with_damage(
        tmp_path,
        record("VISO", 1_000_000, 0.1, 0, 0, 0, 0.0, 0.0, 0.0, 0.0),
        record("VISO", 1_100_000, 0.0, 0, 0, 0, 0.1, 0.0, 0.0, 90.0),
    )
    assert not of_kind(readings, BodyVelocity)
    assert damage.lost == {"DVL without bottom lock": 1, "implausible velocity": 1}


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30])
def test_what_cannot_be_is_counted(tmp_path, value):
    readings, damage = read_with_damage(
        tmp_path,
        record("RATE", 1_000_000),
        record("IMU", 1_000_000, 0, value, 0, 0, 0, 0, -9.8),
        record("BARO", 1_000_000, 0, 0.0, value, 12.5, 0, 0, 0, 0, 1),
        record("XKF1", 1_000_000, 0, 0, 0, 0, value, 0, 0),
        record("ESC", 1_000_000, 0, value, value, value, value, 10),
    )
    assert {type(reading) for reading in readings} <= {ThrusterReport}
    assert all(
        (report.speed_rpm, report.voltage_v, report.current_a) == (None, None, None)
        for report in of_kind(readings, ThrusterReport)
    )
    causes = {"implausible IMU", "implausible pressure", "implausible local position"}
    assert causes <= set(damage.lost) <= causes | {"implausible speed"}


def test_no_kind_of_nan_is_a_warning(tmp_path):
    signalling = bytearray(record("RATE", 1_000_000))
    signalling[15:19] = b"\x01\x00\x80\x7f"  # R
    readings, damage = read_with_damage(tmp_path, bytes(signalling), record("ATT", 1_000_000))
    assert readings == []
    assert damage.lost == {"attitude without rates": 1}


def test_gps_tells_the_time(tmp_path):
    # week 2300, one day: 2024-02-05 00:00:00 GPS time, 18 s before that in UTC
    fix = record("GPS", 1_000_000, 0, 3, 86_400_000, 2300, 12, 1.0, 45.0, 8.0, -3.0)
    readings = read(tmp_path, fix, record("RCOU", 2_000_000, 1500, 1500))
    assert of_kind(readings, ThrusterCommand)[0].time_s == pytest.approx(1_707_091_183.0, abs=1e-6)
    clock = dataflash_clock(tmp_path / "dive.BIN")
    assert (clock.source, clock.is_unix) == (BY_GPS, True)
    (place,) = of_kind(readings, PositionFix)
    assert (place.depth_m, place.source) == (3.0, "GPS_RAW_INT")


def test_a_gps_that_does_not_know_the_time_tells_none(tmp_path):
    readings, damage = read_with_damage(tmp_path, record("GPS", 1_000_000, 0, 1, 0, 0))
    assert readings == []
    assert damage.lost == {"no position fix": 1}
    assert dataflash_clock(tmp_path / "dive.BIN").source == SINCE_BOOT


@pytest.mark.parametrize(
    ("start", "armed"),
    [
        (heading(("LOG_DISARMED", 0)), True),
        (heading(("LOG_DISARMED", 1)), False),
        (heading(("LOG_DISARMED", 1)) + record("EV", 500_000, 10) + record("ARM", 500_001, 1), True),
        (heading(("LOG_DISARMED", 0)) + record("ARM", 500_001, 0), False),
    ],
)
def test_heartbeats_once_a_second_say_what_arming_and_modes_were(tmp_path, start, armed):
    beats = of_kind(read(tmp_path, record("RCOU", 3_000_000, 1500, 1500), start=start), AutopilotHeartbeat)
    assert beats[-1].armed is armed
    assert {(beat.vehicle_type, beat.autopilot, beat.custom_mode) for beat in beats} == {(12, 3, 19)}
    gaps = [later.time_s - earlier.time_s for earlier, later in pairwise(beats)]
    assert max(gaps) <= 1.0 + 1e-9


def test_the_first_change_tells_how_it_was_before(tmp_path):
    beats = of_kind(
        read(tmp_path, record("RCOU", 2_000_000, 1500), record("ARM", 2_500_000, 0), record("MODE", 2_700_000, 2)),
        AutopilotHeartbeat,
    )
    told = [(beat.armed, beat.custom_mode) for beat in beats]
    assert told == [(True, 19), (True, 19), (True, 19), (False, 19), (False, 2)]
    assert [beat.time_s for beat in beats[-2:]] == [2.5, 2.7]


def test_where_nobody_knows_whether_it_was_armed_there_are_no_heartbeats(tmp_path):
    assert not of_kind(read(tmp_path, record("RCOU", 3_000_000, 1500, 1500)), AutopilotHeartbeat)


def test_readings_come_in_the_order_of_their_times(tmp_path):
    # the estimator stamps when its data was taken, not when it wrote
    readings = read(
        tmp_path,
        *(
            record("RCOU", 1_000_000 * n, 1500, 1500) + record("XKF1", 1_000_000 * n - 300_000, 0)
            for n in range(1, 9)
        ),
    )
    times = [reading.time_s for reading in readings]
    assert times == sorted(times)
    assert len(times) == 8 * 3


def test_a_stamp_that_is_damaged_does_not_disturb_the_others(tmp_path):
    parts = [record("RCOU", 100_000 * n, 1500) for n in range(1, 50)]
    parts[20] = record("RCOU", 2**40, 1500)
    readings, damage = read_with_damage(tmp_path, *parts)
    assert len(of_kind(readings, ThrusterCommand)) == 48
    assert damage.lost == {"implausible time": 1}


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "an empty file"),
        (b"ULog\x01\x12\x35\x01" + bytes(20), "a PX4 log"),
        (b"(1.0) can0 123#00\n", "text"),
        (bytes(8) + b"\xfd" + bytes(50), "a MAVLink log"),
        (description("RCOU")[:40], "one without a whole FMT record"),
        (b"\x00\x01\x02\x03", "unknown"),
    ],
)
def test_what_is_no_dataflash_log_is_refused_by_what_it_is(tmp_path, content, what):
    path = tmp_path / "other.BIN"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=what):
        list(read_dataflash(path, THRUSTERS, DamageReport()))


def test_a_file_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(OSError, match="nothing"):
        list(read_dataflash(tmp_path / "nothing.BIN", THRUSTERS, DamageReport()))


@pytest.mark.skipif(not RECORDED.exists(), reason="the recorded log is not here")
def test_a_recorded_log_reads_as_pymavlink_reads_it():
    peer = DFReader_binary(str(RECORDED))
    messages: list[Any] = []
    while (message := peer.recv_msg()) is not None:
        messages.append(message)
    peer.filehandle.close()
    damage = DamageReport()
    readings = [one for batch in read_dataflash(RECORDED, THRUSTERS, damage, True) for one in batch]
    assert damage.records == len(messages)
    assert damage.lost == {"attitude without rates": 1}

    def said(name: str, *fields: str) -> list[tuple[float, ...]]:
        return [tuple(getattr(m, field) for field in fields) for m in messages if m.get_type() == name]

    commands = [(round(c.time_s * 1e6), c.fraction) for c in of_kind(readings, ThrusterCommand) if c.thruster == 1]
    assert commands == [(time_us, PULSES.fraction(pulse)) for time_us, pulse in said("RCOU", "TimeUS", "C1")]
    inertial = [(round(i.boot_s * 1e6), *i.specific_force_mps2) for i in of_kind(readings, Inertial)]
    assert sorted(inertial) == sorted(said("IMU", "TimeUS", "AccX", "AccY", "AccZ"))
    pressures = [(round(p.boot_s * 1e6), p.instance - 1, p.pressure_pa) for p in of_kind(readings, WaterPressure)]
    assert pressures == said("BARO", "TimeUS", "I", "Press")
    headings = [math.degrees(a.yaw_rad) % 360.0 for a in of_kind(readings, Attitude)]
    assert headings == pytest.approx([yaw for (yaw,) in said("ATT", "Yaw")][1:], abs=1e-9)
    places = [p.position_m for p in of_kind(readings, LocalPosition)]
    assert places == said("XKF1", "PN", "PE", "PD")

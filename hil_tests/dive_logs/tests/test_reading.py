"""Logs of any kind as one stream of pieces; and what an autopilot's own log says, told over link and bus."""

from __future__ import annotations

from itertools import pairwise
from math import degrees
from pathlib import Path

import pytest

from drivers.can.frame import CanFrame
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import read_dataflash
from drivers.logs.ulog import read_ulog
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    BodyVelocity,
    Inertial,
    LocalPosition,
    Reading,
    ThrusterCommand,
    ThrusterReport,
    WaterPressure,
)
from gateway.config import Config, parse
from gateway.tests.recorded_dives import (
    MAVLINK,
    START_S,
    candump_line,
    dronecan,
    settings,
    telemetry,
    write_candump,
    write_tlog,
)
from gateway.wiring import can_decoder, mavlink_decoder, mavlink_thrusters
from hil_tests.dive_logs.packet_bytes import packet_bytes
from hil_tests.dive_logs.pieces import OnBus, OnLink, Piece
from hil_tests.dive_logs.reading import LoggedDive
from hil_tests.fuzz.autopilot_log_seeds import DATAFLASH_TYPES, dataflash_log, ulog_log

REAL = Path(__file__).parents[4] / "shared" / "data" / "ardusub_logs"
BOTH = settings("dronecan") + MAVLINK
LINK_ALONE = (
    '[vehicle]\nname = "Test vehicle"\n'
    + MAVLINK
    + "[navigation]\n"
    + '[[thruster]]\nnumber = 1\ncommand = {{ link = "mavlink", {output} = 1 }}\n'
    + 'rpm = {{ link = "mavlink", esc_index = 0, signed = {signed} }}\n'
)


def link_alone(output: str = "servo_channel", signed: str = "false") -> Config:
    return parse(LINK_ALONE.format(output=output, signed=signed), Path())


def on_bus(pieces: list[Piece]) -> list[CanFrame]:
    return [piece.frame for piece in pieces if isinstance(piece, OnBus)]


def heard(pieces: list[Piece], config: Config) -> list[Reading]:
    """What the gateway reads of them."""
    decoder = mavlink_decoder(config.mavlink, config.thruster, navigation=True)
    link = [piece for piece in pieces if isinstance(piece, OnLink)]
    readings = [reading for one in link for reading in decoder.decode(packet_bytes(one.packet), one.time_s)]
    assert decoder.drops.keys() <= {"not our autopilot", "not our vehicle"}  # before its first HEARTBEAT
    return readings


def of_kind(readings: list[Reading], kind: type) -> list:
    return [reading for reading in readings if isinstance(reading, kind)]


def test_frames_come_as_they_were_logged(tmp_path):
    frames = list(dronecan(2.0))
    write_candump(tmp_path / "dive.log", frames)
    pieces = list(LoggedDive(["dive.log"], parse(BOTH, tmp_path), tmp_path))
    assert on_bus(pieces) == frames
    assert {piece.bus for piece in pieces} == {"can0"}


def test_buses_and_link_come_in_the_order_of_time(tmp_path):
    second = '\n[[can]]\nname = "can1"\ninterface = "virtual"\nchannel = "can1"\nprotocol = "dronecan"\n'
    frames = list(dronecan(2.0))
    lines = "".join(candump_line(frame, f"can{number % 3}") for number, frame in enumerate(frames))
    (tmp_path / "dive.log").write_text(lines)
    write_tlog(tmp_path / "dive.tlog", telemetry(2.0))
    dive = LoggedDive(["dive.log", "dive.tlog"], parse(BOTH + second, tmp_path), tmp_path)
    pieces = list(dive)
    assert all(before.time_s <= after.time_s for before, after in pairwise(pieces))
    assert {piece.bus for piece in pieces if isinstance(piece, OnBus)} == {"can0", "can1"}
    assert sum(isinstance(piece, OnLink) for piece in pieces) == sum(1 for _ in telemetry(2.0))
    assert list(dive) == pieces  # again


def test_a_log_whose_clock_was_off_is_laid_beside_the_other(tmp_path):
    early = [CanFrame(frame.time_s - START_S + 5.0, frame.identifier, frame.data) for frame in dronecan(2.0)]
    write_candump(tmp_path / "dive.log", early)
    write_tlog(tmp_path / "dive.tlog", telemetry(2.0))
    offsets_s = {tmp_path / "dive.log": START_S - 5.0}
    pieces = list(LoggedDive(["dive.log", "dive.tlog"], parse(BOTH, tmp_path), tmp_path, offsets_s))
    assert [piece.time_s for piece in pieces][:: len(pieces) - 1] == pytest.approx([START_S, START_S + 2.0], abs=0.05)
    assert {type(piece) for piece in pieces[:10]} == {OnBus, OnLink}


def test_a_clock_that_was_set_back_goes_on(tmp_path):
    frames = list(dronecan(2.0))
    half = len(frames) // 2
    back = [CanFrame(one.time_s - 3600.0, one.identifier, one.data) for one in frames[half:]]
    write_candump(tmp_path / "dive.log", [*frames[:half], *back])
    times_s = [piece.time_s for piece in LoggedDive(["dive.log"], parse(BOTH, tmp_path), tmp_path)]
    assert all(0.0 <= after - before < 0.1 for before, after in pairwise(times_s))
    assert times_s[-1] - times_s[0] == pytest.approx(2.0, abs=0.1)


def test_what_is_lost_of_a_log_is_known(tmp_path):
    text = "".join(map(candump_line, dronecan(1.0)))
    (tmp_path / "dive.log").write_text(text + "(1.0) can0 nonsense\n")
    dive = LoggedDive(["dive.log"], parse(BOTH, tmp_path), tmp_path)
    assert len(list(dive)) == len(text.splitlines())
    assert dive.damage[tmp_path / "dive.log"].lines()


def test_a_log_of_no_link_of_the_configuration_is_refused(tmp_path):
    write_tlog(tmp_path / "dive.tlog", telemetry(1.0))
    with pytest.raises(ValueError, match="the configuration has no \\[mavlink\\]"):
        LoggedDive(["dive.tlog"], parse(settings("dronecan"), tmp_path), tmp_path)


def test_a_dataflash_log_is_told_over_the_link(tmp_path):
    (tmp_path / "dive.BIN").write_bytes(dataflash_log(DATAFLASH_TYPES))
    config = link_alone()
    readings = heard(list(LoggedDive(["dive.BIN"], config, tmp_path)), config)
    batches = read_dataflash(tmp_path / "dive.BIN", mavlink_thrusters(config.thruster), DamageReport(), True)
    logged = [reading for batch in batches for reading in batch]
    for kind in (ThrusterCommand, ThrusterReport, Attitude, Inertial, WaterPressure, LocalPosition, BodyVelocity):
        assert len(of_kind(readings, kind)) == len(of_kind(logged, kind)) > 0, kind
    told, was = of_kind(readings, ThrusterReport)[-1], of_kind(logged, ThrusterReport)[-1]
    assert (told.speed_rpm, told.voltage_v, told.temperature_k) == (was.speed_rpm, was.voltage_v, was.temperature_k)
    assert of_kind(readings, ThrusterCommand)[-1].fraction == 0.25
    assert of_kind(readings, AutopilotHeartbeat)[0].system_id == 3
    assert degrees(of_kind(readings, Attitude)[0].yaw_rad) == pytest.approx(90.0)
    assert of_kind(readings, Inertial)[0].specific_force_mps2[2] == pytest.approx(-9.8, abs=0.01)
    assert of_kind(readings, BodyVelocity)[1].velocity_mps == pytest.approx((1.0, 1.0, 1.0))


def test_a_dataflash_log_is_told_on_the_bus_of_its_escs(tmp_path):
    (tmp_path / "dive.BIN").write_bytes(dataflash_log(DATAFLASH_TYPES))
    config = parse(BOTH, tmp_path)
    decoder = can_decoder(config.can[0], config.thruster)
    frames = on_bus(list(LoggedDive(["dive.BIN"], config, tmp_path)))
    readings = [reading for frame in frames for reading in decoder.decode(frame)]
    assert not decoder.drops
    commands = of_kind(readings, ThrusterCommand)
    assert [command.fraction for command in commands[:2]] == pytest.approx([0.25, 0.0], abs=1e-3)
    assert {report.speed_rpm for report in of_kind(readings, ThrusterReport)} == {900.0}


def test_beside_a_log_of_the_bus_the_autopilots_own_log_does_not_speak_on_it(tmp_path):
    frames = list(dronecan(2.0))
    write_candump(tmp_path / "dive.log", frames)
    (tmp_path / "dive.BIN").write_bytes(dataflash_log(DATAFLASH_TYPES))
    offsets_s = {tmp_path / "dive.BIN": START_S}
    dive = LoggedDive(["dive.log", "dive.BIN"], parse(BOTH, tmp_path), tmp_path, offsets_s)
    assert on_bus(list(dive)) == frames


def test_a_px4_log_is_told_over_the_link(tmp_path):
    (tmp_path / "dive.ulg").write_bytes(ulog_log())
    config = link_alone("actuator", "true")
    readings = heard(list(LoggedDive(["dive.ulg"], config, tmp_path)), config)
    batches = read_ulog(tmp_path / "dive.ulg", mavlink_thrusters(config.thruster), DamageReport(), True)
    logged = [reading for batch in batches for reading in batch]
    for kind in (ThrusterCommand, ThrusterReport, Attitude, Inertial, LocalPosition, BodyVelocity):
        before_the_first_heartbeat = len(of_kind(logged, kind)) - len(of_kind(readings, kind))
        assert before_the_first_heartbeat in (0, 1), kind
        assert of_kind(readings, kind), kind
    assert of_kind(readings, ThrusterReport)[0].speed_rpm == 900.0
    assert of_kind(readings, ThrusterCommand)[0].fraction == 0.25
    assert of_kind(readings, AutopilotHeartbeat)[0].autopilot == 12


@pytest.mark.skipif(not REAL.exists(), reason="recordings of a real vehicle are not here")
def test_a_real_vehicles_own_log_is_told_as_it_is_read():
    config = link_alone()
    readings = heard(list(LoggedDive([str(REAL / "small.BIN")], config)), config)
    batches = read_dataflash(REAL / "small.BIN", mavlink_thrusters(config.thruster), DamageReport(), True)
    logged = [reading for batch in batches for reading in batch]
    for kind in (ThrusterCommand, Inertial, WaterPressure, LocalPosition, Attitude, AutopilotHeartbeat):
        assert len(of_kind(readings, kind)) == len(of_kind(logged, kind)) > 0, kind
    for told, was in zip(of_kind(readings, Inertial), of_kind(logged, Inertial), strict=True):
        assert told.specific_force_mps2 == pytest.approx(was.specific_force_mps2, abs=0.006)
        assert told.angular_rate_radps == pytest.approx(was.angular_rate_radps, abs=0.001)
        assert told.time_s == was.time_s

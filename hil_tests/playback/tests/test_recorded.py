"""A recorded dive in place of a simulated vehicle."""

from __future__ import annotations

from math import inf
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.frame import CanFrame
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.frames import FrameScanner
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.mavlink.signing import Signing, SigningKey
from drivers.mavlink.tests.peer import Peer
from gateway.config import Config, parse
from gateway.tests.recorded_dives import (
    MAVLINK,
    START_S,
    dronecan,
    settings,
    telemetry,
    tlog_record,
    write_candump,
    write_tlog,
)
from hil_tests.dive_logs.laps import Part
from hil_tests.playback.recorded import ANSWERS_TO_IT, OWN_PACKETS, DiveLogs, RecordedDive
from hil_tests.report.outcome import ModeChange

PLAY_S = 1_800_000_000.0  # when the play begins
KEY = bytes(range(1, 33))


@pytest.fixture
def config(tmp_path: Path) -> Config:
    return parse(settings("dronecan") + MAVLINK, tmp_path)


def logs(*names: str, folder: Path, **options) -> DiveLogs:
    return DiveLogs(names, folder, **options)


def test_frames_come_from_their_ends_at_the_times_of_the_play(config, tmp_path):
    frames = list(dronecan(2.0))
    write_candump(tmp_path / "dive.log", frames)
    dive = RecordedDive(logs("dive.log", folder=tmp_path), config, PLAY_S)
    commands, reports = [], []
    for n in range(1, 101):
        dive.advance(PLAY_S + 0.02 * n)
        commands += dive.sent_by_autopilot()
        reports += dive.sent_by_devices()
    played = sorted([*commands, *reports], key=lambda frame: frame.time_s)
    later_s = PLAY_S - frames[0].time_s
    assert [frame.time_s for frame in played] == pytest.approx([one.time_s + later_s for one in frames], abs=1e-6)
    assert {frame.identifier & 0x7F for frame in commands} == {10}
    assert {frame.identifier & 0x7F for frame in reports} == {21, 22}
    assert [frame.data for frame in commands] == [one.data for one in frames if one.identifier & 0x7F == 10]
    assert dive.over


def test_nothing_comes_before_its_time(config, tmp_path):
    write_candump(
        tmp_path / "dive.log", [CanFrame(START_S + 0.5 * n, 0x123, b"\1", extended=False) for n in range(4)]
    )
    dive = RecordedDive(logs("dive.log", folder=tmp_path), config, PLAY_S)
    assert dive.next_s() == PLAY_S
    dive.advance(PLAY_S + 0.9)
    assert len(dive.sent_by_devices("can0")) == 2
    assert dive.next_s() == PLAY_S + 1.0
    assert not dive.over
    dive.advance(PLAY_S + 60.0)
    assert len(dive.sent_by_devices("can0")) == 2
    assert (dive.next_s(), dive.over) == (inf, True)


def test_a_part_is_played_over_and_over(config, tmp_path):
    write_candump(tmp_path / "dive.log", dronecan(4.0))
    dive = RecordedDive(logs("dive.log", folder=tmp_path, part=Part(1.0, 2.0), again=True), config, PLAY_S)
    dive.advance(PLAY_S + 9.5)
    frames = [*dive.sent_by_autopilot(), *dive.sent_by_devices()]
    assert len(frames) == pytest.approx(9.5 * 50 * (1 + 2 * 3), rel=0.02)
    assert dive.laps == 10
    dive.close()
    assert dive.over


def test_packets_come_with_the_modes_that_they_tell(config, tmp_path):
    beats = [(START_S + n, dialect.MAVLink_heartbeat_message(12, 3, base, mode, 4, 3)) for n, base, mode in (
        (0, 0x51, 19), (1, 0x51, 19), (2, 0xD1, 19), (3, 0xD1, 2), (4, 0xD1, 99),
    )]  # fmt: skip
    write_tlog(tmp_path / "dive.tlog", beats)
    dive = RecordedDive(logs("dive.tlog", folder=tmp_path), config, PLAY_S)
    dive.advance(PLAY_S + 10.0)
    assert [time_s for time_s, _ in dive.datagrams()] == [PLAY_S + n for n in range(5)]
    assert dive.modes == [
        ModeChange(PLAY_S, "MANUAL", False),
        ModeChange(PLAY_S + 2, "MANUAL", True),
        ModeChange(PLAY_S + 3, "ALT_HOLD", True),
        ModeChange(PLAY_S + 4, "99", True),
    ]


def test_what_the_gateway_of_then_said_and_was_answered_is_left_out(config, tmp_path):
    autopilot, gateway = Peer(1, 1), Peer(1, 192)
    packets = [
        autopilot.heartbeat(),
        gateway.pack(dialect.MAVLink_statustext_message(2, b"T1 entangled?")),
        autopilot.pack(dialect.MAVLink_command_ack_message(176, 0, target_system=1, target_component=192)),
        autopilot.pack(dialect.MAVLink_command_ack_message(176, 0, target_system=255, target_component=190)),
    ]
    records = (tlog_record(START_S + n, packet) for n, packet in enumerate(packets))
    (tmp_path / "dive.tlog").write_bytes(b"".join(records))
    dive = RecordedDive(logs("dive.tlog", folder=tmp_path), config, PLAY_S)
    dive.advance(PLAY_S + 10.0)
    assert [data for _, data in dive.datagrams()] == [packets[0], packets[3]]
    assert dive.left_out == {OWN_PACKETS: 1, ANSWERS_TO_IT: 1}


def test_what_is_said_to_it_now_is_noted_and_not_answered(config, tmp_path):
    write_tlog(tmp_path / "dive.tlog", telemetry(2.0))
    dive = RecordedDive(logs("dive.tlog", folder=tmp_path), config, PLAY_S)
    dive.advance(PLAY_S + 1.0)
    dive.datagrams()
    gateway = MavlinkEncoder(1)
    dive.to_autopilot(PLAY_S + 1.0, gateway.encode(StatusText(2, "T1 entangled?")))
    dive.to_autopilot(PLAY_S + 1.1, gateway.encode(CommandLong(176, (1, 9, 0, 0, 0, 0, 0), 1)))
    assert [(one.time_s, one.text) for one in dive.notes.texts] == [(PLAY_S + 1.0, "T1 entangled?")]
    assert [(one.command, one.result) for one in dive.notes.commands] == [(176, None)]
    assert dive.datagrams() == []


def test_with_a_key_it_is_signed_as_of_now(config, tmp_path):
    """By the time of the play: signatures of the dive's own time would be refused as replayed ones."""
    write_tlog(tmp_path / "dive.tlog", telemetry(1.0))
    dive = RecordedDive(logs("dive.tlog", folder=tmp_path), config, PLAY_S, key=KEY)
    dive.advance(PLAY_S + 2.0)
    drops: dict[str, int] = {}
    scanner = FrameScanner([0, 30, 36], drops, Signing(SigningKey(KEY), PLAY_S))
    packets = [packet for time_s, data in dive.datagrams() for packet in scanner.feed(data, time_s)]
    assert packets
    assert all(packet.signed for packet in packets)
    assert not drops


def test_a_part_beyond_the_end_is_refused_at_once(config, tmp_path):
    write_candump(tmp_path / "dive.log", dronecan(1.0))
    with pytest.raises(ValueError, match="nothing was recorded from 5 s"):
        RecordedDive(logs("dive.log", folder=tmp_path, part=Part(5.0)), config, PLAY_S)

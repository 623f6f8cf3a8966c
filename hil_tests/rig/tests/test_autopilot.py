"""The autopilot peer over a real loopback socket, and ArduSub's answers as they were measured."""

from __future__ import annotations

import socket
from math import nan

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.autopilot import AutopilotPeer
from hil_tests.rig.commands import Answer, Result
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Hull, Motion, mix

MOTION = Motion(
    north_m=10.0,
    east_m=-4.0,
    down_m=7.5,
    yaw_rad=-0.5,
    forward_mps=1.0,
    yaw_rate_radps=0.1,
    roll_rad=0.02,
    pitch_rad=0.03,
)
COMMANDS = (0.5, -0.5, 0.25, 0.0, 0.0, 0.0, 1.0, -1.0)


class Companion:
    """A gateway's end of the link, with pymavlink's own encoder."""

    def __init__(self) -> None:
        self.link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.link.bind(("127.0.0.1", 0))
        self.link.settimeout(2.0)
        self.codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=192)
        self.peer_address = None

    def send(self, message) -> None:
        self.link.sendto(message.pack(self.codec), self.peer_address)

    def command(self, command, *parameters, system=1, component=1) -> None:
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        self.send(mavlink.MAVLink_command_long_message(system, component, command, 0, *padded))

    def receive(self) -> list:
        self.link.setblocking(False)
        messages = []
        try:
            while True:
                data, self.peer_address = self.link.recvfrom(4096)
                messages += self.codec.parse_buffer(data)
        except BlockingIOError:
            return messages


@pytest.fixture
def companion():
    companion = Companion()
    yield companion
    companion.link.close()


@pytest.fixture
def ardusub():
    return ArduSub()


@pytest.fixture
def peer(companion, ardusub):
    peer = AutopilotPeer(companion.link.getsockname(), ardusub)
    peer.exchange(100.0, Telemetry(0.0, MOTION, COMMANDS))
    companion.greeting = companion.receive()
    yield peer
    peer.close()


def ask(companion, peer, command, *parameters, **target) -> list:
    companion.command(command, *parameters, **target)
    peer.exchange(100.01, Telemetry(0.01, MOTION, COMMANDS))
    return [message for message in companion.receive() if message.get_type() in {"COMMAND_ACK", "STATUSTEXT"}]


def test_it_introduces_itself_as_an_armed_ardusub(companion, peer):
    heartbeat = next(message for message in companion.greeting if message.get_type() == "HEARTBEAT")
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.custom_mode) == (12, 3, 19)
    assert heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert (heartbeat.get_srcSystem(), heartbeat.get_srcComponent()) == (1, 1)


def test_telemetry_tells_the_motion(companion, peer):
    told = {message.get_type(): message for message in companion.greeting}
    attitude = told["ATTITUDE"]
    assert (attitude.roll, attitude.pitch, attitude.yaw) == pytest.approx((0.02, 0.03, -0.5))
    assert attitude.rollspeed == pytest.approx(-0.1 * 0.03, rel=1e-3)  # a bow that is up leans the turn's axis back
    assert told["GLOBAL_POSITION_INT"].alt == -7500
    assert told["GLOBAL_POSITION_INT"].hdg == pytest.approx(33135, abs=1)
    assert told["SERVO_OUTPUT_RAW"].servo1_raw == 1700
    assert told["SERVO_OUTPUT_RAW"].servo8_raw == 1100
    assert "LOCAL_POSITION_NED" not in told


def test_streams_come_at_the_rate_asked_for(companion, peer):
    for message_id, interval_us in ((36, 50_000.0), (32, 100_000.0), (30, -1.0)):
        [ack] = ask(companion, peer, 511, message_id, interval_us)
        assert ack.result == Result.ACCEPTED
    counts: dict[str, int] = {}
    for step in range(1, 1001):
        time_s = 100.01 + 0.01 * step
        peer.exchange(time_s, Telemetry(time_s - 100.0, MOTION, COMMANDS))
        for message in companion.receive():
            counts[message.get_type()] = counts.get(message.get_type(), 0) + 1
    assert counts.pop("HEARTBEAT") == 10
    assert counts.pop("SERVO_OUTPUT_RAW") == pytest.approx(200, abs=2)
    assert counts.pop("LOCAL_POSITION_NED") == pytest.approx(100, abs=2)
    assert counts.pop("GLOBAL_POSITION_INT") == pytest.approx(30, abs=1)
    assert counts.pop("TIMESYNC") == 1  # its own question
    assert not counts


@pytest.mark.parametrize(
    ("command", "parameters", "result", "mode", "armed"),
    [
        (176, (1, 2), Result.ACCEPTED, Mode.ALT_HOLD, True),
        (176, (129, 16), Result.ACCEPTED, Mode.POSHOLD, True),
        (176, (1, 19), Result.ACCEPTED, Mode.MANUAL, True),
        (176, (1, 9), Result.ACCEPTED, Mode.SURFACE, True),
        (176, (0, 9), Result.DENIED, Mode.MANUAL, True),
        (176, (1, 55), Result.FAILED, Mode.MANUAL, True),
        (176, (1, 3), Result.FAILED, Mode.MANUAL, True),
        (21, (), Result.ACCEPTED, Mode.SURFACE, True),
        (17, (), Result.ACCEPTED, Mode.POSHOLD, True),
        (20, (), Result.UNSUPPORTED, Mode.MANUAL, True),
        (400, (0, 0), Result.ACCEPTED, Mode.MANUAL, False),
        (400, (0, 21196), Result.ACCEPTED, Mode.MANUAL, False),
        (185, (1,), Result.ACCEPTED, Mode.MANUAL, False),
        (420, (101, 1), Result.UNSUPPORTED, Mode.MANUAL, True),
        (511, (11031, 50000), Result.DENIED, Mode.MANUAL, True),
        (511, (291, 50000), Result.DENIED, Mode.MANUAL, True),
        (512, (148,), Result.ACCEPTED, Mode.MANUAL, True),
    ],
)
def test_commands_are_answered_as_ardusub_does(companion, peer, ardusub, command, parameters, result, mode, armed):
    answers = ask(companion, peer, command, *parameters)
    ack = next(message for message in answers if message.get_type() == "COMMAND_ACK")
    assert (ack.command, ack.result) == (command, result)
    assert (ack.target_system, ack.target_component) == (1, 192)
    assert (ardusub.mode, ardusub.armed) == (mode, armed)
    assert [(noted.command, noted.result, noted.time_s) for noted in peer.notes.commands] == [
        (command, result, 100.01)
    ]


def test_an_unknown_mode_is_named(companion, peer):
    texts = [m.text for m in ask(companion, peer, 176, 1, 55) if m.get_type() == "STATUSTEXT"]
    assert texts == ["No such mode 55"]


def test_commands_to_others_are_not_obeyed(companion, peer, ardusub):
    assert ask(companion, peer, 400, 0, system=7) == []
    assert ask(companion, peer, 400, 0, component=42) == []
    assert ardusub.armed


@pytest.mark.parametrize("parameter", [nan, float("inf"), -1.0, 1e30])
@pytest.mark.parametrize("command", [176, 400, 185, 511, 512])
def test_nonsense_in_a_command_is_refused_not_fatal(companion, peer, command, parameter):
    answers = ask(companion, peer, command, parameter, parameter)
    acks = [message.result for message in answers if message.get_type() == "COMMAND_ACK"]
    assert len(acks) == 1


def test_texts_and_heartbeats_are_noted_with_their_time(companion, peer):
    companion.send(mavlink.MAVLink_statustext_message(2, b"T3 entangled? 812 rpm, want 1043 (-22%)"))
    companion.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, mavlink.MAV_STATE_CRITICAL, 3))
    peer.exchange(123.5, Telemetry(23.5, MOTION, COMMANDS))
    [text], [heartbeat] = peer.notes.texts, peer.notes.heartbeats
    assert (text.time_s, text.component_id, text.severity) == (123.5, 192, 2)
    assert text.text == "T3 entangled? 812 rpm, want 1043 (-22%)"
    assert (heartbeat.time_s, heartbeat.system_status) == (123.5, mavlink.MAV_STATE_CRITICAL)


def test_garbage_is_survived(companion, peer):
    companion.link.sendto(bytes(range(256)) * 4, companion.peer_address)
    [ack] = ask(companion, peer, 176, 1, 2)
    assert ack.result == Result.ACCEPTED


def test_no_gateway_yet_is_no_error(ardusub):
    closed = Companion()
    address = closed.link.getsockname()
    closed.link.close()
    peer = AutopilotPeer(address, ardusub)
    for second in range(5):
        peer.exchange(100.0 + second, Telemetry(0.0, MOTION, COMMANDS))
    peer.close()


def fly(ardusub: ArduSub, motion: Motion, sticks: Sticks, seconds: float) -> Motion:
    hull = Hull(motion=motion)
    for _ in range(round(seconds / 0.02)):
        commands = mix(ardusub.demand(sticks, hull.motion))
        hull.step([40.0 * command for command in commands], 0.02)
    return hull.motion


def test_surface_hands_over_to_alt_hold_at_the_surface():
    ardusub = ArduSub(Mode.SURFACE)
    assert fly(ardusub, Motion(down_m=5.0), Sticks(), 1.0).down_m > 3.0
    assert ardusub.mode is Mode.SURFACE
    assert fly(ardusub, Motion(down_m=5.0), Sticks(), 30.0).down_m < 0.6
    assert ardusub.mode is Mode.ALT_HOLD


def test_poshold_keeps_the_place_and_alt_hold_the_depth():
    moving = Motion(down_m=6.0, forward_mps=0.8, down_mps=0.3)
    held = fly(ArduSub(Mode.POSHOLD), moving, Sticks(), 30.0)
    assert abs(held.north_m) < 0.4 > abs(held.east_m)
    assert held.down_m == pytest.approx(6.0, abs=0.4)
    driven = fly(ArduSub(Mode.ALT_HOLD), moving, Sticks(forward=0.5), 30.0)
    assert driven.north_m > 5.0
    assert driven.down_m == pytest.approx(6.0, abs=0.4)


def test_disarmed_thrusters_rest():
    assert ArduSub(armed=False).demand(Sticks(1.0, 1.0, 1.0, 1.0), Motion()) == Sticks()


def test_an_unknown_command_is_unsupported():
    assert ArduSub().answer(32000, (1.0,) * 7) == Answer(Result.UNSUPPORTED)

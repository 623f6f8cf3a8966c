"""A recorded dive onto buses and a link: through the wires, at a pace, with leave."""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from contextlib import closing
from pathlib import Path

import pytest
from click.testing import CliRunner

from drivers.can.frame import CanFrame
from drivers.can.port import CanPortError
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.frames import FrameScanner
from drivers.mavlink.messages import StatusText
from drivers.mavlink.tests.peer import Peer
from gateway.config import Config, parse
from gateway.tests.recorded_dives import MAVLINK, dronecan, settings, telemetry, write_candump, write_tlog
from hil_tests.bridge.permission import Granted, RefusedError
from hil_tests.bridge.transmission import TransmitGate, parse_transmission
from hil_tests.playback.command import hil
from hil_tests.playback.fault_words import parse_fault
from hil_tests.playback.log_outlets import Outlets, permitted
from hil_tests.playback.log_play import LogPlay, Sent, Wires
from hil_tests.playback.log_player import LogPlayer, Pace
from hil_tests.playback.log_session import LogSession, Progress, play_logs
from hil_tests.playback.recorded import DiveLogs, RecordedDive
from hil_tests.playback.virtual_time import run_in_virtual_time
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault, Subject

PLAY_S = 1_800_000_000.0
SECONDS = 4.0
ON_LINK = """
[vehicle]
name = "Test vehicle"
[[thruster]]
number = 1
command = { link = "mavlink", servo_channel = 1 }
rpm = { link = "mavlink", esc_index = 0 }
"""


class HeardPort:
    """A bus that keeps what it is given, and takes nothing while it is full."""

    def __init__(self, full_s: float = 0.0) -> None:
        self.frames: list[tuple[float, CanFrame]] = []
        self._full_s = full_s

    async def receive(self):
        await asyncio.Event().wait()

    def send(self, frame: CanFrame) -> None:
        now_s = asyncio.get_running_loop().time()
        if now_s < self._full_s:
            raise CanPortError("No buffer space available")
        self.frames.append((now_s, frame))

    def close(self) -> None:
        pass


@pytest.fixture
def both(tmp_path: Path) -> Config:
    return parse(settings("dronecan") + MAVLINK, tmp_path)


@pytest.fixture
def logs(tmp_path: Path) -> DiveLogs:
    write_candump(tmp_path / "dive.log", dronecan(SECONDS))
    write_tlog(tmp_path / "dive.tlog", telemetry(SECONDS))
    return DiveLogs(("dive.log", "dive.tlog"), tmp_path)


def log_play(logs: DiveLogs, config: Config, *faults: Fault) -> LogPlay:
    return LogPlay(RecordedDive(logs, config, PLAY_S), Wires.of(config, faults, PLAY_S))


def faults_of(*texts: str) -> list[Fault]:
    return [fault for text in texts for fault in parse_fault(text)]


def played_on(port: HeardPort, play: LogPlay, pace: Pace) -> list[tuple[float, Sent]]:
    """In virtual time; what was shown."""
    shown: list[tuple[float, Sent]] = []

    async def main(_clock) -> None:
        outlets = Outlets({"can0": port}, {}, None, Counter())
        player = LogPlayer(play, PLAY_S, outlets, lambda dive_s, sent: shown.append((dive_s, sent)))
        await player.at_pace(pace, asyncio.Event())

    run_in_virtual_time(main)
    return shown


def test_without_a_fault_all_comes_as_it_was_recorded(logs, both):
    sent = log_play(logs, both).due(PLAY_S + SECONDS)
    assert [frame.data for _, frame in sent.frames] == [frame.data for frame in dronecan(SECONDS)]
    assert len(sent.packets) == sum(1 for _ in telemetry(SECONDS))


def test_faults_act_from_their_time_on(logs, both):
    play = log_play(logs, both, *faults_of("can0 loss share=1 at_s=2", "mavlink cut at_s=1"))
    sent = play.due(PLAY_S + SECONDS)
    assert len(sent.frames) == pytest.approx(0.5 * sum(1 for _ in dronecan(SECONDS)), abs=10)
    assert len(sent.packets) == pytest.approx(0.25 * sum(1 for _ in telemetry(SECONDS)), abs=3)
    assert play.wires.counts().total() > 0


def test_a_speed_is_changed_on_its_way(logs, both):
    play = log_play(logs, both, *faults_of("thruster 1 rpm scale factor=0.5 at_s=2"))
    changed = [frame.data for _, frame in play.due(PLAY_S + SECONDS).frames]
    frames = list(dronecan(SECONDS))
    differing = {
        frame.identifier & 0x7F
        for frame, data in zip(sorted(frames, key=lambda one: one.time_s), changed, strict=True)
        if frame.data != data
    }
    assert differing == {21}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("thruster 1 entangled", "only a vehicle can have that"),
        ("thruster 7 rpm off", "the configuration has thrusters 1, 2"),
        ("can7 bus_off", "the configuration has buses can0"),
    ],
)
def test_a_fault_that_a_recording_cannot_have_is_refused(text, words, both):
    with pytest.raises(ValueError, match=words):
        Wires.of(both, faults_of(text), PLAY_S)


def test_a_fault_in_words():
    (fault,) = parse_fault("thruster 3 rpm scale factor=0.9 at_s=20 duration_s=10 ramp_s=2")
    assert fault.subject == Subject(Target.RPM, "thruster 3 rpm", 3)
    assert (fault.failure, fault.at_s, fault.until_s, fault.ramp_s) == ("scale", 20.0, 30.0, 2.0)
    assert fault.values == {"factor": 0.9}
    (fault,) = parse_fault("dvl bias bias_mps=0.2 axis=right")
    assert (fault.at_s, fault.axis) == (0.0, 1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("dvl", "want a subject, a failure, and its quantities"),
        ("dvl wobble", "failure: "),
        ("thruster 3 rpm scale", "factor: "),
        ("thruster 3 rpm scale factor=much", "factor: "),
    ],
)
def test_a_fault_in_wrong_words_is_told_with_what_is_wrong(text, words):
    with pytest.raises(ValueError, match=f"^--fault '{text}': .*{words}"):
        parse_fault(text)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_a_dive_is_played_at_its_pace(speed, tmp_path, both):
    write_candump(tmp_path / "dive.log", dronecan(SECONDS))
    port = HeardPort()
    played_on(port, log_play(DiveLogs(("dive.log",), tmp_path), both), Pace(speed))
    begun_s = port.frames[0][0]
    recorded = list(dronecan(SECONDS))
    for (sent_s, frame), was in zip(port.frames, recorded, strict=True):
        assert frame.data == was.data
        assert sent_s - begun_s == pytest.approx((was.time_s - recorded[0].time_s) / speed, abs=1e-4)


def test_as_fast_as_it_goes_nothing_is_waited_for(logs, both):
    port = HeardPort()
    shown = played_on(port, log_play(logs, both), Pace(float("inf")))
    assert len(port.frames) == sum(1 for _ in dronecan(SECONDS))
    assert port.frames[-1][0] - port.frames[0][0] < 0.01
    assert shown[-1][0] == pytest.approx(SECONDS, abs=0.05)


def test_a_full_bus_is_waited_for(tmp_path, both):
    write_candump(tmp_path / "dive.log", dronecan(0.1))
    port = HeardPort(full_s=0.3)
    played_on(port, log_play(DiveLogs(("dive.log",), tmp_path), both), Pace())
    assert len(port.frames) == sum(1 for _ in dronecan(0.1))
    assert port.frames[0][0] == pytest.approx(0.3, abs=0.01)


def test_a_bus_that_takes_nothing_any_more_ends_the_play(tmp_path, both):
    write_candump(tmp_path / "dive.log", dronecan(0.1))
    with pytest.raises(CanPortError, match="can0 takes no frames: No buffer space"):
        played_on(HeardPort(full_s=1e9), log_play(DiveLogs(("dive.log",), tmp_path), both), Pace())


def test_a_real_bus_gets_what_is_named_and_nothing_else(tmp_path, both):
    write_candump(tmp_path / "dive.log", dronecan(0.1))
    port, gate = HeardPort(), TransmitGate(parse_transmission("node:21"))

    async def main(_clock) -> None:
        outlets = Outlets({"can0": port}, {"can0": gate}, None, Counter())
        play = log_play(DiveLogs(("dive.log",), tmp_path), both)
        await LogPlayer(play, PLAY_S, outlets, lambda *_: None).at_pace(Pace(), asyncio.Event())
        assert any("not sent, for --transmit does not name them" in line for line in outlets.lines())

    run_in_virtual_time(main)
    assert {frame.identifier & 0x7F for _, frame in port.frames} == {21}


def test_a_bus_that_is_not_known_to_be_virtual_is_refused_without_leave():
    with pytest.raises(RefusedError, match=r"nothing is put on it without leave.*\n.*say --no-autopilot"):
        permitted({"can0": "lo"}, Granted())
    gates = permitted({"can0": "lo"}, Granted(parse_transmission("all"), no_autopilot=True))
    assert set(gates) == {"can0"}


async def test_packets_go_over_the_link_and_what_comes_back_is_noted(tmp_path):
    write_tlog(tmp_path / "dive.tlog", telemetry(0.5))
    shown: list[Progress] = []
    with closing(gateway_socket()) as gateway:
        session = link_session(tmp_path, gateway)
        playing = asyncio.create_task(play_logs(session, shown.append, asyncio.Event(), listen_s=0.01))
        loop = asyncio.get_running_loop()
        first, peer = await loop.sock_recvfrom(gateway, 4096)
        await loop.sock_sendto(gateway, MavlinkEncoder(1).encode(StatusText(2, "T1 entangled?")), peer)
        account = await playing
        packets = [first, *datagrams(gateway)]
    scanner = FrameScanner([0, 30, 36, 11030], drops := Counter())
    assert sum(len(scanner.feed(packet, 0.0)) for packet in packets) == sum(1 for _ in telemetry(0.5))
    assert not drops
    assert "came back: T1 entangled?" in account
    assert shown[-1].dive_s == pytest.approx(0.5, abs=0.1)


async def test_an_autopilot_that_is_there_already_ends_the_play(tmp_path):
    write_tlog(tmp_path / "dive.tlog", telemetry(60.0))
    with closing(gateway_socket()) as gateway:
        session = link_session(tmp_path, gateway)
        playing = asyncio.create_task(play_logs(session, lambda _: None, asyncio.Event(), listen_s=0.01))
        loop = asyncio.get_running_loop()
        _, peer = await loop.sock_recvfrom(gateway, 4096)
        await loop.sock_sendto(gateway, Peer(1, 1).heartbeat(), peer)
        with pytest.raises(RefusedError, match=r"ArduSub.* is heard on udpout.*would speak in its place"):
            await asyncio.wait_for(playing, 5.0)


def test_instants_are_stepped_through_line_by_line(tmp_path):
    write_tlog(tmp_path / "dive.tlog", sorted(telemetry(1.0), key=lambda one: one[0]))
    (tmp_path / "config.toml").write_text(ON_LINK + MAVLINK)
    with closing(gateway_socket()) as gateway:
        port = gateway.getsockname()[1]
        words = ["play-log", str(tmp_path / "config.toml"), str(tmp_path / "dive.tlog")]
        words += ["--mavlink", f"udpout:127.0.0.1:{port}", "--step"]
        result = CliRunner().invoke(hil, words, input="\n\nq\n\n", catch_exceptions=False)
        assert len(datagrams(gateway)) == 4  # of the first instant three
    assert result.exit_code == 0
    lines = result.output.splitlines()
    assert lines[0].split() == ["0.000", "SERVO_OUTPUT_RAW", "HEARTBEAT", "ATTITUDE"]
    assert lines[1].split() == ["0.002", "ESC_TELEMETRY_1_TO_4"]
    assert "mavlink: 4 sent" in lines


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "say where it is to be played"),
        (["--can", "can7=vcan0"], "want [BUS=]CHANNEL, of the buses of CONFIG: none"),
        (["--mavlink", "udpout:127.0.0.1:1", "--fault", "dvl"], "want a subject, a failure"),
        (["--mavlink", "udpout:127.0.0.1:1", "--offset", "x=1"], "want LOG=SECONDS"),
        (["--mavlink", "udpout:127.0.0.1:1", "--speed", "0"], "want how many times as fast"),
        (["--mavlink", "udpout:127.0.0.1:1", "--from", "9", "--to", "8"], "to_s = 8.0: want a time after"),
    ],
)
def test_what_cannot_be_played_is_said_in_a_line(words, told, tmp_path):
    write_tlog(tmp_path / "dive.tlog", telemetry(0.1))
    (tmp_path / "config.toml").write_text(ON_LINK + MAVLINK)
    result = CliRunner().invoke(hil, ["play-log", str(tmp_path / "config.toml"), str(tmp_path / "dive.tlog"), *words])
    assert result.exit_code == 2
    assert told in result.output
    assert "Traceback" not in result.output


def gateway_socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", 0))
    opened.setblocking(False)
    return opened


def datagrams(opened: socket.socket) -> list[bytes]:
    found = []
    while True:
        try:
            found.append(opened.recv(4096))
        except BlockingIOError:
            return found


def link_session(folder: Path, gateway: socket.socket) -> LogSession:
    config = parse(ON_LINK + MAVLINK, folder)
    endpoint = f"udpout:127.0.0.1:{gateway.getsockname()[1]}"
    return LogSession(dive=DiveLogs(("dive.tlog",), folder), config=config, endpoint=endpoint)

"""Links against real peers: pymavlink's own transports, MAVProxy, a pseudo-terminal, bare sockets."""

import asyncio
import contextlib
import os
import random
import re
import socket
import subprocess
import sys
import threading
import tty
from pathlib import Path

import pytest

from drivers.clock import Clock
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.endpoint import SerialPort, TcpClient, UdpClient, UdpServer, parse_endpoint
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, StatusText
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import AutopilotHeartbeat

MAVPROXY = Path(sys.executable).with_name("mavproxy.py")


class Watcher:
    """Runs a link and keeps what it says."""

    def __init__(self, endpoint):
        self.link = MavlinkLink("vehicle", endpoint, Clock())
        self.decoder = MavlinkDecoder([])
        self.readings, self.states, self.stamps = [], [], []

    async def __aenter__(self):
        self.task = asyncio.create_task(self.link.run(self.received, self.states.append))
        return self

    async def __aexit__(self, *_):
        self.task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self.task
        await asyncio.sleep(0)

    def received(self, data, time_s):
        self.stamps.append(time_s)
        self.readings += self.decoder.decode(data, time_s)


async def until(condition, timeout_s=10.0):
    async with asyncio.timeout(timeout_s):
        while not condition():  # noqa: ASYNC110 - what is awaited are lists that callbacks fill
            await asyncio.sleep(0.01)


def free_port(kind=socket.SOCK_DGRAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def mavutil_peer(url):
    """pymavlink's own link, as system 1, component 1."""
    from pymavlink import mavutil

    return mavutil.mavlink_connection(url, source_system=1, source_component=1)


def beat(peer):
    peer.mav.heartbeat_send(12, 3, 0x51, 19, 4)


def heard(peer, kind):
    """Messages of one kind that have arrived at a pymavlink link."""
    found = []
    while message := peer.recv_msg():
        if message.get_type() == kind:
            found.append(message)
    return found


async def converse(watcher, peer):
    """Heartbeats one way until they are heard, then a text the other way."""
    async with asyncio.timeout(10.0):
        while not watcher.readings:
            watcher.link.send(MavlinkEncoder(1).encode(CompanionHeartbeat(CompanionState.ACTIVE)))
            heard(peer, "HEARTBEAT")  # a pymavlink server answers only whom it has heard
            beat(peer)
            await asyncio.sleep(0.02)
        assert isinstance(watcher.readings[0], AutopilotHeartbeat)
        watcher.link.send(MavlinkEncoder(1).encode(StatusText(4, "T3 entangled? 812 rpm, want 1043 (-22%)")))
        texts = []
        while not texts:
            await asyncio.sleep(0.02)
            texts = heard(peer, "STATUSTEXT")
    assert (texts[0].text, texts[0].severity) == ("T3 entangled? 812 rpm, want 1043 (-22%)", 4)
    assert (texts[0].get_srcSystem(), texts[0].get_srcComponent()) == (1, 192)


async def test_udp_server_with_a_pymavlink_client():
    port = free_port()
    async with Watcher(f"udpin:127.0.0.1:{port}") as watcher:
        with contextlib.closing(mavutil_peer(f"udpout:127.0.0.1:{port}")) as peer:
            await converse(watcher, peer)
    assert [state.up for state in watcher.states] == [False, True]


async def test_udp_client_with_a_pymavlink_server():
    port = free_port()
    with contextlib.closing(mavutil_peer(f"udpin:127.0.0.1:{port}")) as peer:
        async with Watcher(f"udpout:127.0.0.1:{port}") as watcher:
            await converse(watcher, peer)


async def test_tcp_client_with_a_pymavlink_server():
    port = free_port(socket.SOCK_STREAM)
    with contextlib.closing(mavutil_peer(f"tcpin:127.0.0.1:{port}")) as peer:
        async with Watcher(f"tcp:127.0.0.1:{port}") as watcher:
            await converse(watcher, peer)


async def test_serial_port_comes_and_goes_with_its_device():
    master, slave = os.openpty()
    tty.setraw(master)
    async with Watcher(f"serial:{os.ttyname(slave)}:115200") as watcher:
        await until(lambda: watcher.states)
        os.write(master, Peer().heartbeat())
        await until(lambda: watcher.readings)
        watcher.link.send(MavlinkEncoder(1).encode(StatusText(6, "hello")))
        received = await asyncio.to_thread(os.read, master, 4096)
        assert messages_in(received)[0].text == "hello"
        os.close(master)
        await until(lambda: not watcher.states[-1].up)
        watcher.link.send(b"into the void")
    assert [state.up for state in watcher.states] == [False, True, False]
    assert watcher.link.unsent == {"not connected": 1}
    os.close(slave)


async def test_a_serial_adapter_that_is_unplugged_comes_back_under_its_name(tmp_path):
    device = tmp_path / "ttyUSB0"  # as udev keeps it, in /dev/serial/by-id
    async with Watcher(f"serial:{device}:115200") as watcher:
        await until(lambda: watcher.states)
        assert "No such file" in watcher.states[0].detail
        for times in (1, 2):
            master, slave = os.openpty()
            tty.setraw(master)
            device.symlink_to(os.ttyname(slave))
            await until(lambda times=times, master=master: said(master, watcher, times))
            device.unlink()
            os.close(master)
            os.close(slave)
            await until(lambda: not watcher.states[-1].up)
    assert [state.up for state in watcher.states] == [False, True, False, True, False]


def said(master, watcher, times):
    """Says it until it is heard: what is written before the other end is opened is lost."""
    if len(watcher.readings) < times:
        os.write(master, Peer().heartbeat())
    return len(watcher.readings) >= times


async def test_a_message_that_is_cut_off_with_its_connection_costs_no_other():
    server = socket.create_server(("127.0.0.1", 0))
    whole = Peer().heartbeat()
    async with Watcher(f"tcp:127.0.0.1:{server.getsockname()[1]}") as watcher:
        for cut in (3, 10, len(whole) - 1):
            before = len(watcher.readings)
            connection, _ = await asyncio.to_thread(server.accept)
            connection.sendall(whole + whole[:cut])
            await until(lambda before=before: len(watcher.readings) == before + 1)
            connection.close()
    server.close()
    assert len(watcher.readings) == 3
    assert watcher.decoder.drops.total() > 0


async def test_garbage_between_messages_is_counted_and_no_more():
    port, noise = free_port(), random.Random(1)
    async with Watcher(f"udpin:127.0.0.1:{port}") as watcher:
        await until(lambda: watcher.states)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect(("127.0.0.1", port))
            for number in range(50):
                sender.send(noise.randbytes(noise.randrange(300)))
                sender.send(Peer().heartbeat() + noise.randbytes(3))
                if number % 10 == 9:
                    await asyncio.sleep(0.01)
            await until(lambda: len(watcher.readings) == 50)
    assert all(isinstance(reading, AutopilotHeartbeat) for reading in watcher.readings)
    assert watcher.decoder.drops.total() > 0
    assert [state.up for state in watcher.states] == [False, True]


async def test_pauses_between_tries_double_up_to_a_limit_and_begin_anew_after_bytes(monkeypatch):
    pauses, sleep = [], asyncio.sleep

    async def note(seconds):
        pauses.append(seconds)
        await sleep(0.001)

    port = free_port(socket.SOCK_STREAM)
    async with Watcher(f"tcp:127.0.0.1:{port}") as watcher:
        monkeypatch.setattr("drivers.mavlink.link.asyncio.sleep", note)
        await eventually(sleep, lambda: len(pauses) >= 8)
        server = await asyncio.to_thread(socket.create_server, ("127.0.0.1", port))
        connection, _ = await asyncio.to_thread(server.accept)
        connection.sendall(Peer().heartbeat())
        await eventually(sleep, lambda: watcher.readings)
        tried = len(pauses)
        server.close()
        connection.close()
        await eventually(sleep, lambda: len(pauses) > tried)
        monkeypatch.undo()
    assert pauses[:8] == [0.25, 0.5, 1.0, 2.0, 4.0, 5.0, 5.0, 5.0]
    assert pauses[tried] == 0.25


async def eventually(sleep, condition):
    async with asyncio.timeout(10.0):
        while not condition():
            await sleep(0.002)


async def test_tcp_reconnects_when_the_server_returns():
    server = socket.create_server(("127.0.0.1", 0))
    address = server.getsockname()
    async with Watcher(f"tcp:127.0.0.1:{address[1]}") as watcher:
        for times in (1, 2):
            connection, _ = await asyncio.to_thread(server.accept)
            connection.sendall(Peer().heartbeat())
            await until(lambda times=times: len(watcher.readings) == times)
            server.close()
            connection.close()
            await until(lambda: not watcher.states[-1].up)
            assert "closed by the other end" in watcher.states[-1].detail
            server = socket.create_server(address)
    server.close()
    assert [state.up for state in watcher.states] == [False, True, False, True, False]


async def test_what_cannot_be_opened_is_said_and_tried_again():
    port = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rival:
        rival.bind(("127.0.0.1", port))
        async with Watcher(f"udpin:127.0.0.1:{port}") as watcher:
            await until(lambda: watcher.states)
            assert "cannot open udpin" in watcher.states[0].detail
            rival.close()
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
                peer.connect(("127.0.0.1", port))
                while not watcher.readings:
                    with contextlib.suppress(ConnectionRefusedError):
                        peer.send(Peer().heartbeat())
                    await asyncio.sleep(0.05)
    assert watcher.states[-1].up


@pytest.mark.parametrize("endpoint", ["serial:/dev/null:57600", "serial:/dev/does-not-exist:57600"])
async def test_a_serial_port_that_is_none(endpoint):
    async with Watcher(endpoint) as watcher:
        await until(lambda: watcher.states)
        assert "cannot open serial" in watcher.states[0].detail


async def test_a_udp_server_answers_everyone_who_spoke():
    port = free_port()
    async with Watcher(f"udpin:127.0.0.1:{port}") as watcher:
        await until(lambda: watcher.states)
        watcher.link.send(b"too early")
        assert watcher.link.unsent == {"nobody there yet": 1}
        with contextlib.ExitStack() as stack:
            peers = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(10)]
            for count, peer in enumerate(peers, start=1):
                peer.settimeout(0.5)
                peer.connect(("127.0.0.1", port))
                peer.send(Peer().heartbeat())
                await until(lambda count=count: len(watcher.readings) == count)
            watcher.link.send(b"to all")
            assert [await asyncio.to_thread(peer.recv, 99) for peer in peers[2:]] == [b"to all"] * 8
            for forgotten in peers[:2]:  # eight are remembered
                forgotten.setblocking(False)
                with pytest.raises(BlockingIOError):
                    forgotten.recv(99)


async def test_nobody_listens_yet_is_counted_and_survived():
    async with Watcher(f"udpout:127.0.0.1:{free_port()}") as watcher:
        await until(lambda: watcher.states)
        while not watcher.link.unsent:
            watcher.link.send(MavlinkEncoder(1).encode(CompanionHeartbeat(CompanionState.ACTIVE)))
            await asyncio.sleep(0.02)
        assert not watcher.task.done()
        assert watcher.link.unsent["Connection refused"] >= 1
        host, port = watcher.link.endpoint.host, watcher.link.endpoint.port
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as late:  # and when somebody does, that is heard
            late.bind((host, port))
            late.settimeout(0.0)
            while not watcher.readings:
                watcher.link.send(MavlinkEncoder(1).encode(CompanionHeartbeat(CompanionState.ACTIVE)))
                await asyncio.sleep(0.02)
                with contextlib.suppress(BlockingIOError):
                    late.sendto(Peer().heartbeat(), late.recvfrom(512)[1])
    assert watcher.states[-1].up


async def test_a_line_that_does_not_drain_never_blocks():
    server = socket.create_server(("127.0.0.1", 0))
    server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    async with Watcher(f"tcp:127.0.0.1:{server.getsockname()[1]}") as watcher:
        connection, _ = await asyncio.to_thread(server.accept)
        await until(lambda: watcher.states)
        for _ in range(200_000):
            watcher.link.send(bytes(280))
            if watcher.link.unsent:
                break
        assert watcher.link.unsent == {"line too slow": 1}
        connection.close()
    server.close()


async def test_silence_is_down_and_a_word_is_up(monkeypatch):
    monkeypatch.setattr("drivers.mavlink.link.SILENCE_S", 0.2)
    monkeypatch.setattr("drivers.mavlink.link.WATCH_S", 0.05)
    port = free_port()
    async with Watcher(f"udpin:127.0.0.1:{port}") as watcher:
        await until(lambda: watcher.states)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            for times in (1, 2):
                peer.sendto(Peer().heartbeat(), ("127.0.0.1", port))
                await until(lambda times=times: len(watcher.states) == 1 + 2 * times)
    assert [state.up for state in watcher.states] == [False, True, False, True, False]
    assert watcher.states[2].detail.startswith("silent")


@pytest.mark.parametrize("endpoint", ["udpin", "tcp"])
async def test_an_error_of_the_callers_ends_the_run_with_it(endpoint):
    def broken(data, time_s):
        raise ZeroDivisionError(data)

    server = socket.create_server(("127.0.0.1", 0))
    port = server.getsockname()[1]
    link = MavlinkLink("vehicle", f"{endpoint}:127.0.0.1:{port}", Clock())
    task = asyncio.create_task(link.run(broken, lambda state: None))
    if endpoint == "tcp":
        peer, _ = await asyncio.to_thread(server.accept)
    else:
        peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        peer.connect(("127.0.0.1", port))
        await asyncio.sleep(0.1)
    peer.send(b"x")
    with pytest.raises(ZeroDivisionError):
        await task
    peer.close()
    server.close()


async def test_bytes_are_stamped_at_reception():
    clock, port = Clock(), free_port()
    async with Watcher(f"udpin:127.0.0.1:{port}") as watcher:
        await until(lambda: watcher.states)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            before_s = clock.now()
            peer.sendto(Peer().heartbeat(), ("127.0.0.1", port))
            await until(lambda: watcher.readings)
    assert before_s - 0.01 <= watcher.stamps[0] <= clock.now() + 0.01
    assert watcher.readings[0].time_s == watcher.stamps[0]


@pytest.fixture
def mavproxy(tmp_path):
    """MAVProxy as the ground station: its port, and what it prints.

    It shows the texts of its target component only, which is the autopilot unless told otherwise.
    """
    if not MAVPROXY.exists():
        pytest.skip("MAVProxy is not installed")
    port, output = free_port(), []
    command = [sys.executable, MAVPROXY, f"--master=udpin:127.0.0.1:{port}", "--target-component=192"]
    command += ["--non-interactive", "--no-state", "--default-modules=link"]
    process = subprocess.Popen(
        command, cwd=tmp_path, env={"HOME": str(tmp_path), "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    reader = threading.Thread(target=lambda: output.extend(process.stdout), daemon=True)
    with process:
        reader.start()
        yield port, output
        process.terminate()
        process.wait(10)
        reader.join(10)


async def test_mavproxy_shows_our_text(mavproxy):
    port, output = mavproxy
    encoder = MavlinkEncoder(1)
    async with Watcher(f"udpout:127.0.0.1:{port}") as watcher:
        async with asyncio.timeout(30.0):
            while "AP: T3 entangled? 812 rpm, want 1043 (-22%)\n" not in output:
                watcher.link.send(encoder.encode(CompanionHeartbeat(CompanionState.CRITICAL)))
                watcher.link.send(encoder.encode(StatusText(4, "T3 entangled? 812 rpm, want 1043 (-22%)")))
                await asyncio.sleep(0.1)
        await until(lambda: watcher.states[-1].up)  # its own heartbeats reach us
    assert not watcher.readings  # and a ground station is no autopilot


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("udpin:127.0.0.1:0", UdpServer("127.0.0.1", 0)),
        ("udpout:[::1]:14551", UdpClient("::1", 14551)),
        ("tcp:blueos.local:5777", TcpClient("blueos.local", 5777)),
        ("serial:/dev/serial/by-id/usb-x:1:921600", SerialPort("/dev/serial/by-id/usb-x:1", 921600)),
    ],
)
def test_endpoints(text, wanted):
    assert parse_endpoint(text) == wanted


@pytest.mark.parametrize(
    "text",
    ["", "udpin", "udp:127.0.0.1:14550", "tcp:127.0.0.1", "tcp::5760", "tcp:a:0", "udpin:a:65536", "udpin:a:-1",
     "serial:/dev/ttyACM0", "serial:/dev/ttyACM0:fast", "serial:/dev/ttyACM0:0", "tcp:a:\u0665"],
)  # fmt: skip
def test_endpoints_that_are_none(text):
    with pytest.raises(ValueError, match=re.escape(repr(text))):
        parse_endpoint(text)

"""The companion on a signed link: real sockets, and pymavlink's own signing at the other end."""

import asyncio
import contextlib
import logging
import socket
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.clock import Clock
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, StatusText
from drivers.mavlink.signing import stamp_of
from drivers.mavlink.tests.peer import Peer
from drivers.readings import AutopilotHeartbeat, OperatorRequest
from gateway.companion import Companion
from gateway.config import parse
from gateway.intake import Intake
from gateway.signing.memory import unpack
from gateway.tests.conftest import TWO_THRUSTERS
from gateway.tests.test_cli import called

SECRET = bytes(range(1, 33))
PATIENCE_S = 10.0


class SignedVehicle:
    """An autopilot, and whoever else shares its socket, that signs with `key` and takes only what is so signed."""

    def __init__(self, port, key, stamp=None):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._gateway = ("127.0.0.1", port)
        self.autopilot = Peer(key=key)
        self.ground = Peer(255, 190, key)
        self.reader = dialect.MAVLink(None)
        self.reader.robust_parsing = True
        self.reader.signing.secret_key = key
        for peer in (self.autopilot.mav, self.ground.mav, self.reader):
            peer.signing.timestamp = stamp_of(time.time()) if stamp is None else stamp
        self.heard = []

    def say(self, *packets):
        for packet in packets:
            self._socket.sendto(packet, self._gateway)

    def command(self, number, signed=True):
        """An operator's command from the ground station."""
        peer = self.ground if signed else Peer(255, 190)
        return peer.pack(dialect.MAVLink_command_long_message(1, 192, number, 0, 0, 0, 0, 0, 0, 0, 0))

    def listen(self):
        with contextlib.suppress(BlockingIOError):
            while True:
                self.heard += [
                    one
                    for one in self.reader.parse_buffer(self._socket.recv(4096)) or []
                    if one.get_type() != "BAD_DATA"
                ]
        return self.heard

    def close(self):
        self._socket.close()


class Session:
    """A companion on a free port, and what it took."""

    def __init__(self, folder, key=SECRET, extra=""):
        if key is not None:
            path = folder / "mavlink.key"
            path.touch(0o600)
            path.write_bytes(key)
            extra += '\nsigning_key = "mavlink.key"'
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        endpoint = f'endpoint = "udpin:127.0.0.1:{self.port}"\n{extra}'
        config = parse(TWO_THRUSTERS.replace('endpoint = "udpin:127.0.0.1:0"', endpoint), folder)
        self.stamps = config.files.state.with_name(config.files.state.name + ".stamps")
        self.readings = []
        self.companion = Companion(config, Clock(), Intake(lambda work: self.readings.extend(work.readings) or True))

    async def __aenter__(self):
        self.task = asyncio.create_task(self.companion.run(self.companion.on_state))
        return self

    async def __aexit__(self, *_):
        self.task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self.task

    def took(self, kind):
        return [one for one in self.readings if isinstance(one, kind)]

    def drops(self, cause):
        return self.companion.drops()[cause]


async def until(condition, meanwhile=lambda: None):
    """Waits for something to come true, on a busy machine too."""
    deadline = asyncio.get_running_loop().time() + PATIENCE_S
    while not condition():
        assert asyncio.get_running_loop().time() < deadline, "waited in vain"
        meanwhile()
        await asyncio.sleep(0.02)


async def test_both_ends_have_the_key(tmp_path):
    async with Session(tmp_path) as session:
        vehicle = SignedVehicle(session.port, SECRET)
        await until(lambda: session.took(AutopilotHeartbeat), lambda: vehicle.say(vehicle.autopilot.heartbeat()))
        session.companion.send(CompanionHeartbeat(CompanionState.ACTIVE))
        session.companion.send(StatusText(4, "T3 entangled? " + 70 * "x"))
        await until(lambda: {"HEARTBEAT", "STATUSTEXT"} <= {one.get_type() for one in vehicle.listen()})
        assert all(one.get_signed() for one in vehicle.heard)
        assert vehicle.reader.signing.badsig_count == vehicle.reader.signing.unsigned_count == 0
        vehicle.close()
    assert unpack(session.stamps.read_bytes()).streams.keys() >= {(1, 1, 0)}


async def test_strangers_are_not_heard_and_that_is_said_with_the_way_out(tmp_path, caplog):
    async with Session(tmp_path) as session:
        unsigned, stranger = SignedVehicle(session.port, None), SignedVehicle(session.port, SECRET[::-1])
        await until(
            lambda: session.drops("unsigned") > 3 and session.drops("wrong key") > 3,
            lambda: (unsigned.say(unsigned.autopilot.heartbeat()), stranger.say(stranger.autopilot.heartbeat())),
        )
        assert session.readings == [] and session.companion.received == 0
        unsigned.close()
        stranger.close()
    assert caplog.text.count("(unsigned); it does not sign") == 1
    assert caplog.text.count("(wrong key); it signs with another key") == 1


async def test_a_recording_is_not_heard_again_not_even_by_the_next_run(tmp_path):
    async with Session(tmp_path) as session:
        vehicle = SignedVehicle(session.port, SECRET)
        recording = vehicle.autopilot.heartbeat()
        await until(lambda: session.took(AutopilotHeartbeat), lambda: vehicle.say(recording))
        await until(lambda: session.drops("played again or late") > 3, lambda: vehicle.say(recording))
        assert len(session.took(AutopilotHeartbeat)) == 1
        vehicle.close()
    async with Session(tmp_path) as session:
        vehicle = SignedVehicle(session.port, SECRET)
        await until(lambda: session.drops("played again or late") > 3, lambda: vehicle.say(recording))
        assert session.readings == []
        vehicle.close()


@pytest.mark.parametrize("extra", ["", "accept_unsigned = true"])
async def test_commands_are_taken_only_signed_where_there_is_a_key(tmp_path, extra):
    async with Session(tmp_path, extra=extra) as session:
        vehicle = SignedVehicle(session.port, SECRET)
        await until(lambda: session.took(AutopilotHeartbeat), lambda: vehicle.say(vehicle.autopilot.heartbeat()))
        for _ in range(5):
            vehicle.say(vehicle.command(31010, signed=False))
        vehicle.say(vehicle.autopilot.heartbeat())
        seen = len(session.took(AutopilotHeartbeat))
        await until(lambda: len(session.took(AutopilotHeartbeat)) > seen)
        assert session.took(OperatorRequest) == []
        await until(lambda: session.took(OperatorRequest), lambda: vehicle.say(vehicle.command(31010)))
        assert session.took(OperatorRequest)[0].system_id == 255
        vehicle.close()


async def test_an_autopilot_whose_clock_stood_still_hears_us_first_and_follows(tmp_path):
    """As after months in the workshop, without GNSS: its stamps are old, until it has heard ours."""
    async with Session(tmp_path, extra="system_id = 1") as session:
        vehicle = SignedVehicle(session.port, SECRET, stamp=stamp_of(time.time() - 90 * 86_400.0))
        await until(
            lambda: session.drops("signed too long ago") > 0, lambda: vehicle.say(vehicle.autopilot.heartbeat())
        )

        def follow():
            session.companion.send(CompanionHeartbeat(CompanionState.BOOT))
            vehicle.listen()
            vehicle.autopilot.mav.signing.timestamp = vehicle.reader.signing.timestamp
            vehicle.say(vehicle.autopilot.heartbeat())

        await until(lambda: session.took(AutopilotHeartbeat), follow)
        vehicle.close()


async def test_without_a_key_signed_packets_are_taken_like_any_other(tmp_path, caplog):
    async with Session(tmp_path, key=None) as session:
        vehicle = SignedVehicle(session.port, SECRET)
        await until(lambda: session.took(AutopilotHeartbeat), lambda: vehicle.say(vehicle.autopilot.heartbeat()))
        vehicle.close()
    assert not session.stamps.exists() and "refused" not in caplog.text


def test_run_does_not_start_without_its_key(tmp_path, caplog):
    caplog.set_level(logging.DEBUG)
    path = tmp_path / "gateway.toml"
    path.write_text(TWO_THRUSTERS.replace("[mavlink]\n", '[mavlink]\nsigning_key = "mavlink.key"\n'))
    code, text = called("run", str(path))
    assert code == 1 and f"mavlink.signing_key = {tmp_path / 'mavlink.key'}: cannot be read" in text
    (tmp_path / "mavlink.key").write_text("never to be seen")
    (tmp_path / "mavlink.key").chmod(0o644)
    code, text = called("run", str(path))
    assert code == 1 and f"chmod 600 {tmp_path / 'mavlink.key'}" in text
    assert "never" not in text + caplog.text and "Traceback" not in text

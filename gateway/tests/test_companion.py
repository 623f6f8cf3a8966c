"""The companion among others on the vehicle's network: autopilot, ground station and routers, over real sockets."""

import asyncio
import contextlib
import logging
import socket
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.clock import Clock
from drivers.mavlink.messages import CommandAck, CompanionHeartbeat, CompanionState, NamedValue, StatusText
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import (
    AutopilotClock,
    AutopilotHeartbeat,
    AutopilotReboot,
    IdentityConflict,
    LinkState,
    OperatorAct,
    OperatorRequest,
)
from gateway.companion import Companion
from gateway.config import parse
from gateway.intake import Intake
from gateway.tests.conftest import TWO_THRUSTERS

PATIENCE_S = 10.0
BEAT = CompanionHeartbeat(CompanionState.ACTIVE)
SET_MESSAGE_INTERVAL = 511


class End:
    """A program with a socket of its own, that sends as one peer and hears all.

    Attributes:
        raw: datagrams as they came.
        echo: send everything back, as routers do.
    """

    def __init__(self, port, peer):
        self.peer = peer
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._gateway = ("127.0.0.1", port)
        self._reader = dialect.MAVLink(None)
        self.raw, self.heard, self.echo = [], [], False

    def say(self, *packets):
        for packet in packets:
            self._socket.sendto(packet, self._gateway)

    def pack(self, message):
        return self.peer.pack(message)

    def beat(self):
        """The autopilot's HEARTBEAT, or that of a ground station."""
        autopilot = self.peer.mav.srcComponent == 1
        self.say(self.peer.heartbeat() if autopilot else self.peer.heartbeat(autopilot=8, vehicle_type=6))

    def listen(self):
        with contextlib.suppress(BlockingIOError):
            while True:
                datagram = self._socket.recv(4096)
                self.raw.append(datagram)
                messages = self._reader.parse_buffer(datagram) or []
                self.heard += messages
                for message in messages:
                    self.react(message)
                if self.echo:
                    self.say(datagram)

    def react(self, message):
        pass

    def of(self, kind):
        return [message for message in self.heard if message.get_type() == kind]

    def close(self):
        self._socket.close()


class Autopilot(End):
    """It grants streams, answers TIMESYNC by the clock since `boot_s`, and tells its time."""

    def __init__(self, port):
        super().__init__(port, Peer())
        self.booted_s = time.time() - 500.0
        self.obeys = True

    def react(self, message):
        if message.get_type() == "COMMAND_LONG" and self.obeys:
            self.say(self.pack(dialect.MAVLink_command_ack_message(message.command, 0)))
        if message.get_type() == "TIMESYNC" and message.tc1 == 0:
            since_boot_ns = round((time.time() - self.booted_s) * 1e9)
            self.say(self.pack(dialect.MAVLink_timesync_message(since_boot_ns, message.ts1)))

    def tell_time(self):
        boot_ms = round(1000.0 * (time.time() - self.booted_s))
        self.say(self.pack(dialect.MAVLink_system_time_message(0, boot_ms)))

    def intervals(self):
        return [message.param1 for message in self.of("COMMAND_LONG") if message.command == SET_MESSAGE_INTERVAL]


class Network:
    """A companion, an autopilot and a ground station on sockets of their own, all of them alive in `until`."""

    def __init__(self, folder, speed=1.0):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        config = parse(TWO_THRUSTERS.replace("udpin:127.0.0.1:0", f"udpin:127.0.0.1:{self.port}"), folder)
        start_s = time.monotonic()
        clock = Clock(monotonic=lambda: start_s + speed * (time.monotonic() - start_s))
        self.clock, self.readings = clock, []
        self.companion = Companion(config, clock, Intake(lambda work: self.readings.extend(work.readings) or True))
        self.autopilot = Autopilot(self.port)
        self.ground = End(self.port, Peer(255, 190))
        self.ends = [self.autopilot, self.ground]
        self._steps = 0

    async def __aenter__(self):
        self.task = asyncio.create_task(self.companion.run(self.companion.on_state))
        await self.until(lambda: self.took(AutopilotHeartbeat) and self.ground.of("ONBOARD_COMPUTER_STATUS"))
        return self

    async def __aexit__(self, *_):
        self.task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self.task
        for end in self.ends:
            end.close()

    def took(self, kind):
        return [one for one in self.readings if isinstance(one, kind)]

    def step(self):
        if self._steps % 10 == 0:
            self.autopilot.beat()
            self.autopilot.tell_time()
            self.ground.beat()
        self._steps += 1
        for end in self.ends:
            end.listen()
        self.companion.advance(self.clock.now())

    async def until(self, condition):
        deadline = asyncio.get_running_loop().time() + PATIENCE_S
        while not condition():
            assert asyncio.get_running_loop().time() < deadline, "waited in vain"
            self.step()
            await asyncio.sleep(0.01)

    def command(self, number, code=0.0, component=192):
        message = dialect.MAVLink_command_long_message(1, component, number, 0, code, 0, 0, 0, 0, 0, 0)
        self.ground.say(self.ground.pack(message))


async def test_an_operators_command_is_taken_and_its_answer_comes_to_him(tmp_path):
    async with Network(tmp_path) as net:
        net.command(OperatorAct.ACCEPT, 3.0)
        await net.until(lambda: net.took(OperatorRequest))
        (request,) = net.took(OperatorRequest)
        assert (request.act, request.code, request.system_id) == (OperatorAct.ACCEPT, 3, 255)
        net.companion.send(CommandAck(request.act, 0, request.system_id, request.component_id))
        await net.until(lambda: net.ground.of("COMMAND_ACK"))
    (answer,) = [one for one in net.ground.of("COMMAND_ACK") if one.command == OperatorAct.ACCEPT]
    assert (answer.result, answer.target_system, answer.target_component) == (0, 255, 190)
    assert (answer.get_srcSystem(), answer.get_srcComponent()) == (1, 192)


async def test_other_commands_are_answered_at_once_and_those_to_others_are_not(tmp_path):
    async with Network(tmp_path) as net:
        net.command(400, component=1)
        net.command(512, component=0)
        net.command(520)
        await net.until(lambda: net.ground.of("COMMAND_ACK"))
        net.companion.send(BEAT)
        await net.until(lambda: net.ground.of("HEARTBEAT"))
    assert [(one.command, one.result) for one in net.ground.of("COMMAND_ACK")] == [(520, 3)]
    assert net.took(OperatorRequest) == []


async def test_the_answer_to_this_machines_own_operator_stays_here(tmp_path):
    async with Network(tmp_path) as net:
        net.companion.send(CommandAck(OperatorAct.MUTE, 0, 0, 0))
        net.companion.send(StatusText(6, "end"))
        await net.until(lambda: net.ground.of("STATUSTEXT"))
    assert net.ground.of("COMMAND_ACK") == [] and net.companion.drops().total() == 0


async def test_clocks_are_compared_both_ways_and_the_summary_says_so(tmp_path):
    async with Network(tmp_path) as net:
        await net.until(lambda: net.took(AutopilotClock))
        asked = net.autopilot.pack(dialect.MAVLink_timesync_message(0, 4711))
        net.autopilot.say(asked)
        await net.until(lambda: any(one.tc1 for one in net.autopilot.of("TIMESYNC")))
    measured = net.took(AutopilotClock)[0]
    assert abs(measured.offset_s - net.autopilot.booted_s) <= measured.round_trip_s / 2.0 + 0.005
    (answer,) = [one for one in net.autopilot.of("TIMESYNC") if one.tc1]
    assert answer.ts1 == 4711 and answer.tc1 == pytest.approx(time.time() * 1e9, abs=PATIENCE_S * 1e9)
    assert "s behind ours, to within" in net.companion.remarks()["autopilot"]


async def test_ground_stations_hear_how_the_computer_is_and_what_to_plot(tmp_path):
    async with Network(tmp_path) as net:
        net.companion.send(NamedValue("T3", 0.25, 1.0))
        await net.until(lambda: net.ground.of("ONBOARD_COMPUTER_STATUS") and net.ground.of("NAMED_VALUE_FLOAT"))
    status = net.ground.of("ONBOARD_COMPUTER_STATUS")[0]
    assert 0 < status.ram_usage < status.ram_total and status.cpu_cores[0] <= 100
    assert net.ground.of("NAMED_VALUE_FLOAT")[0].name == "T3"


async def test_a_long_text_goes_out_as_one_datagram_a_chunk(tmp_path):
    async with Network(tmp_path) as net:
        net.companion.send(StatusText(6, "0123456789" * 12))
        await net.until(lambda: len(net.ground.of("STATUSTEXT")) == 3)
    assert [one.chunk_seq for one in net.ground.of("STATUSTEXT")] == [0, 1, 2]
    texts = [data for data in net.ground.raw if data[7:10] == b"\xfd\x00\x00"]
    assert [len(messages_in(data)) for data in texts] == [1, 1, 1]


async def test_our_own_words_come_back_by_two_routers_and_mean_nothing(tmp_path):
    async with Network(tmp_path, speed=5.0) as net:
        net.autopilot.echo = net.ground.echo = True
        for _ in range(5):
            net.companion.send(BEAT)
            before = net.companion.drops()["our own, coming back"]
            await net.until(lambda before=before: net.companion.drops()["our own, coming back"] >= before + 2)
        await net.until(lambda: net.took(AutopilotClock))
    assert net.took(IdentityConflict) == [] and net.took(OperatorRequest) == []
    assert net.companion.drops()["another's, with our ids"] == 0


async def test_another_program_with_our_ids_is_told_with_the_way_out(tmp_path, caplog):
    caplog.set_level(logging.WARNING, "gateway")
    async with Network(tmp_path, speed=5.0) as net:
        twin = End(net.port, Peer(1, 192))
        net.ends.append(twin)

        def noticed():
            net.companion.send(BEAT)
            twin.say(twin.peer.heartbeat(autopilot=8, vehicle_type=18, base_mode=0, custom_mode=7))
            return net.took(IdentityConflict)

        await net.until(noticed)
    assert "system 1, component 192, as we do: set mavlink.component_id" in caplog.text


async def test_streams_are_asked_for_again_after_the_autopilot_restarted(tmp_path):
    async with Network(tmp_path) as net:
        await net.until(lambda: net.autopilot.intervals() == [36.0, 2.0])
        assert net.took(AutopilotReboot) == []
        net.autopilot.booted_s = time.time()
        await net.until(lambda: net.took(AutopilotReboot))
        await net.until(lambda: net.autopilot.intervals() == [36.0, 2.0, 36.0, 2.0])


async def test_an_autopilot_that_takes_no_commands_from_us_is_told_to_the_pilot_until_it_does(tmp_path):
    net = Network(tmp_path, speed=30.0)
    net.autopilot.obeys = False
    async with net:
        await net.until(lambda: net.took(LinkState))
        (state,) = net.took(LinkState)
        assert (state.link, state.up, state.detail) == ("mavlink", True, "answers none of our commands")
        net.autopilot.obeys = True
        await net.until(lambda: len(net.took(LinkState)) == 2)
        assert net.took(LinkState)[1].detail == ""


async def test_nothing_is_asked_or_told_before_there_is_an_autopilot(tmp_path):
    net = Network(tmp_path)
    net.task = asyncio.create_task(net.companion.run(net.companion.on_state))
    for _ in range(30):
        net.ground.beat()
        net.ground.listen()
        net.companion.advance(net.clock.now())
        await asyncio.sleep(0.01)
    await net.__aexit__()
    assert net.ground.heard == [] and net.companion.drops().total() == 0
    assert net.companion.remarks() == {}

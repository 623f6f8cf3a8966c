"""Devices around an autopilot that is not simulated here: in one process, in two, and with MAVProxy in between."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import AsyncExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.dronecan import encode_raw_command
from drivers.can.frame import CanFrame
from drivers.clock import Clock
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.mavlink.tests.peer import Peer
from drivers.readings import ThrusterCommand, ThrusterReport
from gateway.config import parse
from gateway.wiring import can_decoder
from hil_tests.bridge.permission import Granted
from hil_tests.loopback import free_port
from hil_tests.playback.attached import AttachedDevices, attached
from hil_tests.playback.sockets import HOST
from hil_tests.profiles.loading import load_profile
from hil_tests.rig.commands import Result
from hil_tests.rig.dvl import DvlErrors
from hil_tests.rig.ground_station import GroundStation, program
from hil_tests.rig.profile_sections import Sensors
from hil_tests.rig.truth import ModeChange
from hil_tests.scenario.document import Scenario

START_S = 1_700_000_000.0
STEP_S = 0.02
PROFILE = load_profile("bench_rov").model_copy(update={"sensors": Sensors(dvl=DvlErrors())})
WAIT_S = 60.0  # processes start, on machines that have other things to do


class Bench:
    """Devices and an autopilot that is played by hand."""

    def __init__(self, *faults: dict[str, Any]) -> None:
        self.sent: list[bytes] = []
        scenario = Scenario(duration_s=60.0, faults=list(faults))
        self.devices = AttachedDevices(scenario, PROFILE, START_S, self.sent.append)
        self.autopilot = Peer(1, 1)
        config = parse(PROFILE.gateway_toml(), PROFILE.folder)
        self.decoder = can_decoder(config.can[0], config.thruster)
        self.now_s = START_S
        self.readings: list[Any] = []
        self._commands: list[int] | None = None

    def says(self, *packets: bytes) -> None:
        for packet in packets:
            self.devices.from_autopilot(self.now_s, packet)

    def outputs(self, *pulses_us: int) -> None:
        """At its servo outputs from now on, 20 times a second."""
        self._commands = [*pulses_us, *[1500] * (8 - len(pulses_us))]

    def run(self, seconds: float, motion: tuple[float, float] | None = None, bus: Sequence[CanFrame] = ()) -> None:
        """As a session runs it; `motion` is the speed north and the yaw that are told."""
        for n in range(round(seconds / STEP_S)):
            self.now_s += STEP_S
            boot_ms = round(1e3 * (self.now_s - START_S))
            if n % 50 == 0:
                self.says(self.autopilot.heartbeat(base_mode=0xD1))
            if self._commands and n % 2 == 0:
                message = dialect.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *self._commands)
                self.says(self.autopilot.pack(message))
            if motion is not None and n % 2 == 0:
                north_mps, yaw_rad = motion
                moving = dialect.MAVLink_local_position_ned_message(boot_ms, 0.0, 0.0, 5.0, north_mps, 0.0, 0.0)
                turned = dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, yaw_rad, 0.0, 0.0, 0.0)
                self.says(self.autopilot.pack(moving), self.autopilot.pack(turned))
            self.devices.advance(self.now_s)
            commands = self.devices.sent_by_autopilot() + list(bus)
            self.devices.to_devices(commands)
            for frame in [*commands, *self.devices.sent_by_devices()]:
                self.readings += self.decoder.decode(frame)

    def said(self, kind: str) -> list[Any]:
        """Messages of a kind that the autopilot was sent."""
        parser = dialect.MAVLink(None)
        parsed = [message for data in self.sent for message in parser.parse_buffer(data) or []]
        return [message for message in parsed if message.get_type() == kind]

    def speeds(self) -> dict[int, float]:
        """Newest by thruster."""
        return {one.thruster: one.speed_rpm for one in self.readings if isinstance(one, ThrusterReport)}


def test_servo_outputs_turn_the_thrusters_and_are_on_the_bus_as_commands():
    bench = Bench()
    bench.outputs(1600, 1400)
    bench.run(4.0)
    speeds = bench.speeds()
    assert speeds[1] > 500 > -500 > speeds[2]
    assert speeds[3] == 0.0
    commands = [one for one in bench.readings if isinstance(one, ThrusterCommand)]
    assert {round(one.fraction, 3) for one in commands if one.thruster == 1} == {0.25}
    assert commands[0].time_s >= START_S + 2.0  # until then somebody might command on the bus
    assert not bench.decoder.drops


def test_a_play_around_an_autopilot_that_is_armed_or_silent_ends():
    bench = Bench()
    bench.says(bench.autopilot.heartbeat(base_mode=0x51))
    assert bench.devices.trouble(bench.now_s + 1.0, Granted()) == ""
    assert "has been silent" in bench.devices.trouble(bench.now_s + 6.0, Granted())
    bench.says(Peer(2, 1).heartbeat(base_mode=0xD1), bench.autopilot.heartbeat(base_mode=0x51))
    assert "(system 2) has become armed" in bench.devices.trouble(bench.now_s + 1.0, Granted())
    assert bench.devices.trouble(bench.now_s + 6.0, Granted(while_armed=True)) == ""
    bench.devices.lost = "udpin:127.0.0.1:1: gone"
    assert bench.devices.trouble(bench.now_s, Granted(while_armed=True)) == "udpin:127.0.0.1:1: gone"


def test_with_commands_on_the_bus_servo_outputs_say_nothing():
    bench = Bench()
    bench.outputs(1600)
    bench.run(0.1, bus=encode_raw_command([0] * 8, 10, 0, time_s=START_S))
    bench.run(4.0)
    assert not any(isinstance(one, ThrusterCommand) and one.fraction for one in bench.readings)
    assert set(bench.speeds().values()) == {0.0}


def test_what_is_wrong_with_a_thruster_shows_in_its_reports():
    bench = Bench({"at_s": 4.0, "subject": "thruster 1", "failure": "off"})
    bench.outputs(1600, 1600)
    bench.run(3.9)
    healthy = bench.speeds()
    bench.run(2.0)
    assert bench.speeds()[1] == pytest.approx(0.0, abs=20.0)
    assert bench.speeds()[2] == pytest.approx(healthy[2], rel=0.05)


def test_it_asks_for_what_it_needs():
    bench = Bench()
    bench.run(1.0)
    wanted = set()
    for _ in range(8):
        newest = bench.said("COMMAND_LONG")[-1]
        wanted.add(int(newest.param1))
        assert (newest.command, newest.param2, newest.get_srcComponent()) == (511, 50_000, 193)
        bench.says(
            bench.autopilot.pack(dialect.MAVLink_command_ack_message(511, 0, target_system=1, target_component=193))
        )
        bench.run(0.2)
    assert wanted == {30, 32, 36, 108}  # ATTITUDE, LOCAL_POSITION_NED, SERVO_OUTPUT_RAW, and of simulators SIM_STATE
    assert bench.devices.streams.accepted == wanted


def test_the_dvl_agrees_with_the_motion_that_is_told():
    bench = Bench()
    bench.run(6.0, motion=(0.5, 3.14159265))  # astern: it looks south
    told = bench.said("VISION_POSITION_DELTA")
    assert len(told) == pytest.approx(30, abs=3)
    velocities = [one.position_delta[0] / (1e-6 * one.time_delta_usec) for one in told]
    assert sum(velocities) / len(velocities) == pytest.approx(-0.5, abs=0.01)
    assert {(one.get_srcSystem(), one.get_srcComponent()) for one in told} == {(255, 0)}
    of_dvl = [data for _, data in bench.devices.datagrams() if data[5] == 255]
    assert len(of_dvl) == len(told)  # the gateway hears them as well


def test_a_simulators_truth_goes_before_its_autopilots_estimate():
    bench = Bench()
    simulated = dict.fromkeys(dialect.MAVLink_sim_state_message.fieldnames, 0)
    for _ in range(100):
        bench.says(bench.autopilot.pack(dialect.MAVLink_sim_state_message(**{**simulated, "q1": 1.0, "vn": 1.0})))
        bench.run(2 * STEP_S, motion=(0.2, 0.0))
    velocities = [one.position_delta[0] / (1e-6 * one.time_delta_usec) for one in bench.said("VISION_POSITION_DELTA")]
    assert sum(velocities) / len(velocities) == pytest.approx(1.0, abs=0.01)


def test_sensors_say_nothing_while_nobody_tells_how_it_moves():
    bench = Bench()
    bench.run(2.0)
    assert bench.said("VISION_POSITION_DELTA") == []
    bench.run(2.0, motion=(0.5, 0.0))
    count = len(bench.said("VISION_POSITION_DELTA"))
    assert count > 5
    bench.run(5.0)
    assert len(bench.said("VISION_POSITION_DELTA")) <= count + 6  # of the second until it is no motion of now
    bench.run(1.0, motion=(0.5, 0.0))
    assert len(bench.said("VISION_POSITION_DELTA")) <= count + 12


def test_a_lying_dvl_lies_to_the_autopilot_as_well():
    bench = Bench({"at_s": 3.0, "subject": "dvl", "failure": "wrong", "value_mps": 0.0})
    bench.run(8.0, motion=(0.5, 0.0))
    velocities = [one.position_delta[0] / (1e-6 * one.time_delta_usec) for one in bench.said("VISION_POSITION_DELTA")]
    assert velocities[5] == pytest.approx(0.5, abs=0.05)
    assert set(velocities[-10:]) == {0.0}


def test_what_the_gateway_says_is_handed_on_and_noted_with_its_answer():
    bench = Bench()
    bench.run(1.0)
    gateway = MavlinkEncoder(1)
    text, command = StatusText(2, "T1 entangled?"), CommandLong(176, (1, 9, 0, 0, 0, 0, 0), 1)
    for message in (text, command):
        bench.devices.to_autopilot(bench.now_s, gateway.encode(message))
    assert bench.said("STATUSTEXT")[0].text == "T1 entangled?"
    acknowledged = dialect.MAVLink_command_ack_message(176, 0, target_system=1, target_component=192)
    bench.says(bench.autopilot.pack(acknowledged), bench.autopilot.heartbeat(base_mode=0xD1, custom_mode=9))
    notes = bench.devices.notes
    assert [one.text for one in notes.texts] == ["T1 entangled?"]
    assert [(one.command, one.result) for one in notes.commands] == [(176, Result.ACCEPTED)]
    assert [(one.mode, one.armed) for one in bench.devices.modes] == [("MANUAL", True), ("SURFACE", True)]
    assert isinstance(bench.devices.modes[0], ModeChange)


def test_garbage_from_the_autopilot_is_dropped_and_counted():
    bench = Bench()
    bench.says(b"\xfd" + bytes(300), bytes(range(256)), bench.autopilot.heartbeat())
    bench.run(1.0)
    assert bench.devices.drops.total() > 0
    assert bench.devices.modes


@pytest.mark.parametrize(
    "fault",
    [
        {"at_s": 1.0, "subject": "hull", "failure": "net"},
        {"at_s": 1.0, "subject": "water", "failure": "gust", "speed_mps": 0.5},
        {"at_s": 1.0, "subject": "autopilot", "failure": "reboot"},
    ],
)
def test_what_only_a_simulated_vehicle_can_have_is_refused(fault):
    with pytest.raises(ValueError, match="a real autopilot has a hull and water of its own"):
        Bench(fault)


@contextmanager
def autopilot_process(port: int, file: Path) -> Iterator[subprocess.Popen[bytes]]:
    words = [sys.executable, "-m", "hil_tests.playback.tests.autopilot_process", str(port), str(file)]
    process = subprocess.Popen(words, stdin=subprocess.PIPE)
    try:
        yield process
    finally:
        process.stdin.close()
        process.wait(WAIT_S)


async def played(devices: AttachedDevices, clock: Clock, until: Callable[[Counter[str]], bool]) -> Counter[str]:
    """As a session plays it; what was heard on the bus."""
    config = parse(PROFILE.gateway_toml(), PROFILE.folder)
    decoder = can_decoder(config.can[0], config.thruster)
    heard: Counter[str] = Counter()
    async with asyncio.timeout(WAIT_S):
        while not until(heard):
            await asyncio.sleep(STEP_S)
            devices.advance(clock.now())
            commands = devices.sent_by_autopilot()
            devices.to_devices(commands)
            for frame in [*commands, *devices.sent_by_devices()]:
                for reading in decoder.decode(frame):
                    turns = isinstance(reading, ThrusterReport) and abs(reading.speed_rpm or 0.0) > 100.0
                    heard["turning"] += turns
                    heard["commands"] += isinstance(reading, ThrusterCommand) and reading.fraction != 0.0
            heard["datagrams"] += len(devices.datagrams())
    assert not decoder.drops
    return heard


async def test_an_autopilot_in_another_process_is_served(tmp_path):
    """With MAVProxy in between, where it is installed: a peer that shares no code with either."""
    port, file, between = free_port(), tmp_path / "told.json", program().exists()
    master = free_port() if between else port
    clock, scenario = Clock(), Scenario(duration_s=60.0)
    async with attached(scenario, PROFILE, clock, f"udpin:{HOST}:{port}") as devices, AsyncExitStack() as around:
        around.enter_context(autopilot_process(master, file))
        if between:
            around.enter_context(GroundStation(tmp_path, f"udpin:{HOST}:{master}", [f"udpout:{HOST}:{port}"]))
        heard = await played(devices, clock, lambda heard: _served(devices, heard))
    told = json.loads(file.read_text())
    assert told["heard"]["VISION_POSITION_DELTA 255/0"] > 5
    assert devices.streams.accepted >= {30, 32, 36}
    assert told["forward_mps"] > 0.1  # its own hull moves by its own thrusters
    assert heard["commands"] > 20
    assert not devices.drops


def _served(devices: AttachedDevices, heard: Counter[str]) -> bool:
    return heard["turning"] > 100 and {30, 32, 36} <= devices.streams.accepted and heard["datagrams"] > 100

"""The main job, whole: recorded thrusters on a real bus, `gateway run` as its own process, an autopilot listening."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from math import inf
from pathlib import Path

import can
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.frame import CanFrame
from hil_tests.loopback import free_port
from hil_tests.playback.player import play
from hil_tests.playback.recordings import read_esc_bench, read_ngs_tank
from hil_tests.playback.series import chained
from hil_tests.playback.traffic import FIRST_ESC_NODE, dronecan_traffic
from hil_tests.vcan.interface import INTERFACE

DATA = Path(__file__).parents[3] / "shared" / "data"
pytestmark = [
    pytest.mark.vcan,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"no recorded data: {DATA} is absent"),
]

RATE_HZ = 12.5  # every second sample of the tank; an emulated machine cannot judge two thrusters at 25 Hz
SPEED_FACTOR = 0.75  # of a thruster that has caught something
# When the faults show, from the start of the play: in the fifth run of the tank; on the bench at a command that was
# held once before.
TANK_FAULT_S, BENCH_FAULT_S = 49.5, 62.5
BENCH_NODE, TANK_NODE = FIRST_ESC_NODE, FIRST_ESC_NODE + 1
FAULTS_S = {BENCH_NODE: BENCH_FAULT_S, TANK_NODE: TANK_FAULT_S}
BENCH_START_S, BENCH_END_S = 40.0, 104.5  # of the recording
TANK_PAUSE_S = 2.0

START_TIMEOUT_S = 300.0  # an emulated machine takes a minute to import numpy and scipy
STOP_TIMEOUT_S = 120.0
FOUND_WITHIN_S = 1.0  # by the times at which the frames arrived: how fast the machine is does not count
TOLD_WITHIN_S = (
    10.0  # an emulated machine may be a second behind when it is busy; real ones: `gateway bench supervisor`
)

CONFIG = """
[vehicle]
name = "two recorded thrusters"

[[can]]
name = "can0"
channel = "{interface}"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:{port}"

[[thruster]]
number = 1
name = "motor on the bench"
command = {{ link = "can0", esc_index = 0 }}
rpm = {{ link = "can0", esc_index = 0 }}

[[thruster]]
number = 2
name = "thruster in the tank"
command = {{ link = "can0", esc_index = 1 }}
rpm = {{ link = "can0", esc_index = 1, signed = false }}

[align]
sample_rate_hz = {rate_hz}

[detector.thruster]
# counted in samples, which are 80 ms here; the default search would take an emulated machine half a second
delay_max = 4
lag_max = 4.0
order_max = 3

[supervisor]
silent_s = 5.0  # between two runs, the tank is silent
"""


def recorded_traffic() -> list[CanFrame]:
    """A motor on a bench as ESC 0, a thruster in a tank as ESC 1, each with its fault."""
    bench = read_esc_bench(DATA / "esc_bench" / "f40_steps_5-2.csv").part(BENCH_START_S, BENCH_END_S)
    runs = read_ngs_tank(DATA / "ngs_tank" / "closed_loop_runs.csv")
    tank = chained(
        [run for name, run in runs.items() if name.startswith("CL2") and name.endswith("Sine")], TANK_PAUSE_S
    )
    return dronecan_traffic(
        {
            0: bench.thinned(RATE_HZ).with_speed_scaled(SPEED_FACTOR, BENCH_FAULT_S),
            1: tank.part(0.0, bench.duration_s).thinned(RATE_HZ).with_speed_scaled(SPEED_FACTOR, TANK_FAULT_S),
        }
    )


class Autopilot:
    """pymavlink on loopback UDP: says once a second that it is an armed ArduSub, and notes what it is told.

    It refuses all streams: the thrusters are all on the CAN bus, and an emulated machine has no time to spare.
    """

    def __init__(self, port: int) -> None:
        self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._link.bind(("127.0.0.1", 0))
        self._gateway = ("127.0.0.1", port)
        self._codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._codec.robust_parsing = True
        self._heartbeat_s = -inf
        self.states: list[int] = []
        self.texts: list[tuple[float, int, str]] = []  # time of arrival, severity, text

    def __enter__(self) -> Autopilot:
        return self

    def __exit__(self, *_: object) -> None:
        self._link.close()

    def troubles(self) -> set[str]:
        """Of whom it was told something grave: the first three letters."""
        return {text[:3] for _, severity, text in self.texts if severity <= mavlink.MAV_SEVERITY_WARNING}

    def listen_until(self, condition, timeout_s: float) -> None:
        deadline_s = time.monotonic() + timeout_s
        while not condition():
            now_s = time.monotonic()
            assert now_s < deadline_s, f"not within {timeout_s} s; told: {self.states}, {self.texts}"
            if now_s >= self._heartbeat_s + 1.0:
                self._heartbeat_s = now_s
                self._send_heartbeat()
            self._receive()

    def _send_heartbeat(self) -> None:
        armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED | mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        heartbeat = mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_SUBMARINE, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, 19, mavlink.MAV_STATE_ACTIVE, 3
        )
        with suppress(ConnectionRefusedError):  # of the datagram before: the gateway is not there yet
            self._link.sendto(heartbeat.pack(self._codec), self._gateway)

    def _receive(self) -> None:
        self._link.settimeout(0.05)
        try:
            data = self._link.recv(4096)
        except (TimeoutError, ConnectionRefusedError):
            return
        now_s = time.monotonic()
        for message in self._codec.parse_buffer(data) or []:
            if message.get_type() == "STATUSTEXT":
                self.texts.append((now_s, message.severity, message.text))
            elif message.get_type() == "HEARTBEAT":
                self.states.append(message.system_status)
            elif message.get_type() == "COMMAND_LONG":
                refusal = mavlink.MAVLink_command_ack_message(message.command, mavlink.MAV_RESULT_DENIED)
                self._link.sendto(refusal.pack(self._codec), self._gateway)


class Player:
    """Plays frames in a thread, and notes when a fault first showed on the bus.

    Args:
        bus: to play onto.
        faults_s: when the fault shows in the frames of a node.
    """

    def __init__(self, bus: can.BusABC, frames: list[CanFrame], faults_s: dict[int, float]) -> None:
        self._bus = bus
        self._faults_s = faults_s
        self._thread = threading.Thread(target=play, args=(frames, self._send), daemon=True)
        self.shown_s: dict[int, float] = {}  # on the clock that stamps the frames

    def start(self) -> None:
        self._thread.start()

    def ended(self) -> bool:
        return not self._thread.is_alive()

    def _send(self, frame: CanFrame) -> None:
        node = frame.identifier & 0x7F
        if frame.time_s >= self._faults_s.get(node, inf):
            self.shown_s.setdefault(node, time.time())
        self._bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data))


@contextmanager
def running_gateway(folder: Path, port: int):
    (folder / "config.toml").write_text(CONFIG.format(interface=INTERFACE, port=port, rate_hz=RATE_HZ))
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(
            [Path(sys.executable).with_name("gateway"), "run", folder / "config.toml"], stderr=log
        )
        try:
            yield process
        finally:
            process.kill()
            process.wait()
            print((folder / "log").read_text())


def test_a_fault_in_recorded_rpm_is_found_within_a_second_and_told_to_the_autopilot(tmp_path):
    frames, port = recorded_traffic(), free_port()
    with (
        running_gateway(tmp_path, port) as gateway,
        can.Bus(INTERFACE, "socketcan") as bus,
        Autopilot(port) as autopilot,
    ):
        player = Player(bus, frames, FAULTS_S)
        autopilot.listen_until(lambda: autopilot.states or gateway.poll() is not None, START_TIMEOUT_S)
        player.start()
        autopilot.listen_until(player.ended, 2.0 * frames[-1].time_s)
        end_s = time.monotonic() + TOLD_WITHIN_S
        autopilot.listen_until(
            lambda: {"T1 ", "T2 "} <= autopilot.troubles() or time.monotonic() > end_s, 2.0 * TOLD_WITHIN_S
        )
        gateway.send_signal(signal.SIGTERM)
        assert gateway.wait(STOP_TIMEOUT_S) == 0

    # that it is too busy, the gateway may say of an emulated machine
    assert autopilot.troubles() - {"Gat"} == {"T1 ", "T2 "}
    assert autopilot.states[0] in (mavlink.MAV_STATE_BOOT, mavlink.MAV_STATE_ACTIVE)
    assert autopilot.states[-1] == mavlink.MAV_STATE_CRITICAL
    findings = [json.loads(line) for line in (tmp_path / "findings.jsonl").read_text().splitlines()]
    faults_s = {finding["subject"]: finding["time_s"] for finding in findings if finding["level"] == "FAULT"}
    assert set(faults_s) == {"thruster 1", "thruster 2"}
    for node, subject in ((BENCH_NODE, "thruster 1"), (TANK_NODE, "thruster 2")):
        after_s = faults_s[subject] - player.shown_s[node]
        print(f"{subject} found {after_s:.2f} s after it showed")
        assert 0.0 < after_s <= FOUND_WITHIN_S

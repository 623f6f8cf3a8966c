"""A vehicle on the loopback for the running gateway to watch: a CAN bus and an autopilot."""

import asyncio
import contextlib
import math
import socket
import time
from collections.abc import AsyncIterator

import can
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from gateway.tests.conftest import FULL_RPM

PERIOD_S = 0.02


class Vehicle:
    """Two thrusters on a virtual CAN bus, and an armed ArduSub over UDP that accepts every command."""

    def __init__(self, port: int) -> None:
        self.share = 1.0  # of its speed that thruster 2 still reaches
        self.speed_mps = 1.0  # to the north
        self.mode = 19  # MANUAL
        self._north_m, self._moved_s, self._start_s = 0.0, time.monotonic(), time.monotonic()
        self.bus = can.Bus(interface="virtual", channel="gateway tests")
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.gateway = ("127.0.0.1", port)
        self.mavlink = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self.texts: list[tuple[int, str]] = []
        self.states: list[int] = []
        self.commands: list[tuple[int, float, float]] = []

    async def live(self) -> None:
        """One step each 20 ms until it is cancelled."""
        n = 0
        try:
            while True:
                self.step(n)
                n += 1
                await asyncio.sleep(PERIOD_S)
        finally:
            self.bus.shutdown()
            self.socket.close()

    def step(self, n: int) -> None:
        fraction = 0.5 + 0.2 * math.sin(0.02 * n)
        command = round(8191 * fraction)
        frames = encode_raw_command([command, command], 10, n % 32)
        for index, share in enumerate((1.0, self.share)):
            status = EscStatus(0, 16.0, 3.0, 300.0, round(share * FULL_RPM * fraction), 50, index)
            frames += encode_esc_status(status, 20 + index, n % 32)
        for frame in frames:
            self.bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=True))
        pulses = [1500] * 8
        pulses[2] = round(1500 + 400 * fraction)
        self.send(dialect.MAVLink_servo_output_raw_message(n * 20_000 + 1, 0, *pulses, *[0] * 8))
        if n % 5 == 0:
            self.move()
        if n % 10 == 0:
            self.send(dialect.MAVLink_heartbeat_message(12, 3, 0x81, self.mode, 4, 3))
        self.receive()

    def move(self) -> None:
        now_s = time.monotonic()
        self._north_m += self.speed_mps * (now_s - self._moved_s)
        self._moved_s, boot_ms = now_s, round(1000.0 * (now_s - self._start_s)) + 1
        self.send(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
        self.send(dialect.MAVLink_local_position_ned_message(boot_ms, self._north_m, 0.0, 5.0, 1.0, 0.0, 0.0))

    def send(self, message: dialect.MAVLink_message) -> None:
        self.socket.sendto(message.pack(self.mavlink), self.gateway)
        self.mavlink.seq = (self.mavlink.seq + 1) % 256

    def receive(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                for message in self.mavlink.parse_buffer(self.socket.recv(2048)) or []:
                    self.take(message)

    def take(self, message: dialect.MAVLink_message) -> None:
        assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 192)
        match message.get_type():
            case "STATUSTEXT":
                self.texts.append((message.severity, message.text))
            case "HEARTBEAT":
                self.states.append(message.system_status)
            case "COMMAND_LONG":
                self.commands.append((message.command, message.param1, message.param2))
                if message.command == dialect.MAV_CMD_DO_SET_MODE:
                    self.mode = int(message.param2)
                self.send(dialect.MAVLink_command_ack_message(message.command, 0))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def until(condition, seconds: float = 10.0) -> None:
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110  what is awaited is another program's doing
            await asyncio.sleep(0.02)


@contextlib.asynccontextmanager
async def vehicle(port: int) -> AsyncIterator[Vehicle]:
    simulated = Vehicle(port)
    task = asyncio.create_task(simulated.live())
    try:
        yield simulated
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task

"""Made-up dives as logs: a healthy second thruster, and a first one that something holds back for a while."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import cantools
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.frame import CanFrame
from drivers.can.vesc_messages import Status, encode_command
from drivers.mavlink.tests.peer import Peer
from gateway.tests.conftest import FULL_RPM

START_S = 1_700_000_000.0
RATE_HZ = 50
HELD_S, HELD_SHARE = (10.0, 16.0), 0.5  # the first thruster
SILENT_S = (20.0, 22.5)  # the second one's ESC
POLE_PAIRS = 7

CAN = """
[vehicle]
name = "Test vehicle"

[[can]]
name = "can0"
interface = "virtual"
channel = "can0"
"""
THRUSTERS = """
[[thruster]]
number = 1
down = 1
command = {{ link = "can0", {command[0]} }}
rpm = {{ link = "can0", {rpm[0]} }}

[[thruster]]
number = 2
down = 1
command = {{ link = "can0", {command[1]} }}
rpm = {{ link = "can0", {rpm[1]} }}

[align]
sample_rate_hz = 50
"""
MAVLINK = '\n[mavlink]\nendpoint = "udpin:127.0.0.1:0"\n'


def said_s(period_s: float, thruster: int) -> float:
    """When a thruster's speed is said, in whole microseconds as logs have it: elsewhere a float may end otherwise."""
    return round(period_s + 0.002 * thruster, 6)


def fraction(time_s: float) -> float:
    """Of both commands, never far below a half; it does not repeat itself."""
    return 0.6 + 0.1 * math.sin(0.4 * time_s) + 0.06 * math.sin(0.9 * time_s + 1.0) + 0.05 * math.sin(1.7 * time_s)


def jerky(time_s: float) -> float:
    """A command of a pilot who moves the stick now and then, each time elsewhere."""
    chance = random.Random(int(time_s / 1.3))
    return chance.choice((0.3, 0.4, 0.5, 0.6, 0.7))


Command = Callable[[float], float]
Moment = tuple[int, float, float, list[tuple[int, float]]]


def moments(seconds: float, command: Command = fraction) -> Iterator[Moment]:
    """Number and time of each period, the command, and the speeds by thruster, in their order."""
    for n in range(round(seconds * RATE_HZ)):
        time_s = n / RATE_HZ
        share = HELD_SHARE if HELD_S[0] <= time_s < HELD_S[1] else 1.0
        speeds = [(1, share * FULL_RPM * command(time_s)), (2, FULL_RPM * command(time_s))]
        silent = SILENT_S[0] <= time_s < SILENT_S[1]
        yield n, round(START_S + time_s, 6), command(time_s), speeds[:1] if silent else speeds


def dronecan(seconds: float, command: Command = fraction) -> Iterator[CanFrame]:
    for n, time_s, share, speeds in moments(seconds, command):
        yield from encode_raw_command([round(8191 * share)] * 2, 10, n % 32, time_s=time_s)
        for number, rpm in speeds:
            status = EscStatus(0, 16.0, 3.0, 300.0, round(rpm), 50, number - 1)
            yield from encode_esc_status(status, 20 + number, n % 32, time_s=said_s(time_s, number))


def vesc(seconds: float) -> Iterator[CanFrame]:
    for _, time_s, command, speeds in moments(seconds):
        for controller in (10, 11):
            yield encode_command("duty", command, controller, time_s)
        for number, rpm in speeds:
            yield Status(POLE_PAIRS * rpm, 3.0, command).frame(9 + number, said_s(time_s, number))


def dbc(seconds: float) -> Iterator[CanFrame]:
    database = cantools.database.load_file(VENDOR)
    names = {1: ("PortStatus", "PulseRate", POLE_PAIRS / 60.0), 2: ("StarboardStatus", "Speed", 1.0)}

    def frame(name: str, time_s: float, **values: float) -> CanFrame:
        message = database.get_message_by_name(name)
        return CanFrame(time_s, message.frame_id, bytes(message.encode(values, strict=False)), extended=False)

    for _, time_s, command, speeds in moments(seconds):
        yield frame("PortCommand", time_s, Pulse=1500 + 400 * command)
        yield frame("StarboardCommand", time_s, Percent=100 * command)
        for number, rpm in speeds:
            name, signal, factor = names[number]
            yield frame(name, said_s(time_s, number), **{signal: factor * rpm, "Voltage": 16.0, "Current": 3.0})


VENDOR = Path(__file__).parents[1] / "examples" / "vendor_thruster.dbc"
BUSES = {
    "dronecan": (
        dronecan,
        'protocol = "dronecan"',
        ("esc_index = 0", "esc_index = 1"),
        ("esc_index = 0", "esc_index = 1"),
    ),
    "vesc": (
        vesc,
        'protocol = "vesc"',
        tuple(f'controller_id = {one}, control = "duty", maximum = 1.0' for one in (10, 11)),
        tuple(f"controller_id = {one}, pole_pairs = {POLE_PAIRS}" for one in (10, 11)),
    ),
    "dbc": (
        dbc,
        f'protocol = "dbc"\ndatabase = "{VENDOR}"',
        (
            'signal = "PortCommand.Pulse", minimum = 1100, neutral = 1500, maximum = 1900',
            'signal = "StarboardCommand.Percent", minimum = -100, neutral = 0, maximum = 100',
        ),
        (
            f'signal = "PortStatus.PulseRate", unit = "pulses_per_s", pole_pairs = {POLE_PAIRS}, signed = false',
            'signal = "StarboardStatus.Speed", unit = "rpm"',
        ),
    ),
}


def settings(protocol: str) -> str:
    """A configuration of two thrusters on one bus."""
    _, bus, command, rpm = BUSES[protocol]
    return CAN + bus + "\n" + THRUSTERS.format(command=command, rpm=rpm)


def candump_line(frame: CanFrame, interface: str = "can0") -> str:
    """As `candump -l` writes it."""
    identifier = frame.identifier | (0x2000_0000 if frame.error else 0)
    word = f"{identifier:08X}" if frame.extended or frame.error else f"{identifier:03X}"
    return f"({frame.time_s:.6f}) {interface} {word}#{frame.data.hex().upper()}\n"


def write_candump(path: Path, frames: Iterable[CanFrame], interface: str = "can0") -> Path:
    path.write_text("".join(candump_line(frame, interface) for frame in frames), encoding="ascii")
    return path


def telemetry(seconds: float, ahead_s: float = 0.0, command: Command = fraction) -> Iterator[tuple[float, Any]]:
    """What an autopilot says of the same dive, by a clock that is ahead by so much."""
    for n, time_s, share, speeds in moments(seconds, command):
        boot_ms = 60_000 + 20 * n
        pulses = [round(1500 + 400 * share)] * 2 + [0] * 14
        yield time_s + ahead_s, dialect.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *pulses)
        rpm = [round(dict(speeds).get(number, 0.0)) for number in (1, 2)] + [0, 0]
        yield (
            time_s + ahead_s + 0.002,
            dialect.MAVLink_esc_telemetry_1_to_4_message(
                [20] * 4, [1600] * 4, [300] * 4, [0] * 4, rpm, [n % 65536] * 4
            ),
        )
        if n % RATE_HZ == 0:
            yield time_s + ahead_s, dialect.MAVLink_heartbeat_message(12, 3, 0xD1, 19, 4, 3)
        if n % 5 == 0:
            roll = 0.2 * math.sin(0.7 * n / RATE_HZ)
            yield time_s + ahead_s, dialect.MAVLink_attitude_message(boot_ms, roll, 0.1, 0.3, 0.0, 0.0, 0.0)


def tlog_record(time_s: float, packet: bytes) -> bytes:
    return struct.pack(">Q", round(time_s * 1e6)) + packet


def write_tlog(path: Path, messages: Iterable[tuple[float, Any]]) -> Path:
    autopilot = Peer()
    path.write_bytes(b"".join(tlog_record(time_s, autopilot.pack(message)) for time_s, message in messages))
    return path

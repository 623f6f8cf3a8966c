"""A long healthy dive as a candump log and a MAVLink log, written fast: what `gateway bench replay` replays."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from scipy.signal import lfilter

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.dronecan.setpoints import COMMAND_MAX
from drivers.can.frame import CanFrame
from hil_tests.playback.traffic import AUTOPILOT_NODE, FIRST_ESC_NODE

FloatArray: TypeAlias = NDArray[np.float64]

START_S = 1_700_000_000
THRUSTERS, RATE_HZ = 8, 50
# The bus is made for so long and then repeated: it begins and ends in the same steady state.
PERIOD_S, STEADY_S = 360, 6
AHEAD = 4  # thrusters: they cruise, the others hold depth and attitude
CRUISE, CRUISE_SPREAD, HOLD_SPREAD = 0.5, 0.03, 0.8
DELAY, LAG = 3, 2.5  # samples
FULL_RPM, NOISE_RPM = 3000.0, 3.0
SPEED_MPS, CURRENT_MPS = 1.0, 0.2

CONFIG = """
[vehicle]
name = "benchmark"

[[can]]
name = "can0"
channel = "can0"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:14660"

[speed]
minimum_mps = 0.8
maximum_mps = 1.2
"""
THRUSTER = """
[[thruster]]
number = {number}
{direction} = 1.0
command = {{ link = "can0", esc_index = {esc_index} }}
rpm = {{ link = "can0", esc_index = {esc_index} }}
"""


def write_config(path: Path) -> None:
    """Four thrusters drive the vehicle ahead, four hold it down; its speed and its thrusters are watched."""
    thrusters = (
        THRUSTER.format(number=n + 1, esc_index=n, direction="ahead" if n < AHEAD else "down")
        for n in range(THRUSTERS)
    )
    path.write_text(CONFIG + "".join(thrusters), encoding="utf-8")


def write_candump(path: Path, seconds: int) -> int:
    """esc.RawCommand and esc.Status of all thrusters; returns the number of frames."""
    period = [(frame.time_s, f" can0 {frame.identifier:08X}#{frame.data.hex().upper()}\n") for frame in _bus()]
    frames = 0
    with path.open("w", encoding="ascii") as file:
        for begin_s in range(0, seconds, PERIOD_S):
            lines = [
                f"({START_S + begin_s + time_s:.6f}){text}" for time_s, text in period if begin_s + time_s < seconds
            ]
            file.writelines(lines)
            frames += len(lines)
    return frames


def _bus() -> Iterator[CanFrame]:
    """One RawCommand for all, and a Status of each, at the rate; 1350 frames a second."""
    command, speed_rpm = zip(*(_thruster(number) for number in range(THRUSTERS)), strict=True)
    for tick in range(PERIOD_S * RATE_HZ):
        time_s, transfer = tick / RATE_HZ, tick % 32
        raw = [round(COMMAND_MAX * float(one[tick])) for one in command]
        yield from encode_raw_command(raw, AUTOPILOT_NODE, transfer, time_s=time_s)
        for number, rpm in enumerate(speed_rpm):
            status = EscStatus(0, 16.0, 10.0 * abs(float(command[number][tick])), 300.0, round(rpm[tick]), 0, number)
            yield from encode_esc_status(
                status, FIRST_ESC_NODE + number, transfer, time_s=time_s + 0.001 * (number + 1)
            )


def _thruster(number: int) -> tuple[FloatArray, FloatArray]:
    """Command and speed of a healthy one: commanded at random; a power law after a delay and a lag, and noise."""
    chance = np.random.default_rng(number)
    samples = PERIOD_S * RATE_HZ
    holds = chance.integers(RATE_HZ, 10 * RATE_HZ, samples // RATE_HZ)
    mean, spread = (CRUISE, CRUISE_SPREAD) if number < AHEAD else (0.0, HOLD_SPREAD)
    command = mean + np.repeat(chance.uniform(-spread, spread, len(holds)), holds)[:samples]
    command[: STEADY_S * RATE_HZ] = command[-STEADY_S * RATE_HZ :] = mean
    steady = FULL_RPM * np.sign(command) * np.abs(command) ** 0.8
    kept = math.exp(-1.0 / LAG)
    delayed = np.concatenate([np.full(DELAY, steady[0]), steady[:-DELAY]]) - steady[0]
    lagged = steady[0] + lfilter([1.0 - kept], [1.0, -kept], delayed)
    return command, lagged + chance.normal(0.0, NOISE_RPM, samples)


def write_tlog(path: Path, seconds: int) -> int:
    """An autopilot's telemetry, 100 messages a second; returns their number."""
    autopilot = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    messages = 0
    with path.open("wb") as file:
        for tick in range(20 * seconds):
            for message in _telemetry(tick):
                file.write(struct.pack(">Q", START_S * 1_000_000 + tick * 50_000 + 1000))
                file.write(message.pack(autopilot))
                autopilot.seq = (autopilot.seq + 1) % 256
                messages += 1
    return messages


def _telemetry(tick: int) -> Iterator[Any]:
    """Twenty times a second five messages, in turn those that the gateway wants and those that it does not."""
    boot_ms, turn_rad = 60_000 + 50 * tick, 0.02
    time_s = 0.05 * tick
    heading_rad = turn_rad * time_s
    north_m = SPEED_MPS * math.sin(heading_rad) / turn_rad + CURRENT_MPS * time_s
    east_m = SPEED_MPS * (1.0 - math.cos(heading_rad)) / turn_rad
    velocity = SPEED_MPS * math.cos(heading_rad) + CURRENT_MPS, SPEED_MPS * math.sin(heading_rad), 0.0
    yaw_rad = math.remainder(heading_rad, math.tau)
    yield mavlink.MAVLink_attitude_message(boot_ms, 0.01, 0.02, yaw_rad, 0.0, 0.0, turn_rad)
    yield mavlink.MAVLink_servo_output_raw_message(1000 * boot_ms % (1 << 32), 0, *[1500] * 8, *[0] * 8)
    yield mavlink.MAVLink_raw_imu_message(1000 * boot_ms, 0, 0, -1000, 0, 0, 0, 0, 0, 0)
    yield mavlink.MAVLink_vfr_hud_message(1.0, 1.0, 0, 50, -10.0, 0.0)
    match tick % 20:
        case 0:
            yield mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_SUBMARINE, 3, 0xD1, 19, 4, 3)
        case 1:
            yield mavlink.MAVLink_sys_status_message(0, 0, 0, 500, 16000, 100, 80, 0, 0, 0, 0, 0, 0)
        case even if even % 2 == 0:
            yield mavlink.MAVLink_local_position_ned_message(boot_ms, north_m, east_m, 10.0, *velocity)
        case _:
            yield mavlink.MAVLink_named_value_float_message(boot_ms, b"PilotGain", 0.5)

"""How long a verdict takes until its text is bytes on the socket: in the running gateway, and with nothing between.

The gateway is `gateway.run`, with its threads and its link, over UDP on the loopback; only the detectors are
stand-ins, of which one changes its mind at known instants. The text names the change. It is stamped by the kernel
that delivers it, by the same clock as its verdict, so how quickly anybody reads it plays no part.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gateway.config import Config, parse
from gateway.pipeline import Factories
from gateway.run import run
from hil_tests.bench.timed_detector import CHANGE_S, SPEED_RPM, WANTED_RPM, TimedDetectors
from hil_tests.bench.timed_vehicle import RATE_HZ, TimedVehicle
from hil_tests.live.stamped_socket import received, stamping_socket
from hil_tests.loopback import free_port

FloatArray = NDArray[np.float64]

WARM_UP = 4  # changes
THRUSTERS = 8
BARE_PAUSE_S = 0.005  # no queue, no warm caches

CONFIGURATION = """
[vehicle]
name = "Timed"

[mavlink]
endpoint = "udpin:127.0.0.1:{port}"

[align]
sample_rate_hz = {rate_hz}

[supervisor]
suspect_after_s = 0.0
clear_after_s = 0.0
texts_per_minute = 600.0
"""
THRUSTER = """
[[thruster]]
number = {number}
command = {{ link = "mavlink", servo_channel = {number} }}
rpm = {{ link = "mavlink", esc_index = {esc} }}
"""


@dataclass(frozen=True, slots=True)
class Latency:
    """Milliseconds, of so many texts."""

    what: str
    texts: int
    median_ms: float
    p99_ms: float
    max_ms: float


def latencies(changes: int) -> list[Latency]:
    """Both ways, one after the other."""
    with TemporaryDirectory() as folder:
        from_sample_ms, from_verdict_ms = asyncio.run(_through_the_gateway(Path(folder), changes))
    return [
        _summary("gateway, from the sample's time", from_sample_ms),
        _summary("gateway, from the verdict", from_verdict_ms),
        _summary("bare pymavlink and sendto", _bare(changes)),
    ]


def _summary(what: str, taken_ms: FloatArray) -> Latency:
    median_ms, p99_ms, max_ms = np.percentile(taken_ms, [50.0, 99.0, 100.0]).tolist()
    return Latency(what, len(taken_ms), median_ms, p99_ms, max_ms)


async def _through_the_gateway(folder: Path, changes: int) -> tuple[FloatArray, FloatArray]:
    """Milliseconds from the samples' times, and from the verdicts, to the texts."""
    logging.getLogger("gateway").propagate = False  # it writes, and nobody reads
    logging.getLogger("gateway").addHandler(logging.NullHandler())
    port = free_port()
    detectors, vehicle, stop = TimedDetectors(), TimedVehicle(("127.0.0.1", port)), asyncio.Event()
    vehicle.start()
    running = asyncio.create_task(
        run(_configuration(folder, port), stop=stop, factories=Factories(thruster=detectors.make))
    )
    await asyncio.wait([running], timeout=(changes + WARM_UP + 2) * CHANGE_S)
    stop.set()
    await running
    vehicle.stop()
    timed = detectors.made[0]
    told = [number for number in sorted(vehicle.texts) if number >= WARM_UP and number in timed.said_ns]
    arrived_ns = np.array([vehicle.texts[number] for number in told], dtype=np.float64)
    sample_ns = np.array([timed.sample_s[number] for number in told]) * 1e9
    said_ns = np.array([timed.said_ns[number] for number in told], dtype=np.float64)
    return (arrived_ns - sample_ns) / 1e6, (arrived_ns - said_ns) / 1e6


def _configuration(folder: Path, port: int) -> Config:
    text = CONFIGURATION.format(port=port, rate_hz=RATE_HZ)
    text += "".join(THRUSTER.format(number=number, esc=number - 1) for number in range(1, THRUSTERS + 1))
    return parse(text, folder)


def _bare(texts: int) -> FloatArray:
    """Milliseconds from knowing what to say until it is on the socket, in a loop that does nothing else."""
    encoder = mavlink.MAVLink(None, srcSystem=1, srcComponent=192)
    taken_ns = []
    with stamping_socket() as receiver, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(texts):
            time.sleep(BARE_PAUSE_S)
            said_ns = time.time_ns()
            text = f"T1 entangled? {SPEED_RPM} rpm, want {WANTED_RPM + number}"
            sender.sendto(mavlink.MAVLink_statustext_message(2, text.encode()).pack(encoder), receiver.getsockname())
            time.sleep(BARE_PAUSE_S)
            taken_ns += [stamp_ns - said_ns for _, stamp_ns in received(receiver)]
    return np.array(taken_ns) / 1e6

"""Two full buses for the recorder: frames, what is decoded of them, verdicts, and a busy MAVLink link."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import nan

import numpy as np

from detectors.thruster import ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster, EscStatus, encode_esc_status
from drivers.can.frame_block import FrameBlock
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.messages import NamedValue
from drivers.readings import Reading
from gateway.channel import ThrusterJudgement
from hil_tests.bench.decoding import packed, unpacked

BUSES = ("can0", "can1")
FRAMES_PER_STATUS, ESCS = 3, 4
BUS_HZ = 7500  # frames/s on each: what 1 Mbit/s carries
MOMENT_S = 0.01  # from one look at the sockets to the next
STATUSES = round(BUS_HZ * MOMENT_S) // FRAMES_PER_STATUS
JUDGED_EVERY = 2  # moments: samples at 50 Hz
MAVLINK_PER_MOMENT = 3


@dataclass(frozen=True, slots=True)
class Moment:
    """What comes at once. `frames`, `readings`: of each bus."""

    time_s: float
    frames: tuple[FrameBlock, ...]
    readings: tuple[list[Reading], ...]
    packets: tuple[bytes, ...]
    judgements: tuple[ThrusterJudgement, ...]


def traffic(seconds: float, begin_s: float) -> Iterator[Moment]:
    """Moment after moment."""
    decoders = [
        DroneCanDecoder([DroneCanThruster(thruster=one + 1 + ESCS * bus, esc_index=one) for one in range(ESCS)])
        for bus in range(len(BUSES))
    ]
    encoder = MavlinkEncoder(1, 25)
    for number in range(round(seconds / MOMENT_S)):
        time_s = begin_s + number * MOMENT_S
        frames = tuple(_frames(number, bus, time_s) for bus in range(len(BUSES)))
        readings = tuple(one.decode_block(block).readings() for one, block in zip(decoders, frames, strict=True))
        packets = tuple(
            encoder.encode(NamedValue(f"value{one}", 0.1 * number, time_s - begin_s), time_s)
            for one in range(MAVLINK_PER_MOMENT)
        )
        judged = _judgements(number, time_s) if number % JUDGED_EVERY == 0 else ()
        yield Moment(time_s, frames, readings, packets, judged)


def _frames(moment: int, bus: int, time_s: float) -> FrameBlock:
    block = unpacked(
        packed(
            frame
            for one in range(STATUSES)
            for frame in encode_esc_status(
                _status(moment * STATUSES + one), 11 + (moment * STATUSES + one) % ESCS, _transfer(moment, one)
            )
        ),
        1.0 / BUS_HZ,
    )
    return FrameBlock(block.time_s + time_s + 1e-5 * bus, block.identifier, block.kind, block.length, block.data)


def _transfer(moment: int, one: int) -> int:
    """Number of a transfer: of each ESC one more than the last."""
    return (moment * STATUSES + one) // ESCS % 32


def _status(number: int) -> EscStatus:
    speed_rpm = 900 + 40 * (number % 23)
    return EscStatus(0, 15.5 + 0.01 * (number % 31), 0.25 * (number % 17), 300.0, speed_rpm, 40, number % ESCS)


def _judgements(moment: int, time_s: float) -> tuple[ThrusterJudgement, ...]:
    random = np.random.default_rng(moment)
    return tuple(
        ThrusterJudgement(
            number,
            ThrusterSample(time_s, 0.4, 1200.0 + float(random.normal(0.0, 3.0)), 15.5, 3.0),
            ThrusterVerdict(
                time_s=time_s, level=Level.NORMAL, score=float(random.uniform(0.0, 0.3)),
                residual_rpm=float(random.normal(0.0, 3.0)), predicted_rpm=1200.0, threshold_rpm=42.0,
                order=3, window=700, delay=2, lag_s=0.08, refitted=False, wear=nan,
            ),
        )
        for number in range(1, 1 + ESCS * len(BUSES))
    )  # fmt: skip

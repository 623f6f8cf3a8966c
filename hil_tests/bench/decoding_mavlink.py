"""MAVLink: bytes and logs to readings by our decoder, and to message objects by others.

The peers stop at their message objects, or at columns of all that was said; ours go on to readings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from itertools import accumulate, pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.command import CommandScale
from drivers.logs.damage import DamageReport
from drivers.logs.tlog import read_tlog
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.readings import Attitude, Reading, ThrusterCommand
from hil_tests.bench.autopilot_stream import ESCS, SERVOS, packets
from hil_tests.bench.timing import Comparison

STREAM_S, LOG_S = 20.0, 120.0
READ_BYTES = 512  # of a serial line or TCP at a time, on average
PULSES = CommandScale(1100.0, 1500.0, 1900.0)
THRUSTERS = [
    MavlinkThruster(one + 1, servo_channel=one + 1, command_scale=PULSES, esc_index=one if one < ESCS else None)
    for one in range(SERVOS)
]


def mavlink_datagrams() -> Comparison:
    """An ArduSub's stream as it comes over UDP, one packet a datagram."""
    return _decoding("MAVLink datagrams to readings", [packet for _, packet in packets(STREAM_S)])


def mavlink_asked() -> Comparison:
    """The same with commands and speeds of all thrusters at 20 Hz: most of it is read, and gives several readings."""
    datagrams = [packet for _, packet in packets(STREAM_S, asked=True)]
    return _decoding("MAVLink datagrams, thrusters at 20 Hz", datagrams)


def mavlink_bytes() -> Comparison:
    """The same over a serial line or TCP: cut anywhere."""
    stream = b"".join(packet for _, packet in packets(STREAM_S))
    sizes = np.random.default_rng(1).integers(1, 2 * READ_BYTES, 2 * len(stream) // READ_BYTES).tolist()
    ends = list(accumulate(sizes, initial=0))
    chunks = [stream[begin:end] for begin, end in pairwise(ends)]
    return _decoding("MAVLink byte stream to readings", chunks, len(packets(STREAM_S)))


def _decoding(work: str, chunks: Sequence[bytes], count: int | None = None) -> Comparison:
    step_s = STREAM_S / len(chunks)

    def ours() -> list[Reading]:
        decoder = MavlinkDecoder(THRUSTERS)
        readings: list[Reading] = []
        for number, chunk in enumerate(chunks):
            readings += decoder.decode(chunk, number * step_s)
        return readings

    def theirs() -> list[Any]:
        parser = mavlink.MAVLink(None)
        messages: list[Any] = []
        for chunk in chunks:
            messages += parser.parse_buffer(chunk) or ()
        return messages

    return Comparison(work, "pymavlink parse_buffer", "message", count or len(chunks), ours, theirs, _agree)


def tlog() -> Comparison:
    """A ground station's log to readings, beside pymavlink's reader of such logs."""

    def theirs() -> list[Any]:
        with _log() as path:
            log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
            messages = list(iter(log.recv_msg, None))
            log.close()
            return messages

    return Comparison("tlog to readings", "pymavlink mavlogfile", "message", _messages(), _read, theirs, _agree)


def has_fasttlogparser() -> bool:
    """Whether that peer is installed: it is no dependency, for it only builds with `--no-build-isolation`."""
    return find_spec("fasttlogparser") is not None


def tlog_columns() -> Comparison:
    """The same beside a reader in C++, which gives columns of every message."""
    import fasttlogparser

    def theirs() -> dict[str, Any]:
        with _log() as path:
            columns: dict[str, Any] = fasttlogparser.parseTLog(str(path))[0]
            return columns

    def agree(readings: Sequence[Reading], columns: dict[str, Any]) -> bool:
        return bool(_rolls(readings) == columns["ATTITUDE"]["roll"].tolist())

    return Comparison("tlog to readings", "fasttlogparser (columns)", "message", _messages(), _read, theirs, agree)


def _read() -> list[Reading]:
    with _log() as path:
        return [reading for some in read_tlog(path, MavlinkDecoder(THRUSTERS), DamageReport()) for reading in some]


@contextmanager
def _log() -> Iterator[Path]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "dive.tlog"
        path.write_bytes(_log_bytes())
        yield path


@cache
def _log_bytes() -> bytes:
    stamped = packets(LOG_S)
    return b"".join(round(1e6 * time_s).to_bytes(8, "big") + packet for time_s, packet in stamped)


def _messages() -> int:
    return len(packets(LOG_S))


def _agree(readings: Sequence[Reading], messages: Sequence[Any]) -> bool:
    outputs = [m for m in messages if m.get_type() == "SERVO_OUTPUT_RAW"]
    pulses = [getattr(m, f"servo{one}_raw") for m in outputs for one in range(1, SERVOS + 1)]
    commands = [reading.fraction for reading in readings if isinstance(reading, ThrusterCommand)]
    rolls = [m.roll for m in messages if m.get_type() == "ATTITUDE"]
    return commands == [PULSES.fraction(pulse) for pulse in pulses] and _rolls(readings) == rolls


def _rolls(readings: Sequence[Reading]) -> list[float]:
    return [reading.roll_rad for reading in readings if isinstance(reading, Attitude)]

"""Logs of autopilots and ground stations: .tlog, dataflash .BIN and ULog."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from itertools import pairwise
from pathlib import Path

from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import dataflash_clock, read_dataflash
from drivers.logs.dataflash_format import FORMAT_TYPE
from drivers.logs.dataflash_records import read_formats, read_records
from drivers.logs.tlog import read_tlog
from drivers.logs.tlog_records import RecordWalk
from drivers.logs.ulog import read_ulog, ulog_clock
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.frames import Packet
from drivers.readings import Reading
from hil_tests.fuzz.autopilot_log_seeds import DATAFLASH_TYPES, dataflash_log, ulog_log
from hil_tests.fuzz.files import as_file, recorded
from hil_tests.fuzz.mavlink_bytes import TOKENS, everything_decoder, message_ids, packets, thrusters
from hil_tests.fuzz.retyped_logs import retyped_dataflash, retyped_ulog
from hil_tests.fuzz.target import Target, require

SMALL_PIECE = 700
REST_MAX = 1000
START_US = 1_700_000_000_000_000

Read = Callable[[Path, DamageReport], Iterator[list[Reading]]]


def autopilot_log_targets() -> list[Target]:
    """One of each format."""
    return [
        Target("tlog", "MAVLink logs of ground stations", _check_tlog, _tlogs, TOKENS),
        Target(
            "dataflash", "ArduPilot's .BIN logs", _check_dataflash, _dataflash_logs, (b"\xa3\x95", b"\xa3\x95\x80")
        ),
        Target(
            "dataflash_fields",
            "the same with fields of other types",
            lambda data: _check_dataflash(retyped_dataflash(data)),
            _decisions,
        ),
        Target(
            "ulog_fields",
            "the same with fields of other types",
            lambda data: _check_ulog(retyped_ulog(data)),
            _decisions,
        ),
        Target("ulog", "PX4's .ulg logs", _check_ulog, _ulogs, (b"D", b"A", b"F", b"[9999]", b"uint64_t timestamp;")),
    ]


def _readings(read: Read, path: Path) -> list[Reading] | None:
    """All of a log, None where the reader says that it is no such log."""
    damage, readings = DamageReport(), []
    try:
        for batch in read(path, damage):
            readings += batch
    except ValueError as error:
        refused = str(error).startswith(f"{path}: ") and not readings
        if not refused:
            raise
        return None
    require(all(damage.lost.values()) and damage.lost.keys() == damage.places.keys(), f"{damage}")
    return readings


def _check_tlog(data: bytes) -> None:
    def read(path: Path, damage: DamageReport) -> Iterator[list[Reading]]:
        return read_tlog(path, everything_decoder(can_frames=ForwardedFrames(Counter())), damage)

    with as_file(data, "damaged.tlog") as path:
        _readings(read, path)
    require(_walked(data, len(data) or 1) == _walked(data, SMALL_PIECE), "in pieces there are other records")


def _walked(data: bytes, size: int) -> tuple[list[tuple[Packet, float]], int]:
    """Packets that are wanted, and the number of all, where the log comes in pieces of this size."""
    found: list[tuple[Packet, float]] = []
    damage = DamageReport()

    def take(packet: Packet, time_s: float) -> Sequence[Reading]:
        found.append((packet, time_s))
        return ()

    walk, rest, begin = RecordWalk(take, message_ids(), Counter(), damage), b"", 0
    for start, end in pairwise([*range(0, len(data), size), len(data)]):
        buffer = rest + data[start:end]
        done = walk.read(buffer, begin, [], last=end == len(data))
        rest, begin = buffer[done:], begin + done
        require(len(rest) < REST_MAX, f"{len(rest)} bytes are kept")
    return found, damage.records


def _check_dataflash(data: bytes) -> None:
    with as_file(data, "damaged.BIN") as path:
        readings = _readings(_read_dataflash, path)
        if readings is None:
            return
        dataflash_clock(path)
    _require_order(readings)
    _check_records(data)


def _read_dataflash(path: Path, damage: DamageReport) -> Iterator[list[Reading]]:
    return read_dataflash(path, thrusters(), damage, navigation=True)


def _check_records(data: bytes) -> None:
    """In pieces there are the same records, and each byte is in one of them or lost."""
    formats = read_formats(BytesIO(data))
    accounts = []
    for size in (len(data) or 1, SMALL_PIECE):
        damage, counted = DamageReport(), 0
        names = [one.name for one in formats.values()]
        for part in read_records(BytesIO(data), formats, names, damage, size):
            counted += sum(len(one) * one.format.length for one in part)
        if FORMAT_TYPE in formats:
            require(counted + damage.lost.total() == len(data), f"{counted} bytes read, {damage.lost} of {len(data)}")
        accounts.append((counted, damage.records, damage.lost))
    require(accounts[0] == accounts[1], f"whole and in pieces: {accounts}")


def _require_order(readings: Sequence[Reading]) -> None:
    for before, after in pairwise(readings):
        require(before.time_s <= after.time_s, f"{after} comes behind {before}")


def _check_ulog(data: bytes) -> None:
    with as_file(data, "damaged.ulg") as path:
        readings = _readings(_read_ulog, path)
        if readings is None:
            return
        ulog_clock(path)
    _require_order(readings)


def _read_ulog(path: Path, damage: DamageReport) -> Iterator[list[Reading]]:
    return read_ulog(path, thrusters(), damage, navigation=True)


def _tlogs() -> list[bytes]:
    records = [struct.pack(">Q", START_US + 20_000 * n) + packet for n, packet in enumerate(packets())]
    return [b"".join(records), b"".join(records[:6]), b"".join(records[-6:]), *recorded("small.tlog")]


def _dataflash_logs() -> list[bytes]:
    return [dataflash_log(DATAFLASH_TYPES), dataflash_log(DATAFLASH_TYPES[:6]), *recorded("small.BIN")]


def _ulogs() -> list[bytes]:
    return [ulog_log()]


def _decisions() -> list[bytes]:
    return [bytes(40), bytes(range(200)), bytes(range(255, 127, -1)), b"\0" * 20 + b"\xe7" + b"\0" * 30]

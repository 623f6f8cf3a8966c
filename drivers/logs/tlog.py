"""MAVLink logs of ground stations (.tlog): packets as they came, each behind the time of its reception.

A record is eight bytes of unix time in microseconds, the highest first, and one packet of MAVLink 1 or 2. There are
no marks between records: after damage the next one is where a packet with a right checksum stands behind a time that
fits to the one before it, or to those after it. Checksums and times are looked at all along, so that a wrong length
cannot swallow the records behind it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from drivers.logs.damage import DamageReport
from drivers.logs.kinds import looks_like
from drivers.logs.tlog_records import RecordWalk, begins_as_record, is_bare_stream
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.formats import CLOSING
from drivers.mavlink.frames import Packet
from drivers.readings import Reading

CHUNK_BYTES = 1 << 20


def read_tlog(path: Path, decoder: MavlinkDecoder, damage: DamageReport) -> Iterator[list[Reading]]:
    """Readings of a MAVLink log, in its order.

    Args:
        path: the log.
        decoder: without a gate: signatures are of the time then, and are not checked.
        damage: told what is lost, and of times that cannot be right, by their offset in the log.

    Returns:
        Batches of readings. `time_s` is the record's own time, unix. Times rise, but where the clock of the machine
        that wrote the log was set; that is told.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no MAVLink log, or one without times; an empty one, or one of zeros, has no readings.
    """
    with path.open("rb") as file:
        _check(path, file.read(CHUNK_BYTES))
    return _batches(path, RecordWalk(decoder.take, decoder.wanted, decoder.drops, damage), damage)


def read_packets(path: Path, damage: DamageReport) -> Iterator[list[tuple[float, Packet]]]:
    """All packets of a MAVLink log of messages whose layout is known, each with the record's own time, in its order.

    Args:
        path: the log.
        damage: told what is lost, as by `read_tlog`.

    Returns:
        Batches of times and packets.

    Raises:
        OSError, ValueError: as `read_tlog`.
    """
    with path.open("rb") as file:
        _check(path, file.read(CHUNK_BYTES))
    return _packets(path, damage)


def _packets(path: Path, damage: DamageReport) -> Iterator[list[tuple[float, Packet]]]:
    packets: list[tuple[float, Packet]] = []

    def take(packet: Packet, time_s: float) -> Sequence[Reading]:
        packets.append((time_s, packet))
        return ()

    for _ in _batches(path, RecordWalk(take, CLOSING, Counter(), damage), damage):
        yield packets
        packets = []


def _check(path: Path, head: bytes) -> None:
    if is_bare_stream(head):
        raise ValueError(f"{path}: want a MAVLink log (.tlog), this is a MAVLink stream without times")
    if head.strip(b"\0") and not begins_as_record(head):
        raise ValueError(f"{path}: want a MAVLink log (.tlog), this is {looks_like(head)}")


def _batches(path: Path, walk: RecordWalk, damage: DamageReport) -> Iterator[list[Reading]]:
    with path.open("rb") as file:
        chunk, rest, begin = file.read(CHUNK_BYTES), b"", 0
        while chunk:
            following = file.read(CHUNK_BYTES)
            damage.bytes_read = file.tell()
            buffer = rest + chunk
            readings: list[Reading] = []
            done = walk.read(buffer, begin, readings, last=not following)
            rest, begin, chunk = buffer[done:], begin + done, following
            yield readings

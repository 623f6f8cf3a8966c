"""Vendor messages and VESC's: frames to readings by our decoders, alone and in blocks, and to values by cantools.

The peer makes python-can's Message of each frame, and stops at a dictionary of values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from typing import Any

import can
import cantools

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.frame import EXTENDED_MASK, CanFrame
from drivers.can.messages.decoder import MessageDecoder
from drivers.can.vesc import VescDecoder, VescThruster
from drivers.can.vesc_messages import Status, encode_command
from drivers.command import CommandScale
from drivers.reading_block import ReadingBlock
from drivers.readings import Reading
from hil_tests.bench.decoding import EXTENDED_FLAG, PACKED, numbers, packed, unpacked
from hil_tests.bench.timing import Comparison

PAIRS = 5000  # of a command and a status
PERIOD_S = 0.01
FULL_COMMAND = 1000.0  # fractions are compared in thousandths
PEER = "cantools, python-can Message"

VESC_POLE_PAIRS = 7
VESC_DATABASE = """VERSION ""
NS_ :
BS_:
BU_: VESC
BO_ 2147483658 SetDuty: 4 VESC
 SG_ Command : 7|32@0- (0.00001,0) [0|0] "" VESC
BO_ 2147485962 Status: 8 VESC
 SG_ Erpm : 7|32@0- (1,0) [0|0] "1/min" VESC
 SG_ Current : 39|16@0- (0.1,0) [0|0] "A" VESC
 SG_ Duty : 55|16@0- (0.001,0) [0|0] "" VESC
"""
VESC_ID = 10


def dbc_frames() -> Comparison:
    """A vendor's commands and status by the example's database: speed, voltage and current; one by one."""
    return _vendor("DBC command and status", _one_by_one, _same)


def dbc_blocks() -> Comparison:
    """The same in a block."""
    return _vendor("DBC command and status, block", _in_a_block, ReadingBlock.readings)


def vesc_frames() -> Comparison:
    """A VESC's duty cycle and status: speed and current; one by one."""
    return _vesc("VESC command and status", _one_by_one, _same)


def vesc_blocks() -> Comparison:
    """The same in a block."""
    return _vesc("VESC command and status, block", _in_a_block, ReadingBlock.readings)


@dataclass(frozen=True, slots=True)
class _Traffic:
    """Frames, and what both sides need to read them.

    Attributes:
        stream: struct can_frame, one after the other.
        decoder: makes ours.
        database: the peer's.
        wanted: the number that a message's values are compared by.
    """

    stream: bytes
    decoder: Callable[[], MessageDecoder]
    database: Any
    wanted: Callable[[dict[str, float]], int]


def _vendor(work: str, decode: Callable[[_Traffic], Any], readings_of: Callable[[Any], list[Reading]]) -> Comparison:
    thruster = DbcThruster(
        thruster=1,
        command="StarboardCommand.Percent",
        command_scale=CommandScale(-100.0, 0.0, 100.0),
        speed="StarboardStatus.Speed",
        voltage="StarboardStatus.Voltage",
        current="StarboardStatus.Current",
    )
    with as_file(files("gateway") / "examples" / "vendor_thruster.dbc") as path:
        database: Any = cantools.database.load_file(path)
    return _beside(
        work,
        _Traffic(
            packed(_vendor_frames(database)),
            lambda: DbcDecoder(database, [thruster]),
            database,
            lambda values: round(values.get("Speed", 10.0 * values.get("Percent", 0.0))),
        ),
        decode,
        readings_of,
    )


def _vendor_frames(database: Any) -> Iterable[CanFrame]:
    command, status = (database.get_message_by_name(name) for name in ("StarboardCommand", "StarboardStatus"))
    for number in range(PAIRS):
        percent = command.encode({"Percent": number % 201 - 100})
        values = {"Speed": (37 * number) % 6000 - 3000, "Voltage": 15.5, "Current": 0.25 * (number % 64)}
        yield CanFrame(0.0, command.frame_id, percent, extended=False)
        yield CanFrame(0.0, status.frame_id, status.encode(values), extended=False)


def _vesc(work: str, decode: Callable[[_Traffic], Any], readings_of: Callable[[Any], list[Reading]]) -> Comparison:
    thruster = VescThruster(1, VESC_ID, "duty", CommandScale(-1.0, 0.0, 1.0), VESC_POLE_PAIRS)
    return _beside(
        work,
        _Traffic(
            packed(_vesc_frames()),
            lambda: VescDecoder([thruster]),
            cantools.database.load_string(VESC_DATABASE, "dbc"),
            lambda values: round(
                values["Erpm"] / VESC_POLE_PAIRS if "Erpm" in values else FULL_COMMAND * values["Command"]
            ),
        ),
        decode,
        readings_of,
    )


def _vesc_frames() -> Iterable[CanFrame]:
    for number in range(PAIRS):
        speed_rpm = (37 * number) % 6000 - 3000
        yield encode_command("duty", 0.01 * (number % 201 - 100), VESC_ID)
        yield Status(VESC_POLE_PAIRS * speed_rpm, 0.25 * (number % 64), 0.5).frame(VESC_ID)


def _one_by_one(traffic: _Traffic) -> list[Reading]:
    decoder = traffic.decoder()
    readings: list[Reading] = []
    for frame in unpacked(traffic.stream, PERIOD_S).frames():
        readings += decoder.decode(frame)
    return readings


def _in_a_block(traffic: _Traffic) -> ReadingBlock:
    return traffic.decoder().decode_block(unpacked(traffic.stream, PERIOD_S))


def _by_peer(traffic: _Traffic) -> list[dict[str, float]]:
    values, time_s, database = [], 0.0, traffic.database
    for identifier, length, data in PACKED.iter_unpack(traffic.stream):
        time_s += PERIOD_S
        extended = identifier >= EXTENDED_FLAG
        message = can.Message(time_s, identifier & EXTENDED_MASK, is_extended_id=extended, data=data[:length])
        values.append(
            database.decode_message(message.arbitration_id, message.data, force_extended_id=message.is_extended_id)
        )
    return values


def _same(readings: list[Reading]) -> list[Reading]:
    return readings


def _beside(
    work: str,
    traffic: _Traffic,
    decode: Callable[[_Traffic], Any],
    readings_of: Callable[[Any], list[Reading]],
) -> Comparison:
    def agree(decoded: Any, values: Sequence[dict[str, float]]) -> bool:
        return numbers(readings_of(decoded), FULL_COMMAND) == [traffic.wanted(one) for one in values]

    return Comparison(work, PEER, "message", 2 * PAIRS, lambda: decode(traffic), lambda: _by_peer(traffic), agree)

"""DroneCAN: frames to readings by our decoder, one by one and in blocks, and to message objects by `dronecan`.

Both sides start from the same bytes, frames as SocketCAN hands them out (struct can_frame, 16 bytes each). The peer
stops at its own message objects, ours goes on to readings. Every call decodes a whole stream, with a decoder of its
own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dronecan import transport

from drivers.can.dronecan import (
    COMMAND_MAX,
    DroneCanDecoder,
    DroneCanThruster,
    EscStatus,
    encode_esc_status,
    encode_raw_command,
)
from drivers.can.frame import EXTENDED_MASK
from drivers.reading_block import ReadingBlock
from drivers.readings import Reading
from hil_tests.bench.decoding import PACKED, numbers, packed, unpacked
from hil_tests.bench.timing import Comparison

MESSAGES = 1500
ESCS = 8
BATCH = 64
PERIOD_S = 0.0007  # from frame to frame: eight ESCs at 50 Hz


def status_frames() -> Comparison:
    """esc.Status of eight ESCs, three frames each, one by one."""
    return _beside("DroneCAN esc.Status", _statuses(), _one_by_one, _same, _speeds)


def status_blocks() -> Comparison:
    """The same in a block."""
    return _beside("DroneCAN esc.Status, block", _statuses(), _in_a_block, _unpacked, _speeds)


def command_frames() -> Comparison:
    """esc.RawCommand with eight commands, three frames each, one by one."""
    return _beside("DroneCAN esc.RawCommand", _commands(), _one_by_one, _same, _counts)


def command_blocks() -> Comparison:
    """The same in a block."""
    return _beside("DroneCAN esc.RawCommand, block", _commands(), _in_a_block, _unpacked, _counts)


def _statuses() -> bytes:
    return packed(
        frame
        for number in range(MESSAGES)
        for frame in encode_esc_status(_status(number), 11 + number % ESCS, number // ESCS % 32)
    )


def _status(number: int) -> EscStatus:
    speed_rpm = (37 * number) % 6000 - 3000
    return EscStatus(0, 15.5, 0.25 * (number % 64), 300.0, speed_rpm, number % 100, number % ESCS)


def _commands() -> bytes:
    commands = np.random.default_rng(1).integers(-COMMAND_MAX, COMMAND_MAX + 1, (MESSAGES, ESCS)).tolist()
    return packed(
        frame for number, command in enumerate(commands) for frame in encode_raw_command(command, 10, number % 32)
    )


def _decoder() -> DroneCanDecoder:
    return DroneCanDecoder([DroneCanThruster(thruster=index + 1, esc_index=index) for index in range(ESCS)])


def _one_by_one(stream: bytes) -> list[Reading]:
    """As the live gateway does with the few frames that it finds waiting."""
    decoder, block = _decoder(), unpacked(stream, PERIOD_S)
    readings: list[Reading] = []
    for begin in range(0, len(block), BATCH):
        for frame in block.part(slice(begin, begin + BATCH)).frames():
            readings += decoder.decode(frame)
    return readings


def _in_a_block(stream: bytes) -> ReadingBlock:
    return _decoder().decode_block(unpacked(stream, PERIOD_S))


def _by_peer(stream: bytes) -> list[Any]:
    manager, transfers = transport.TransferManager(), []
    for identifier, length, data in PACKED.iter_unpack(stream):
        complete = manager.receive_frame(transport.Frame(identifier & EXTENDED_MASK, data[:length]))
        if complete:
            transfer = transport.Transfer()
            transfer.from_frames(complete)
            transfers.append(transfer)
    return transfers


def _same(readings: list[Reading]) -> list[Reading]:
    return readings


def _unpacked(block: ReadingBlock) -> list[Reading]:
    return block.readings()


def _speeds(transfer: Any) -> list[int]:
    return [transfer.payload.rpm]


def _counts(transfer: Any) -> list[int]:
    return [round(command) for command in transfer.payload.cmd]


def _beside(
    work: str,
    stream: bytes,
    decode: Callable[[bytes], Any],
    readings_of: Callable[[Any], list[Reading]],
    values: Callable[[Any], list[int]],
) -> Comparison:
    def agree(decoded: Any, transfers: Sequence[Any]) -> bool:
        wanted = [value for transfer in transfers for value in values(transfer)]
        return numbers(readings_of(decoded), COMMAND_MAX) == wanted

    return Comparison(work, "dronecan", "message", MESSAGES, lambda: decode(stream), lambda: _by_peer(stream), agree)

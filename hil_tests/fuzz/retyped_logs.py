"""Logs whose fields are of other types than they should be, and hold anything: formats are damaged like all else.

A byte of the input decides about each field whether it keeps its type; the same bytes, over and over, are the data.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from itertools import cycle, islice

from hil_tests.fuzz.autopilot_log_seeds import (
    DATAFLASH_TYPES,
    ULOG_TOPICS,
    DataflashType,
    dataflash_head,
    ulog_head,
    ulog_message,
)

ROUNDS = 3
LENGTH_MAX = 255  # bytes of a record
KEPT = 128  # a type is, for a byte below
_KINDS = "bBhHiIqQgfdcCeELMnNZa"
_TEXTS = (
    DataflashType(64, "PARM", "QNf", "TimeUS,Name,Value"),
    DataflashType(91, "MSG", "QZ", "TimeUS,Message"),
)
_BYTES = {"int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint32_t": 4, "int64_t": 8, "uint64_t": 8}
_BYTES |= {"float": 4, "double": 8, "bool": 1, "char": 1, "float[3]": 12, "uint8_t[4]": 4}
_TYPES = tuple(_BYTES)


def retyped_dataflash(data: bytes) -> bytes:
    """A dataflash log."""
    decide, fill = cycle(data or b"\0"), cycle(data or b"\0")
    types = [_retyped(one, decide) for one in (*_TEXTS, *DATAFLASH_TYPES)]
    records = [one.head + struct.pack("<Q", 100_000 * turn) for turn in range(1, ROUNDS + 1) for one in types]
    sizes = [one.layout.size for _ in range(ROUNDS) for one in types]
    filled = [head + _some(fill, size - len(head)) for head, size in zip(records, sizes, strict=True)]
    return b"".join([dataflash_head(types), *filled])


def _retyped(one: DataflashType, decide: Iterator[int]) -> DataflashType:
    decided = zip(one.kinds[1:], decide, strict=False)
    kinds = [kind if byte < KEPT else _KINDS[byte % len(_KINDS)] for kind, byte in decided]
    retyped = DataflashType(one.number, one.name, "Q" + "".join(kinds), one.fields)
    return retyped if retyped.layout.size <= LENGTH_MAX else one


def retyped_ulog(data: bytes) -> bytes:
    """A PX4 log."""
    decide, fill = cycle(data or b"\0"), cycle(data or b"\0")
    topics = [(name, [_field(one, decide) for one in fields.split(";") if one]) for name, fields, _, _ in ULOG_TOPICS]
    described = [(name, "".join(f"{kind} {label};" for kind, label in fields)) for name, fields in topics]
    messages = [
        ulog_message("D", struct.pack("<HQ", number, 100_000 * turn) + _some(fill, _size(fields)))
        for turn in range(1, ROUNDS + 1)
        for number, (_, fields) in enumerate(topics)
    ]
    return b"".join([ulog_head(described), *messages])


def _field(text: str, decide: Iterator[int]) -> tuple[str, str]:
    kind, label = text.split()
    byte = next(decide)
    return (kind if byte < KEPT and kind in _BYTES else _TYPES[byte % len(_TYPES)]), label


def _size(fields: Sequence[tuple[str, str]]) -> int:
    return sum(_BYTES[kind] for kind, _ in fields)


def _some(fill: Iterator[int], size: int) -> bytes:
    return bytes(islice(fill, size))

"""Messages of a PX4 log (ULog) and the formats of its topics, as far as it takes to tell whole from damaged.

A ULog file is a header and messages: their size, a letter for their kind, and that many bytes. Formats (F) come
first, each topic that is logged is announced (A) under a number, and its data (D) come under that number. There are
no checksums, but the size of data is that of the topic. (PX4 user guide, "ULog file format".) What is in whole
messages is read by pyulog.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

MAGIC = b"ULog\x01\x12\x35"
VERSION = 1
TIME_BYTES = 8
FILE_HEADER_BYTES = len(MAGIC) + 1 + TIME_BYTES
HEAD = struct.Struct("<HB")
SYNC = bytes((0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))

NUMBER_BYTES = 2  # of the topic, before its data
FLAGS, FORMAT, ADD, DATA, SYNCHRONISATION = b"BFADS"
KINDS = b"BFADSIMPQRLCO"
DATA_SIZE_MIN = NUMBER_BYTES + 8  # a time
# of what tells nothing of its size itself: a parameter, a line of text
SIZE_MAX = 10_000
# what messages of the other kinds begin with, or are: enough that no noise passes for one
_BODIES: Mapping[int, re.Pattern[bytes]] = {
    FLAGS: re.compile(rb".{40}", re.DOTALL),
    FORMAT: re.compile(rb"\w+:[\w\[\]; ]+"),
    ADD: re.compile(rb".{3}\w+", re.DOTALL),
    SYNCHRONISATION: re.compile(re.escape(SYNC)),
    ord("I"): re.compile(rb"[^\0]\w+(\[\d+\])? [\w ]+.*", re.DOTALL),
    ord("M"): re.compile(rb"[\0\1][^\0]\w+(\[\d+\])? [\w ]+.*", re.DOTALL),
    ord("P"): re.compile(rb"[^\0](int32_t|float) \w+.*", re.DOTALL),
    ord("Q"): re.compile(rb".[^\0](int32_t|float) \w+.*", re.DOTALL),
    ord("R"): re.compile(rb"..", re.DOTALL),
    ord("L"): re.compile(rb"[0-7].{8}[^\0]*", re.DOTALL),
    ord("C"): re.compile(rb"[0-7].{10}[^\0]*", re.DOTALL),
    ord("O"): re.compile(rb"..", re.DOTALL),
}

_BYTES = {
    "int8_t": 1,
    "uint8_t": 1,
    "int16_t": 2,
    "uint16_t": 2,
    "int32_t": 4,
    "uint32_t": 4,
    "int64_t": 8,
    "uint64_t": 8,
    "float": 4,
    "double": 8,
    "bool": 1,
    "char": 1,
}
_FIELD = re.compile(r"(\w+)(?:\[(\d{1,4})\])? (\w+)")
_NESTED_MAX = 8


@dataclass(slots=True)
class Topics:
    """What was announced so far.

    Attributes:
        formats: messages F by the names that they describe, as they stand in the log.
        names: names of topics by their numbers.
        sizes: least and greatest size of a D by the same; without an entry the announcement, or the format, is lost.
    """

    formats: dict[str, bytes] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    sizes: dict[int, tuple[int, int]] = field(default_factory=dict)

    def describe(self, body: bytes) -> None:
        """Takes a message F."""
        name = body.partition(b":")[0].decode("ascii", "replace")
        self.formats.setdefault(name, body)

    def announce(self, body: bytes) -> int | None:
        """Takes a message A; the number of the topic, None where nobody described it."""
        number = int.from_bytes(body[1:3], "little")
        name = body[3:].decode("ascii", "replace")
        sizes = self._sizes(name, 0)
        if sizes is None:
            return None
        self.names[number], self.sizes[number] = name, (sizes[0] + NUMBER_BYTES, sizes[1] + NUMBER_BYTES)
        return number

    def fits_data(self, number: int, size: int) -> bool:
        """Whether a message D of a topic can have this size."""
        least, greatest = self.sizes.get(number, (DATA_SIZE_MIN, SIZE_MAX))
        return least <= size <= greatest

    def nested(self, name: str) -> list[str]:
        """Names of the formats that one is made of, the innermost first, itself last."""
        names = [
            inner for kind, _, _ in self._fields(name) or () if kind not in _BYTES for inner in self.nested(kind)
        ]
        return [*dict.fromkeys(names), name]

    def _sizes(self, name: str, depth: int) -> tuple[int, int] | None:
        """Bytes without and with the filling at the end, which is not written."""
        fields = self._fields(name)
        if not fields or depth > _NESTED_MAX:
            return None
        total = unfilled = 0
        for kind, count, label in fields:
            one = _BYTES.get(kind)
            if one is None:
                inner = self._sizes(kind, depth + 1)
                if inner is None:
                    return None
                one = inner[1]
            total += one * count
            unfilled = unfilled if label.startswith("_padding") else total
        return unfilled, total

    def _fields(self, name: str) -> list[tuple[str, int, str]] | None:
        """(type, how many, name) of each, None where the format is damaged."""
        text = self.formats.get(name, b"").decode("ascii", "replace").partition(":")[2]
        matches = [_FIELD.fullmatch(one) for one in text.split(";") if one]
        fields = [(match[1], int(match[2] or 1), match[3]) for match in matches if match is not None]
        labels = {label for _, _, label in fields}
        return fields if len(labels) == len(matches) and all(count for _, count, _ in fields) else None


def is_message(kind: int, body: bytes) -> bool:
    """Whether a message, other than data, can be what it says."""
    pattern = _BODIES.get(kind)
    return pattern is not None and len(body) <= SIZE_MAX and pattern.fullmatch(body) is not None


def message(kind: int, body: bytes) -> bytes:
    """As it stands in a log."""
    return HEAD.pack(len(body), kind) + body

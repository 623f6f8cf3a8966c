"""Layouts of messages: the text by which viewers know them (ROS 2 message definitions), their bytes (CDR).

CDR (OMG, Common Data Representation, little-endian): four bytes that say so, then value after value, each aligned
to its own size from there on. Where the first fields all have a fixed size, one `struct` or one numpy row is all of
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from struct import Struct, error
from typing import Any

import numpy as np

ENCAPSULATION = b"\x00\x01\x00\x00"  # plain CDR, little-endian
_CODES = {"float64": "d", "int64": "q", "uint64": "Q", "int32": "i", "uint32": "I", "uint8": "B", "bool": "?"}
_SIZES = {kind: Struct("<" + code).size for kind, code in _CODES.items()}
_COUNT = Struct("<I")
STRING, BYTES = "string", "bytes"
_VARIABLE_TEXT = {STRING: "string", BYTES: "uint8[]"}


class LayoutError(Exception):
    """Bytes are no message of this layout."""


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a message.

    Attributes:
        name: as viewers show it.
        kind: a number or bool of ROS 2, or "string", or "bytes" (which ROS 2 calls uint8[]).
        count: how many of them, in a fixed array; None: as many as there are, at most 2^32 - 1.

    Raises:
        ValueError: a kind that is none of these, or several strings.
    """

    name: str
    kind: str
    count: int | None = 1

    def __post_init__(self) -> None:
        if self.kind not in _CODES and self.kind not in _VARIABLE_TEXT:
            raise ValueError(
                f"kind of {self.name}: want one of {', '.join([*_CODES, *_VARIABLE_TEXT])}, got {self.kind}"
            )
        if self.kind in _VARIABLE_TEXT and self.count != 1:
            raise ValueError(f"{self.name}: want one {self.kind}, got {self.count}")

    @property
    def fixed(self) -> bool:
        """Whether each message has as many bytes of it."""
        return self.kind in _CODES and self.count is not None

    @property
    def text(self) -> str:
        """As a line of a message definition."""
        if self.kind in _VARIABLE_TEXT:
            return f"{_VARIABLE_TEXT[self.kind]} {self.name}"
        brackets = {None: "[]", 1: ""}.get(self.count, f"[{self.count}]")
        return f"{self.kind}{brackets} {self.name}"


@dataclass(frozen=True)
class Layout:
    """A kind of message.

    Attributes:
        name: "package/msg/Name".
        fields: in the order of their bytes; a nested message's stand in its place.
        definition: the text for viewers, where it is not just that of the fields.
    """

    name: str
    fields: tuple[Field, ...]
    definition: str = field(default="", compare=False)

    @property
    def text(self) -> str:
        """The message definition."""
        return self.definition or "".join(f"{one.text}\n" for one in self.fields)

    @property
    def fixed(self) -> bool:
        """Whether all messages have the same number of bytes."""
        return all(one.fixed for one in self.fields)

    @cached_property
    def row(self) -> np.dtype[np.void]:
        """One message of fixed size with its four bytes in front.

        Raises:
            ValueError: messages of this kind differ in size.
        """
        if not self.fixed:
            raise ValueError(f"{self.name}: has fields of no fixed size")
        places = dict(_places(self.fields))
        shapes = [
            (one.kind.replace("bool", "?"), (one.count,)) if one.count != 1 else one.kind for one in self.fields
        ]
        names = ["encapsulation", *(one.name for one in self.fields)]
        offsets = [0, *(len(ENCAPSULATION) + places[one.name] for one in self.fields)]
        size = len(ENCAPSULATION) + _end(self.fields)
        formats = ["V4", *("?" if shape == "bool" else shape for shape in shapes)]
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})

    def encode(self, values: Sequence[Any]) -> bytes:
        """One message.

        Args:
            values: one for each field; of an array, a sequence of its length.
        """
        head, beginning = self._head
        flat: list[Any] = []
        for one, value in zip(self.fields[:head], values, strict=False):
            if one.count == 1:
                flat.append(value)
            else:
                flat += value
        body = bytearray(beginning.pack(*flat))
        for one, value in zip(self.fields[head:], values[head:], strict=True):
            _append(body, one, value)
        return ENCAPSULATION + bytes(body)

    def decode(self, data: bytes) -> list[Any]:
        """The values of one message, in the order of the fields.

        Raises:
            LayoutError: it is none.
        """
        if data[:4] != ENCAPSULATION:
            raise LayoutError("not little-endian CDR")
        head, beginning = self._head
        try:
            flat = iter(beginning.unpack_from(data, 4))
            values = [next(flat) if one.count == 1 else tuple(_several(flat, one)) for one in self.fields[:head]]
            position = 4 + beginning.size
            for one in self.fields[head:]:
                value, position = _extracted(data, position, one)
                values.append(value)
        except (error, UnicodeDecodeError) as wrong:
            raise LayoutError(f"no {self.name}") from wrong
        return values

    @cached_property
    def _head(self) -> tuple[int, Struct]:
        """Number of the first fields that have a fixed size, and how they are packed."""
        head = next((number for number, one in enumerate(self.fields) if not one.fixed), len(self.fields))
        packing, end = "<", 0
        for one, (_, start) in zip(self.fields[:head], _places(self.fields[:head]), strict=True):
            packing += "x" * (start - end) + f"{one.count}{_CODES[one.kind]}"
            end = start + _SIZES[one.kind] * (one.count or 0)
        return head, Struct(packing)


def _several(flat: Iterator[Any], one: Field) -> Iterator[Any]:
    return (next(flat) for _ in range(one.count or 0))


def _places(fields: Sequence[Field]) -> Iterator[tuple[str, int]]:
    """Where each field begins, behind the first four bytes."""
    end = 0
    for one in fields:
        start = end + -end % _SIZES[one.kind]
        yield one.name, start
        end = start + _SIZES[one.kind] * (one.count or 0)


def _end(fields: Sequence[Field]) -> int:
    *_, (_, start) = _places(fields)
    return start + _SIZES[fields[-1].kind] * (fields[-1].count or 0)


def _append(body: bytearray, one: Field, value: Any) -> None:
    match one.kind:
        case "string":
            text = value.encode()
            body += bytes(-len(body) % 4) + _COUNT.pack(len(text) + 1) + text + b"\0"
        case "bytes":
            body += bytes(-len(body) % 4) + _COUNT.pack(len(value)) + value
        case kind:
            numbers = [value] if one.count == 1 else value
            if one.count is None:
                body += bytes(-len(body) % 4) + _COUNT.pack(len(value))
            if numbers:
                body += bytes(-len(body) % _SIZES[kind]) + Struct(f"<{len(numbers)}{_CODES[kind]}").pack(*numbers)


def _extracted(data: bytes, position: int, one: Field) -> tuple[Any, int]:
    """The value here, and where it ends. Positions count from the first byte, alignment from the fifth."""
    if one.kind in _VARIABLE_TEXT or one.count is None:
        position += -(position - 4) % 4
        (count,) = _COUNT.unpack_from(data, position)
        position += 4
    else:
        count = one.count
    if one.kind in _VARIABLE_TEXT:
        raw = data[position : position + count]
        if len(raw) != count:
            raise error(f"{one.name} is cut off")
        return raw[:-1].decode() if one.kind == STRING else raw, position + count
    if count:
        position += -(position - 4) % _SIZES[one.kind]
    packed = Struct(f"<{count}{_CODES[one.kind]}")
    values = packed.unpack_from(data, position)
    return (values[0] if one.count == 1 else values), position + packed.size

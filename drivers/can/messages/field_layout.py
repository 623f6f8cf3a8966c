"""All numbers that are wanted of one message, taken out of its data in one go."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.can.messages.bit_field import BitField, Column

Unpack = Callable[[bytes], Sequence[float]]


class FieldLayout:
    """The wanted fields of a message, each with its place in what is unpacked.

    Fields that begin and end with a byte are unpacked by `struct`, as many at once as do not overlap; the others one
    by one.

    Args:
        fields: may have some of them twice.
        length: of the message, in bytes.

    Attributes:
        unpack: function from the message's data to the numbers of all fields.

    Raises:
        ValueError: a field ends behind the message.
    """

    def __init__(self, fields: Iterable[BitField], length: int) -> None:
        wanted = sorted(set(fields), key=lambda field: (field.big_endian, field.first, field.bits, field.kind))
        for field in wanted:
            if field.end > 8 * length:
                raise ValueError(f"{field} ends at bit {field.end}, its message has {8 * length}")
        groups = _groups([field for field in wanted if field.struct_code is not None])
        alone = [field for field in wanted if field.struct_code is None]
        self._fields = [field for group in groups for field in group] + alone
        self.unpack = _unpack([_struct(group).unpack_from for group in groups], [one.reader(length) for one in alone])

    def place(self, field: BitField) -> int:
        """Where the field's number stands in what `unpack` and `columns` return."""
        return self._fields.index(field)

    def columns(self, data: NDArray[np.uint8]) -> list[Column]:
        """`unpack` of many frames, (N, 8) or (N, 64): (N,) for each field."""
        return [field.column(data) for field in self._fields]


def _groups(fields: Sequence[BitField]) -> list[list[BitField]]:
    """Fields of one byte order that follow each other: each goes where it is the first that does not overlap."""
    groups: list[list[BitField]] = []
    for field in fields:
        for group in groups:
            if group[-1].big_endian == field.big_endian and group[-1].end <= field.first:
                group.append(field)
                break
        else:
            groups.append([field])
    return groups


def _struct(fields: Sequence[BitField]) -> struct.Struct:
    codes, end = [], 0
    for field in fields:
        codes.append(f"{(field.first - end) // 8}x{field.struct_code}")
        end = field.end
    return struct.Struct((">" if fields[0].big_endian else "<") + "".join(codes))


def _unpack(together: Sequence[Unpack], alone: Sequence[Callable[[bytes], float]]) -> Unpack:
    if len(together) == 1 and not alone:
        return together[0]

    def unpack(data: bytes) -> Sequence[float]:
        numbers: list[float] = []
        for part in together:
            numbers += part(data)
        for read in alone:
            numbers.append(read(data))
        return numbers

    return unpack

"""Many lines of a candump log at once: those in the form of its files, of the same shape, column by column.

Lines of one length are sorted by shape: where time, interface, identifier and data stand, and what must stand between
them. A shape is taken from a line that is the first of its kind, and all that have it are read with numpy.
What fits no shape is left to `candump_line`: it alone decides what is damaged, and both read a frame alike.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CLASSIC_DATA_BYTES, EXTENDED_MASK, FD_DATA_BYTES, STANDARD_MASK
from drivers.can.frame_block import ERROR, EXTENDED, FD, FrameBlock
from drivers.logs.candump_line import ERROR_FLAG, INTERFACE_LENGTH_MAX
from drivers.logs.line_frames import LineFrames
from drivers.logs.text_log import TextChunk

LENGTH_MIN = 14  # of a line of this form: no data
LENGTH_MAX = 200  # of a line of this form: 64 bytes of CAN FD and all else
LINES_MIN = 16  # fewer are read faster one by one
SHAPES_MAX = 8  # of one length; a text that is no log has a new one in each line
INTERFACES_MAX = 16  # of one shape; damaged names are new ones

Characters = NDArray[np.uint8]  # (columns, lines): column by column of the text
Rows = NDArray[np.intp]
Mask = NDArray[np.bool_]

_REGULAR = re.compile(
    rb"\((\d{1,10})\.(\d{6})\) +([!-~]{1,%d}) +([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?:#([0-9A-Fa-f]))?"
    rb"((?:[0-9A-Fa-f]{2}){0,%d})(?: [RT])?\r?" % (INTERFACE_LENGTH_MAX, FD_DATA_BYTES)
)
_SECONDS, _MICROSECONDS, _INTERFACE, _IDENTIFIER, _FLAGS, _DATA = range(1, 7)
_TICKS_PER_S = 1_000_000
_EXACT_MAX = 1 << 53  # of float64: below, a division of whole numbers is rounded once, as a decimal text is


def read_regular(chunk: TextChunk, frames: LineFrames) -> Rows:
    """Puts what the regular lines hold into `frames`, one row a line.

    Returns:
        The lines that are left, ascending: irregular, damaged, or too few of their kind.
    """
    text = np.frombuffer(chunk.text, dtype=np.uint8)
    left = [np.empty(0, dtype=np.intp)]
    for length, rows in _by_length(chunk.ends - chunk.starts):
        if LENGTH_MIN <= length <= LENGTH_MAX and len(rows) >= LINES_MIN:
            characters = _columns(text, chunk.starts[rows], length)
            left += [rows[places] for places in _read_shapes(characters, rows, frames)]
        else:
            left.append(rows)
    return np.sort(np.concatenate(left))


def _by_length(lengths: Rows) -> Iterator[tuple[int, Rows]]:
    """Lines of each length; of those that are too long, of one more."""
    short = np.minimum(lengths, LENGTH_MAX + 1).astype(np.uint8)  # of one byte: sorted by radix
    order = np.argsort(short, kind="stable")
    counts = np.bincount(short)
    ends = np.cumsum(counts)
    for length in np.flatnonzero(counts).tolist():
        yield length, order[ends[length] - counts[length] : ends[length]]


def _columns(text: NDArray[np.uint8], starts: Rows, length: int) -> Characters:
    """The lines' characters. Lines are picked out whole, as items of that size, which is faster by the half."""
    lines = np.ndarray((len(text) - length + 1,), f"V{length}", text, strides=(1,))
    return np.ascontiguousarray(lines[starts].view(np.uint8).reshape(len(starts), length).T)


def _read_shapes(characters: Characters, rows: Rows, frames: LineFrames) -> Iterator[Rows]:
    """Reads all lines of the shapes that are found; gives the places, among `rows`, of those that it did not."""
    left = np.arange(len(rows))
    for _ in range(SHAPES_MAX):
        if len(left) < LINES_MIN:
            break
        shape = _shape(characters[:, left[0]].tobytes())
        if shape is None:
            yield left[:1]
            left = left[1:]
            continue
        alike = shape.fits(characters)[left]
        chosen = left[alike]
        yield chosen[~_read(shape, _chosen(characters, chosen), rows[chosen], frames)]
        left = left[~alike]
    yield left


def _read(shape: _Shape, characters: Characters, rows: Rows, frames: LineFrames) -> Mask:
    """Reads lines of one shape; returns which of them were sound and are read."""
    sound, block = shape.read(characters)
    read = np.zeros_like(sound)
    for interface, mask in _interfaces(characters[shape.interface], sound):
        if mask.all():
            frames.fill(rows, interface, block)
        else:
            frames.fill(rows[mask], interface, block.part(mask))
        read |= mask
    return read


def _interfaces(names: Characters, sound: Mask) -> Iterator[tuple[str, Mask]]:
    """The names that stand in sound lines, and where."""
    left = sound & ((names > ord(" ")) & (names <= ord("~"))).all(axis=0)
    for _ in range(INTERFACES_MAX):
        if not left.any():
            return
        name = names[:, left.argmax()]
        mask = left & (names == name[:, None]).all(axis=0)
        yield name.tobytes().decode("ascii"), mask
        left &= ~mask


def _chosen(characters: Characters, lines: Rows) -> Characters:
    return characters if len(lines) == characters.shape[1] else characters[:, lines]


@dataclass(frozen=True, slots=True)
class _Shape:
    """Where everything stands in a line of one length: slices of columns.

    Attributes:
        seconds, microseconds, interface, identifier, flags, data: see the regular form; no flags: a classic frame.
        between: all other columns.
        fixed: (len(between),) what those are.
    """

    seconds: slice
    microseconds: slice
    interface: slice
    identifier: slice
    flags: slice | None
    data: slice
    between: list[int]
    fixed: Characters

    def fits(self, characters: Characters) -> Mask:
        """(lines,) whether all between the fields is as in this shape."""
        fits: Mask = (characters[self.between] == self.fixed[:, None]).all(axis=0)
        return fits

    def read(self, characters: Characters) -> tuple[Mask, FrameBlock]:
        """(lines,) which lines are sound, all but the name of the bus; and the frames of all of them."""
        sound = np.ones(characters.shape[1], dtype=np.bool_)
        seconds = _number(_digits(characters[self.seconds], 10, sound), 10)
        ticks = seconds * _TICKS_PER_S + _number(_digits(characters[self.microseconds], 10, sound), 10)
        sound &= ticks < _EXACT_MAX
        kind, identifier = self._kind(_number(_digits(characters[self.identifier], 16, sound), 16), sound)
        if self.flags is not None:
            _digits(characters[self.flags], 16, sound)
        data = self._data(characters, sound)
        length = np.full(len(sound), (self.data.stop - self.data.start) // 2, dtype=np.uint8)
        return sound, FrameBlock(ticks / _TICKS_PER_S, identifier, kind, length, data)

    def _kind(self, number: NDArray[np.int64], sound: Mask) -> tuple[NDArray[np.uint8], NDArray[np.uint32]]:
        """Kind, and identifier without the flag of an error frame."""
        extended = self.identifier.stop - self.identifier.start == 8
        error = extended & (number & ERROR_FLAG != 0)
        identifier = number & ~ERROR_FLAG
        sound &= identifier <= (EXTENDED_MASK if extended else STANDARD_MASK)
        kind = np.where(error, ERROR, EXTENDED * extended) | FD * (self.flags is not None)
        return kind.astype(np.uint8), identifier.astype(np.uint32)

    def _data(self, characters: Characters, sound: Mask) -> NDArray[np.uint8]:
        width = CLASSIC_DATA_BYTES if self.flags is None else FD_DATA_BYTES
        data = np.zeros((len(sound), width), dtype=np.uint8)
        digits = _digits(characters[self.data], 16, sound)
        for place, octets in enumerate(digits[::2] << 4 | digits[1::2]):
            data[:, place] = octets
        return data


def _shape(line: bytes) -> _Shape | None:
    """The shape of a regular line."""
    matched = _REGULAR.fullmatch(line)
    if matched is None or (matched[_FLAGS] is None and len(matched[_DATA]) > 2 * CLASSIC_DATA_BYTES):
        return None
    fields = [slice(*matched.span(group)) for group in range(1, _DATA + 1)]
    among = {column for field in fields for column in range(field.start, field.stop)}
    between = [column for column in range(len(line)) if column not in among]
    seconds, microseconds, interface, identifier, flags, data = fields
    return _Shape(
        seconds,
        microseconds,
        interface,
        identifier,
        flags if matched[_FLAGS] else None,
        data,
        between,
        np.frombuffer(line, dtype=np.uint8)[between],
    )


def _digits(characters: Characters, radix: int, sound: Mask) -> Characters:
    """Values of digits; a line with another character is not sound."""
    decimal = characters - np.uint8(ord("0"))  # far above 9 for what is less: unsigned
    if radix == 10:
        sound &= (decimal < 10).all(axis=0)
        return decimal
    letter = (characters | np.uint8(0x20)) - np.uint8(ord("a"))  # capital and small ones differ in this bit
    sound &= ((decimal < 10) | (letter < 6)).all(axis=0)
    return (characters & np.uint8(0xF)) + (characters >> np.uint8(6)) * np.uint8(9)  # "A" is 0x41: 1 + 9


def _number(digits: Characters, radix: int) -> NDArray[np.int64]:
    """(lines,) what the digits say, the first one the highest. They are joined by twos first: two fit into a byte."""
    number = np.zeros(digits.shape[1], dtype=np.int64)
    if len(digits) % 2:
        number += digits[0]
        digits = digits[1:]
    for pair in digits[::2] * np.uint8(radix) + digits[1::2]:
        number = number * radix * radix + pair
    return number

"""Damage to valid input: what disks, wires and strangers do to bytes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random

INPUT_MAX = 8192  # bytes: long enough for many records, short enough to try thousands of inputs
EXTREMES = (b"\0", b"\xff", b"\x7f", b"\x80", b"\0" * 8, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b"\n")
_SPANS = (1, 1, 2, 3, 4, 8, 16, 60, 250)


@dataclass(frozen=True, slots=True)
class Damage:
    """One thing that happens to an input.

    Attributes:
        kind: a place in `KINDS`, taken modulo their number.
        place, other: where in the input, taken modulo its length.
        span: of how many bytes.
        filling: bytes that come in, where it is a kind that has some.
    """

    kind: int
    place: int
    other: int
    span: int
    filling: bytes = b""

    def done_to(self, data: bytes) -> bytes:
        """The damaged input, at most `INPUT_MAX` bytes of it."""
        place, other = self.place % (len(data) + 1), self.other % (len(data) + 1)
        return KINDS[self.kind % len(KINDS)](self, data, place, other)[:INPUT_MAX]


def _turned(damage: Damage, data: bytes, place: int, _: int) -> bytes:
    """One bit is another."""
    if place == len(data):
        return data
    return data[:place] + bytes([data[place] ^ 1 << damage.other % 8]) + data[place + 1 :]


def _written_over(damage: Damage, data: bytes, place: int, _: int) -> bytes:
    return data[:place] + damage.filling + data[place + len(damage.filling) :]


def _put_in(damage: Damage, data: bytes, place: int, _: int) -> bytes:
    return data[:place] + damage.filling + data[place:]


def _lost(damage: Damage, data: bytes, place: int, _: int) -> bytes:
    return data[:place] + data[place + damage.span :]


def _repeated(damage: Damage, data: bytes, place: int, other: int) -> bytes:
    """A piece is there once more, somewhere."""
    return data[:other] + data[place : place + damage.span] + data[other:]


def _moved(damage: Damage, data: bytes, place: int, other: int) -> bytes:
    piece, rest = data[place : place + damage.span], data[:place] + data[place + damage.span :]
    return rest[:other] + piece + rest[other:]


def _cut_off(_: Damage, data: bytes, place: int, __: int) -> bytes:
    return data[:place]


def _begun_late(_: Damage, data: bytes, place: int, __: int) -> bytes:
    return data[place:]


def _zeroed(damage: Damage, data: bytes, place: int, _: int) -> bytes:
    """What a disk gives back of a page that was never written."""
    size = len(data[place : place + damage.span])
    return data[:place] + bytes(size) + data[place + size :]


KINDS: tuple[Callable[[Damage, bytes, int, int], bytes], ...] = (
    _turned,
    _turned,
    _written_over,
    _written_over,
    _put_in,
    _lost,
    _repeated,
    _moved,
    _cut_off,
    _begun_late,
    _zeroed,
)


def random_damage(chance: Random, tokens: Sequence[bytes], others: Sequence[bytes]) -> Damage:
    """Some damage.

    Args:
        chance: where it comes from.
        tokens: of the format.
        others: inputs of the same format, of which pieces come in.
    """
    span = chance.choice(_SPANS)
    source = chance.choice(others)
    begin = chance.randrange(len(source) + 1)
    fillings = (chance.choice((*tokens, *EXTREMES)), chance.randbytes(min(span, 16)), source[begin : begin + span])
    places = chance.randrange(INPUT_MAX), chance.randrange(INPUT_MAX)
    return Damage(chance.randrange(len(KINDS)), *places, span, chance.choice(fillings))

"""Which frames may be put onto a real bus: what is named behind `--transmit`, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFilter, CanFrame

ALL = "all"
FORMS = (
    "identifiers in hex with all their digits, as candump shows them (three: 11 bits, eight: 29 bits): 7E0, a range "
    "7E0-7EF, a mask 14040A00:1FFFFF00; DroneCAN nodes in decimal: node:20, node:20-27; or all"
)
NODE_MASK = 0x7F  # a DroneCAN frame says in its last 7 bits whose it is
NODES = range(1, 128)
SHOWN = 8

_IDENTIFIER = re.compile(
    r"(?:0x)?([0-9A-F]{8}|[0-9A-F]{3})(?:([-:])(?:0x)?([0-9A-F]{8}|[0-9A-F]{3}))?", re.IGNORECASE
)
_NODE = re.compile(r"node:(\d{1,3})(?:-(\d{1,3}))?", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True, slots=True)
class IdentifierRange:
    """Identifiers of one kind, from `first` to `last`; of each, only the bits of `mask` count."""

    first: int
    last: int
    extended: bool
    mask: int = EXTENDED_MASK

    def matches(self, frame: CanFrame) -> bool:
        """Whether a frame's identifier is one of them."""
        return frame.extended == self.extended and self.first <= frame.identifier & self.mask <= self.last


@dataclass(frozen=True, slots=True)
class Transmission:
    """What `--transmit` allows.

    Attributes:
        text: as it was given.
        ranges: what it names; empty: all frames.
    """

    text: str
    ranges: tuple[IdentifierRange | CanFilter, ...] = ()

    @property
    def everything(self) -> bool:
        """Whether all frames may be sent."""
        return not self.ranges

    def allows(self, frame: CanFrame) -> bool:
        """Whether this frame may be sent. Error frames never are."""
        return not frame.error and (self.everything or any(one.matches(frame) for one in self.ranges))

    def lacking(self, frames: Iterable[CanFrame]) -> tuple[str, ...]:
        """Identifiers of those that may not be sent, as candump shows them, ascending, each once."""
        refused = {(frame.extended, frame.identifier) for frame in frames if not self.allows(frame)}
        return tuple(shown(identifier, extended) for extended, identifier in sorted(refused))


class TransmitGate:
    """Lets frames through that may be sent, and counts the others.

    Args:
        transmission: what may be sent.

    Attributes:
        refused: how many were not let through.
        identifiers: of the first few of them, as candump shows them.
    """

    def __init__(self, transmission: Transmission) -> None:
        self.refused = 0
        self.identifiers: dict[str, None] = {}
        self._transmission = transmission

    def passed(self, frames: Iterable[CanFrame]) -> list[CanFrame]:
        """Those that may be sent, in their order."""
        return [frame for frame in frames if self._passes(frame)]

    def line(self) -> str:
        """For the account at the end; "" where all were let through."""
        if not self.refused:
            return ""
        return f"{self.refused} frames not sent, for --transmit does not name them: {', '.join(self.identifiers)}"

    def _passes(self, frame: CanFrame) -> bool:
        if self._transmission.allows(frame):
            return True
        self.refused += 1
        if len(self.identifiers) < SHOWN:
            self.identifiers[shown(frame.identifier, frame.extended)] = None
        return False


def parse_transmission(text: str) -> Transmission:
    """Read what stands behind `--transmit`, separated by commas.

    A node is known by the last seven bits of its identifiers: on a bus with other protocols, name identifiers.

    Raises:
        ValueError: something in it is none of `FORMS`.
    """
    items = [item.strip() for item in text.split(",")]
    if [item.lower() for item in items] == [ALL]:
        return Transmission(text)
    return Transmission(text, tuple(_range(item) for item in items))


def shown(identifier: int, extended: bool) -> str:
    """An identifier as candump shows it."""
    return f"{identifier:08X}" if extended else f"{identifier:03X}"


def _range(item: str) -> IdentifierRange | CanFilter:
    if node := _NODE.fullmatch(item):
        return _nodes(item, int(node[1]), int(node[2] or node[1]))
    found = _IDENTIFIER.fullmatch(item)
    if found is None:
        if item.lower() == ALL:
            raise ValueError(f"--transmit: {ALL} stands alone, got it among others")
        raise ValueError(f"--transmit {item!r}: want {FORMS}")
    first, kind, last = found[1], found[2], found[3] or found[1]
    if len(first) != len(last):
        raise ValueError(f"--transmit {item!r}: both must have as many digits; want {FORMS}")
    return _identifiers(item, int(first, 16), kind, int(last, 16), extended=len(first) == 8)


def _nodes(item: str, first: int, last: int) -> IdentifierRange:
    if not (first in NODES and last in NODES and first <= last):
        raise ValueError(f"--transmit {item!r}: DroneCAN nodes lie in 1..127, the lower one first")
    return IdentifierRange(first, last, extended=True, mask=NODE_MASK)


def _identifiers(item: str, first: int, kind: str | None, last: int, extended: bool) -> IdentifierRange | CanFilter:
    limit = EXTENDED_MASK if extended else STANDARD_MASK
    if max(first, last) > limit:
        raise ValueError(f"--transmit {item!r}: must lie in {shown(0, extended)}..{shown(limit, extended)}")
    if kind == ":":
        return CanFilter(first, last, extended)
    if first > last:
        raise ValueError(f"--transmit {item!r}: the lower identifier stands first")
    return IdentifierRange(first, last, extended)

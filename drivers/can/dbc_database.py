"""Databases of vendor messages (DBC, KCD, SYM, ARXML), read by cantools: messages and signals by name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

import cantools
from cantools.database.can import Database, Message
from cantools.database.can import Signal as DatabaseSignal

from drivers.can.frame import FD_DATA_BYTES
from drivers.can.messages.bit_field import BitField, Kind
from drivers.can.messages.plan import MessageLayout
from drivers.can.messages.signal_reader import LARGEST, Signal, ends_of_range

SUFFIXES = (".dbc", ".kcd", ".sym", ".arxml")

_Named = TypeVar("_Named", Message, DatabaseSignal)


def load_database(path: Path) -> Database:
    """The database in a file.

    Raises:
        ValueError: the file cannot be read, or describes no CAN messages.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"database {path} should be named by its format: want {', '.join(SUFFIXES)} at its end")
    try:
        # Not strict: signals that overlap in some message that nobody uses are no reason to refuse the vendor's file.
        database = cantools.database.load_file(path, strict=False)
    except Exception as error:  # broken files make cantools raise whatever its parser stumbles over
        raise ValueError(f"database {path} cannot be read: {error}") from error
    if not isinstance(database, Database):
        raise ValueError(
            f"database {path} describes diagnostics, want one that describes CAN messages, such as a DBC"
        )
    return database


def find_signal(database: Database, reference: str) -> tuple[Message, DatabaseSignal]:
    """Message and signal of "Message.signal".

    Raises:
        ValueError: there is none of that name, or several; it says which is nearest.
    """
    message_name, dot, signal_name = reference.partition(".")
    if not dot:
        raise ValueError(f'want "Message.signal", got {reference!r}')
    message = _named(message_name, "message", database.messages)
    return message, _named(signal_name, f"signal of {message.name}", message.signals)


def _named(name: str, kind: str, candidates: Iterable[_Named]) -> _Named:
    candidates = [candidate for candidate in candidates if candidate.name]  # a KCD file may leave it out
    found = [candidate for candidate in candidates if candidate.name == name]
    if len(found) > 1:
        raise ValueError(f"{len(found)} times a {kind} is named {name!r}: keep one of them in the database")
    if found:
        return found[0]
    nearest = difflib.get_close_matches(name, [candidate.name for candidate in candidates], n=1, cutoff=0.0)
    hint = f", nearest is {nearest[0]!r}" if nearest else ""
    raise ValueError(f"no {kind} is named {name!r}{hint}")


def message_layout(message: Message) -> MessageLayout:
    """The frame of a message.

    Raises:
        ValueError: it is longer than a frame.
    """
    if message.length > FD_DATA_BYTES:
        raise ValueError(
            f"message {message.name} has {message.length} bytes: it takes several frames (a transport protocol), "
            "which are not put together; want a message of one frame"
        )
    return MessageLayout(message.frame_id, bool(message.is_extended_frame), message.length)


def compile_signal(
    message: Message, signal: DatabaseSignal, *, limits: bool = True, sentinels: bool = False
) -> Signal:
    """A signal for our readers.

    Args:
        message: which the signal is in.
        signal: as cantools read it.
        limits: True: values outside the range that the database gives are none.
        sentinels: True: the ends of the range of a wide integer mean "not available".

    Raises:
        ValueError: the signal does not fit into its message, or is none that a number can be read of.
    """
    try:
        field = _field(message, signal)
        lowest, highest = _limits(signal) if limits else (-LARGEST, LARGEST)
        return Signal(
            field,
            float(signal.conversion.scale),
            float(signal.conversion.offset),
            lowest,
            highest,
            _invalid(signal) | (ends_of_range(field) if sentinels else frozenset()),
            tuple(_selectors(message, signal)),
        )
    except ValueError as error:
        raise ValueError(f"{message.name}.{signal.name}: {error}: mend the database") from error


def _field(message: Message, signal: DatabaseSignal) -> BitField:
    big = signal.byte_order == "big_endian"
    # Big endian: cantools gives the highest bit, its number counted within its byte from the lowest.
    first = signal.start // 8 * 8 + 7 - signal.start % 8 if big else signal.start
    kind: Kind = "float" if signal.conversion.is_float else "signed" if signal.is_signed else "unsigned"
    field = BitField(first, signal.length, big, kind)
    if field.end > 8 * message.length:
        raise ValueError(f"it ends at bit {field.end}, its message has {8 * message.length}")
    return field


def _limits(signal: DatabaseSignal) -> tuple[float, float]:
    """Range that the database gives, wider by half a step for rounding; all finite numbers where it gives none."""
    slack = abs(float(signal.conversion.scale)) / 2.0
    lowest = -LARGEST if signal.minimum is None else float(signal.minimum) - slack
    highest = LARGEST if signal.maximum is None else float(signal.maximum) + slack
    return lowest, highest


def _invalid(signal: DatabaseSignal) -> frozenset[float]:
    """The raw number that the database calls invalid."""
    return frozenset() if signal.raw_invalid is None else frozenset({signal.raw_invalid})


def _selectors(message: Message, signal: DatabaseSignal) -> Iterable[tuple[BitField, frozenset[int]]]:
    """The multiplexers that must select the signal, each with the values that do; nested ones included."""
    passed = {signal.name}
    while signal.multiplexer_ids is not None and signal.multiplexer_signal is not None:
        wanted = frozenset(signal.multiplexer_ids)
        found = [one for one in message.signals if one.name == signal.multiplexer_signal]
        if not found:
            raise ValueError(f"there is no multiplexer {signal.multiplexer_signal}")
        signal = found[0]
        if signal.name in passed:
            raise ValueError(f"multiplexer {signal.name} selects itself")
        passed.add(signal.name)
        yield _field(message, signal), wanted

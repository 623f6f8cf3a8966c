"""Alive counters and checksums of vendor messages, made right again in frames that were changed or renumbered.

Which checksum a message has stands in no DBC file. It is found out from the frames themselves: of those that are
known here, the first that fits every frame that has come. What is summed up is all of the message but the checksum's
byte.
Source: AUTOSAR, Specification of CRC Routines (CRC8, SAE J1850, and CRC8H2F); sums and exclusive ors as usual.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import xor
from types import MappingProxyType

from cantools.database.can import Message
from cantools.database.can import Signal as DatabaseSignal
from crccheck.crc import Crc8Autosar, Crc8SaeJ1850

from drivers.can.dbc_database import compile_signal
from drivers.can.messages.bit_field import BitField
from hil_tests.wires.bit_writer import with_number

CHECKSUMS: Mapping[str, Callable[[bytes], int]] = MappingProxyType(
    {
        "crc8_j1850": Crc8SaeJ1850.calc,
        "crc8_autosar": Crc8Autosar.calc,
        "sum8": lambda data: sum(data) & 0xFF,
        "sum8_complement": lambda data: -sum(data) & 0xFF,
        "xor8": lambda data: reduce(xor, data, 0),
    }
)
COUNTER_NAME = re.compile(
    r"(alive|rolling|roll|message|msg|sequence|seq|frame|life)_?(counter|count|cntr|cnt|ctr)|^(alive|counter|cntr|seq)$",
    re.IGNORECASE,
)
CHECKSUM_NAME = re.compile(r"crc|check_?sum|chk_?sum|cksum|^chk$", re.IGNORECASE)
COUNTER_BITS_MAX = 16


@dataclass(frozen=True, slots=True)
class Protection:
    """What protects one message.

    Attributes:
        message: its name.
        length: of its data, in bytes.
        counter: where its alive counter is; None: it has none.
        counter_span: how many numbers that counts through, from 0.
        checksum: where its checksum is, one whole byte; None: it has none.
        algorithm: of the checksum, as in `CHECKSUMS`; None: found out.

    Raises:
        ValueError: a checksum that is not a byte, or an algorithm that is not known.
    """

    message: str
    length: int
    counter: BitField | None = None
    counter_span: int = 16
    checksum: BitField | None = None
    algorithm: str | None = None

    def __post_init__(self) -> None:
        if self.checksum is not None and (self.checksum.bits != 8 or self.checksum.first % 8):
            raise ValueError(f"checksum of {self.message} must be one whole byte, got {self.checksum}")
        if self.algorithm is not None and self.algorithm not in CHECKSUMS:
            raise ValueError(f"algorithm = {self.algorithm!r} of {self.message}: want one of {', '.join(CHECKSUMS)}")


def protection(message: Message, algorithm: str | None = None) -> Protection | None:
    """What protects a message, by the usual names of its signals; None: nothing.

    Args:
        message: as cantools read it.
        algorithm: of its checksum; None: found out.

    Raises:
        ValueError: see `Protection`.
    """
    counters = [one for one in message.signals if COUNTER_NAME.search(one.name) and _counts(one)]
    checksums = [one for one in message.signals if CHECKSUM_NAME.search(one.name)]
    if not counters and not checksums:
        return None
    return Protection(
        message.name,
        message.length,
        compile_signal(message, counters[0], limits=False).field if counters else None,
        _span(counters[0]) if counters else 16,
        compile_signal(message, checksums[0], limits=False).field if checksums else None,
        algorithm,
    )


def _counts(signal: DatabaseSignal) -> bool:
    plain = float(signal.conversion.scale) == 1.0 and float(signal.conversion.offset) == 0.0
    return plain and not signal.is_signed and 2 <= signal.length <= COUNTER_BITS_MAX


def _span(signal: DatabaseSignal) -> int:
    """Some begin anew before their bits are used up: AUTOSAR's goes from 0 to 14."""
    span = 1 << signal.length
    return span if signal.maximum is None else min(span, max(1, int(signal.maximum)) + 1)


class Seal:
    """Protects the frames of one message as their sender would.

    Args:
        protection: of the message.
        counts: frames whose checksum could not be made right are counted here.
    """

    def __init__(self, protection: Protection, counts: Counter[str]) -> None:
        self._protection = protection
        self._counts = counts
        self._candidates = list(CHECKSUMS) if protection.algorithm is None else [protection.algorithm]
        self.withheld = 0

    @property
    def renumbers(self) -> bool:
        """Whether counters are no longer those that came in."""
        return self._protection.counter is not None and self.withheld % self._protection.counter_span != 0

    def watch(self, data: bytes) -> None:
        """A frame as its sender protected it."""
        if self._protection.checksum is not None and self._protection.algorithm is None:
            self._candidates = [one for one in self._candidates if self._checksum(one, data) == data[self._place]]

    def sealed(self, data: bytes, changed: bool) -> bytes:
        """The frame with the counter that counts on from what has gone out, and the checksum that fits it."""
        counted = self._counted(data)
        if self._protection.checksum is None or (counted is data and not changed):
            return counted
        if not self._candidates:
            self._counts[f"checksum of {self._protection.message} not known, left as it was"] += 1
            return counted
        return self._with_checksum(counted)

    @property
    def _place(self) -> int:
        return 0 if self._protection.checksum is None else self._protection.checksum.first // 8

    def _checksum(self, algorithm: str, data: bytes) -> int:
        covered = data[: self._place] + data[self._place + 1 : self._protection.length]
        return CHECKSUMS[algorithm](covered)

    def _with_checksum(self, data: bytes) -> bytes:
        checksum = self._checksum(self._candidates[0], data)
        return data[: self._place] + bytes([checksum]) + data[self._place + 1 :]

    def _counted(self, data: bytes) -> bytes:
        counter, span = self._protection.counter, self._protection.counter_span
        if counter is None or not self.renumbers:
            return data
        number = int(counter.reader(len(data))(data))
        return data if number >= span else with_number(data, counter, (number - self.withheld) % span)

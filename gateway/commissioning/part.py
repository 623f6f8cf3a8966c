"""What commissioning has learnt of one subject: settings for the file, how sure they are, and what was missing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import isfinite
from typing import TypeAlias

from gateway.plotting.figure import Figure

Value: TypeAlias = "bool | int | float | str | list[Value]"


@dataclass(frozen=True, slots=True)
class Setting:
    """A key of the configuration file, and what it should be.

    Attributes:
        key: path of it, such as "navigation.dvl_delay_s" or "detector.thruster.caution".
        value: as TOML has it; numbers rounded to what is known of them.
        comment: that stands behind it, such as "+-0.02 s, of 14 turns"; one line.

    Raises:
        ValueError: a key that names no table, a comment of several lines, or a number that is not finite.
    """

    key: str
    value: Value
    comment: str = ""

    def __post_init__(self) -> None:
        if not all(self.key.split(".")) or "." not in self.key:
            raise ValueError(f"key = {self.key!r}: want the path of a key in a table, such as 'speed.tolerance'")
        if "\n" in self.comment:
            raise ValueError(f"comment = {self.comment!r}: want one line")
        if not _finite(self.value):
            raise ValueError(f"value of {self.key} = {self.value!r}: want finite numbers")


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something that was measured, in words for a row of a table.

    Attributes:
        name: such as "delay".
        value: with its unit, such as "0.061 s".
        sureness: how sure that is, and of what, such as "+-0.004 s, from 32 steps".
    """

    name: str
    value: str
    sureness: str = ""


@dataclass(frozen=True, slots=True)
class Part:
    """What was learnt of one subject, or why nothing was.

    Attributes:
        subject: "thruster 3", "speed", "navigation".
        settings: for the file; empty where something is missing.
        removed: keys that contradict these settings, and are to be taken out of the file where they are in it.
        quantities: what was measured, also where that is not enough.
        missing: what is missing for a sound result, each with the way out, such as "astern was never commanded beyond
            -20 %: drive back and forth for 30 s". Empty: all is well.
        remarks: what else the user should know.
        figures: of what it saw; x is not the time of a dive, unless they say so.
    """

    subject: str
    settings: tuple[Setting, ...] = ()
    removed: tuple[str, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    missing: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    figures: tuple[Figure, ...] = ()

    def __post_init__(self) -> None:
        if self.missing and self.settings:
            raise ValueError(f"{self.subject}: has settings, and misses {self.missing[0]!r}: want one or the other")


def told_once(parts: Iterable[Part], told: Callable[[Part], Iterable[str]]) -> Iterator[str]:
    """What is told of parts, with the subjects in front; what is the same of several is told once."""
    subjects: dict[str, list[str]] = {}
    for part in parts:
        for one in told(part):
            subjects.setdefault(one, []).append(part.subject)
    for one, several in subjects.items():
        yield f"{', '.join(several)}: {one}"


def _finite(value: Value) -> bool:
    if isinstance(value, list):
        return all(map(_finite, value))
    return not isinstance(value, float) or isfinite(value)

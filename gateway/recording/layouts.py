"""The layouts of what is recorded: frames, packets, the time, gaps, lines of a log, and any dataclass of ours."""

from __future__ import annotations

import types
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, fields
from enum import Enum, IntEnum, StrEnum
from functools import cache, partial
from math import isnan, nan
from typing import Any, Generic, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from gateway.recording.layout import BYTES, STRING, Field, Layout

PACKAGE = "thruster_gateway"
ValueT = TypeVar("ValueT")

_TIME = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
_HEADER = f"MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{'=' * 80}\n{_TIME}"
# can_msgs/msg/Frame of ROS 2: what its tools know
_CAN = (
    "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\nuint8[8] data\n"
    f"{'=' * 80}\n{_HEADER}"
)
_CAN_FD = (
    "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 len\nuint8[64] data\n"
    f"{'=' * 80}\n{_HEADER}"
)

PACKET = Layout(f"{PACKAGE}/msg/MavlinkBytes", (Field("time_s", "float64"), Field("data", BYTES)))
NOW = Layout(f"{PACKAGE}/msg/Now", (Field("time_s", "float64"),))
GAP = Layout(
    f"{PACKAGE}/msg/Gap",
    (Field("time_s", "float64"), Field("count", "int64"), Field("cause", STRING)),
)
# rcl_interfaces/msg/Log of ROS 2: what viewers show as a log
LOG = Layout(
    "rcl_interfaces/msg/Log",
    (
        Field("sec", "int32"),
        Field("nanosec", "uint32"),
        Field("level", "uint8"),
        Field("name", STRING),
        Field("msg", STRING),
        Field("file", STRING),
        Field("function", STRING),
        Field("line", "uint32"),
    ),
    "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n"
    "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n"
    f"{'=' * 80}\n{_TIME}",
)


@cache
def can_layout(bus: str, fd: bool) -> Layout:
    """Frames of one bus: its name is as long in each of them."""
    name = f"{PACKAGE}/msg/CanFdFrame" if fd else "can_msgs/msg/Frame"
    columns = (
        Field("sec", "int32"),
        Field("nanosec", "uint32"),
        Field("frame_id_size", "uint32"),
        Field("frame_id", "uint8", len(bus.encode()) + 1),
        Field("id", "uint32"),
        Field("is_rtr", "bool"),
        Field("is_extended", "bool"),
        Field("is_error", "bool"),
        Field("length", "uint8"),
        Field("data", "uint8", 64 if fd else 8),
    )
    return Layout(name, columns, _CAN_FD if fd else _CAN)


@dataclass(frozen=True, slots=True)
class Attribute:
    """How an attribute of a dataclass is written down, and what is made of it when it is read back."""

    column: Field
    written: Callable[[Any], Any] | None = None
    read: Callable[[Any], Any] | None = None


@dataclass(frozen=True, slots=True)
class ValueLayout(Generic[ValueT]):
    """The layout of a dataclass.

    Attributes:
        kind: the class.
        layout: of its messages; the fields of fixed size come first.
        attributes: in the order of the layout.
    """

    kind: type[ValueT]
    layout: Layout
    attributes: tuple[Attribute, ...]

    def values(self, value: ValueT) -> list[Any]:
        """What is written down of it, in the order of the layout."""
        return [
            getattr(value, one.column.name) if one.written is None else one.written(getattr(value, one.column.name))
            for one in self.attributes
        ]

    def columns(self, values: Sequence[ValueT]) -> dict[str, NDArray[Any]]:
        """The same of many, where the layout is of fixed size: an array for each field."""
        row = self.layout.row
        return {
            one.column.name: np.array([getattr(value, one.column.name) for value in values], dtype=row[name].base)
            for one in self.attributes
            for name in (one.column.name,)
        }

    def value(self, values: Sequence[Any]) -> ValueT:
        """The dataclass of such values."""
        named = zip(self.attributes, values, strict=True)
        return self.kind(**{a.column.name: v if a.read is None else a.read(v) for a, v in named})


def layout_of(kind: type[ValueT]) -> ValueLayout[ValueT]:
    """The layout of a dataclass of numbers, bools, texts, enumerations, and tuples of numbers.

    The message is called like the class, or as its `MESSAGE` says.

    None is written as NaN: of the values that are written so, none is ever NaN itself.

    Args:
        kind: the class.

    Raises:
        ValueError: an attribute that is none of these.
    """
    known: ValueLayout[ValueT] = _layout_of(cast(Hashable, kind))
    return known


@cache
def _layout_of(kind: Any) -> ValueLayout[Any]:
    hints = get_type_hints(kind)
    attributes = [_attribute(one.name, hints[one.name]) for one in fields(kind)]
    ordered = tuple(sorted(attributes, key=lambda one: not one.column.fixed))
    layout = Layout(f"{PACKAGE}/msg/{getattr(kind, 'MESSAGE', kind.__name__)}", tuple(one.column for one in ordered))
    return ValueLayout(kind, layout, ordered)


def _attribute(name: str, hint: Any) -> Attribute:
    inner = get_args(hint)
    if get_origin(hint) in (Union, types.UnionType) and len(inner) == 2 and type(None) in inner:
        return _optional(name, inner[0] if inner[1] is type(None) else inner[1])
    if get_origin(hint) is tuple:
        return _tuple(name, inner)
    if isinstance(hint, type):
        if issubclass(hint, StrEnum):
            return Attribute(Field(name, STRING), str, hint)
        if issubclass(hint, IntEnum):
            return Attribute(Field(name, "int64"), int, hint)
        if hint in _NUMBERS:
            return Attribute(Field(name, _NUMBERS[hint]))
        if hint is str:
            return Attribute(Field(name, STRING), _encodable)
    raise ValueError(f"{name}: want numbers, texts, enumerations and tuples of numbers, got {hint}")


_NUMBERS = {float: "float64", int: "int64", bool: "bool"}


def _optional(name: str, hint: Any) -> Attribute:
    if hint is str or (isinstance(hint, type) and issubclass(hint, Enum) and not issubclass(hint, IntEnum)):
        return Attribute(Field(name, STRING), lambda value: value or "", lambda text: hint(text) if text else None)
    if hint not in (float, int):
        raise ValueError(f"{name}: want a number or a text where it may be None, got {hint}")
    return Attribute(Field(name, "float64"), _nan_for_none, partial(_none_for_nan, hint))


def _tuple(name: str, inner: tuple[Any, ...]) -> Attribute:
    if len(inner) == 2 and inner[1] is Ellipsis and inner[0] in _NUMBERS:
        return Attribute(Field(name, _NUMBERS[inner[0]], None), None, tuple)
    if inner and len(set(inner)) == 1 and inner[0] in _NUMBERS:
        return Attribute(Field(name, _NUMBERS[inner[0]], len(inner)), None, tuple)
    raise ValueError(f"{name}: want a tuple of numbers, got one of {inner}")


def _encodable(text: str) -> str:
    """A text from the wire may hold half of a character pair, which UTF-8 has no bytes for."""
    return text.encode(errors="replace").decode()


def _nan_for_none(value: float | None) -> float:
    return nan if value is None else value


def _none_for_nan(hint: type[float] | type[int], value: float) -> float | None:
    return None if isnan(value) else hint(value)

"""Messages are laid out as ROS 2 lays them out, by an independent encoder of it."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum
from math import isnan, nan
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

from drivers.readings import Reading, ThrusterReport
from gateway.recording.layout import BYTES, STRING, Field, Layout, LayoutError
from gateway.recording.layouts import LOG, can_layout, layout_of

NUMBERS = {
    "float64": st.floats(allow_nan=False),
    "int64": st.integers(-(2**63), 2**63 - 1),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "uint8": st.integers(0, 255),
    "bool": st.booleans(),
}
TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)


class Colour(StrEnum):
    RED = "red"


class Number(IntEnum):
    SEVEN = 7


@dataclass(frozen=True, slots=True)
class Everything:
    name: str
    time_s: float
    near_m: float | None
    count: int | None
    colour: Colour
    other: Colour | None
    number: Number
    good: bool
    three: tuple[float, float, float]
    many: tuple[int, ...]


@st.composite
def messages(draw: st.DrawFn) -> tuple[Layout, list[Any]]:
    """A layout, and values for it."""
    fields, values = [], []
    for place in range(draw(st.integers(1, 8))):
        kind = draw(st.sampled_from([*NUMBERS, STRING, BYTES]))
        count = 1 if kind in (STRING, BYTES) else draw(st.sampled_from([1, 1, 3, None]))
        fields.append(Field(f"field{place}", kind, count))
        if kind in (STRING, BYTES):
            values.append(draw(TEXT if kind == STRING else st.binary(max_size=9)))
        elif count == 1:
            values.append(draw(NUMBERS[kind]))
        else:
            size = draw(st.integers(0, 4)) if count is None else count
            values.append(tuple(draw(st.lists(NUMBERS[kind], min_size=size, max_size=size))))
    return Layout("a_package/msg/Thing", tuple(fields)), values


@settings(max_examples=150, deadline=None, derandomize=True, database=None)
@given(messages())
def test_the_same_bytes_as_of_others(message):
    layout, values = message
    theirs = serialize_dynamic(layout.name, layout.text)[layout.name]
    named = {one.name: value for one, value in zip(layout.fields, values, strict=True)}
    ours = layout.encode(values)
    assert ours == theirs(named)
    assert layout.decode(ours) == values


@settings(max_examples=50, deadline=None, derandomize=True, database=None)
@given(messages())
def test_a_row_is_the_same_bytes(message):
    layout, values = message
    if not layout.fixed:
        with pytest.raises(ValueError, match="no fixed size"):
            _ = layout.row
        return
    rows = np.zeros(1, layout.row)
    rows["encapsulation"] = np.void(b"\0\1\0\0")
    for one, value in zip(layout.fields, values, strict=True):
        rows[one.name] = value
    assert rows.tobytes() == layout.encode(values)


@settings(max_examples=80, deadline=None, derandomize=True, database=None)
@given(messages(), st.data())
def test_other_bytes_are_no_message(message, data):
    layout, values = message
    encoded = layout.encode(values)
    cut = data.draw(st.integers(0, len(encoded) - 1))
    with pytest.raises(LayoutError):
        layout.decode(encoded[:cut])
    with pytest.raises(LayoutError):
        layout.decode(b"\0\0" + encoded[2:])


@pytest.mark.parametrize("kind", get_args(Reading))
def test_every_reading_has_a_layout(kind):
    layout = layout_of(kind).layout
    assert layout.name == f"thruster_gateway/msg/{kind.__name__}"
    assert generate_dynamic(layout.name, layout.text)
    fixed = [one.fixed for one in layout.fields]
    assert fixed == sorted(fixed, reverse=True)


def test_values_come_back_as_they_were():
    for value in (
        Everything("Grün", 1.5, None, None, Colour.RED, None, Number.SEVEN, True, (1.0, 2.0, 3.0), ()),
        Everything("", -1.5, 0.25, 2**40, Colour.RED, Colour.RED, Number.SEVEN, False, (0.0, 0.0, 0.0), (1, -2)),
    ):
        kind = layout_of(Everything)
        assert kind.value(kind.layout.decode(kind.layout.encode(kind.values(value)))) == value


def test_half_of_a_character_does_no_harm():
    kind = layout_of(Everything)
    odd = Everything("\udcff", 1.5, None, None, Colour.RED, None, Number.SEVEN, True, (1.0, 2.0, 3.0), ())
    assert kind.value(kind.layout.decode(kind.layout.encode(kind.values(odd)))).name == "?"


def test_many_at_once():
    kind = layout_of(ThrusterReport)
    columns = kind.columns([ThrusterReport(1.0, 2, 900.0), ThrusterReport(2.0, 3, None, 15.5, error_count=4)])
    assert columns["thruster"].tolist() == [2, 3]
    assert columns["speed_rpm"][0] == 900.0
    assert isnan(columns["speed_rpm"][1])
    assert columns["error_count"][1] == 4.0
    assert not np.isnan(columns["voltage_v"]).all()


@dataclass(frozen=True)
class WithList:
    values: list[float]


@dataclass(frozen=True)
class WithNested:
    values: tuple[str, float]


@dataclass(frozen=True)
class WithOptionalBool:
    good: bool | None = None


@pytest.mark.parametrize("kind", [WithList, WithNested, WithOptionalBool])
def test_what_has_no_layout_is_refused(kind):
    with pytest.raises(ValueError, match="want"):
        layout_of(kind)


@pytest.mark.parametrize(("kind", "count"), [("float16", 1), ("string", 3), ("bytes", None)])
def test_fields_that_cannot_be(kind, count):
    with pytest.raises(ValueError, match="name"):
        Field("name", kind, count)


@pytest.mark.parametrize("layout", [LOG, can_layout("can0", False), can_layout("can0", True)])
def test_the_layouts_of_others_are_as_they_know_them(layout):
    """A nested message is the same bytes as its fields."""
    values = {"float64": nan, STRING: "x"}
    encoded = layout.encode(
        [values.get(one.kind, 0) if one.count == 1 else bytes(one.count or 0) for one in layout.fields]
        if layout is LOG
        else [1, 2, 5, b"can0\0", 3, False, True, False, 8, bytes(one_of(layout))]
    )
    decoded = generate_dynamic(layout.name, layout.text)[layout.name](encoded)
    if layout is LOG:
        assert decoded.msg == "x"
    else:
        assert (decoded.header.stamp.nanosec, decoded.header.frame_id, decoded.is_extended) == (2, "can0", True)


def one_of(layout: Layout) -> int:
    """Bytes of data in a frame."""
    return layout.fields[-1].count or 0

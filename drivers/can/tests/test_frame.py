"""CAN frames and filters refuse what cannot be."""

import math

import pytest

from drivers.can.error_frame import BusCondition, condition
from drivers.can.frame import CanFilter, CanFrame


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"identifier": 0x800, "extended": False}, "standard identifier must lie in 0..0x7ff, got 0x800"),
        ({"identifier": 0x2000_0000}, "extended identifier must lie in 0..0x1fffffff"),
        ({"identifier": -1}, "identifier"),
        ({"data": bytes(9)}, "data must be at most 8 bytes, got 9"),
        ({"data": bytes(65), "fd": True}, "data must be at most 64 bytes, got 65"),
        ({"time_s": math.nan}, "time_s must be finite"),
        ({"time_s": math.inf}, "time_s must be finite"),
    ],
)
def test_an_impossible_frame_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        CanFrame(**({"time_s": 0.0, "identifier": 1, "data": b""} | options))


def test_an_impossible_filter_is_refused():
    with pytest.raises(ValueError, match="mask of a frame with standard identifier"):
        CanFilter(0x10, 0x1FFF, extended=False)


@pytest.mark.parametrize(
    ("frame", "matches"),
    [
        (CanFrame(0.0, 0x123, b""), True),
        (CanFrame(0.0, 0xF23, b""), True),
        (CanFrame(0.0, 0x124, b""), False),
        (CanFrame(0.0, 0x123, b"", extended=False), False),
        (CanFrame(0.0, 0x123, b"", error=True), False),
    ],
)
def test_a_filter_lets_through_what_is_wanted(frame, matches):
    assert CanFilter(0x123, 0xFF, extended=True).matches(frame) == matches


@pytest.mark.parametrize(
    ("classes", "detail", "said"),
    [
        (0x40, 0x00, BusCondition.BUS_OFF),
        (0x44, 0x10, BusCondition.BUS_OFF),
        (0x100, 0x00, BusCondition.RESTARTED),
        (0x4, 0x01, BusCondition.OVERFLOW),
        (0x4, 0x10, BusCondition.PASSIVE),
        (0x4, 0x20, BusCondition.PASSIVE),
        (0x4, 0x04, BusCondition.WARNING),
        (0x4, 0x40, BusCondition.ACTIVE),
        (0x4, 0x00, BusCondition.OTHER),
        (0x20, 0x00, BusCondition.NO_ACKNOWLEDGE),
        (0x8, 0x00, BusCondition.OTHER),
    ],
)
def test_an_error_frame_says_the_gravest_thing_it_knows(classes, detail, said):
    data = bytes([0, detail, 0, 0, 0, 0, 0, 0])
    assert condition(CanFrame(0.0, classes, data, extended=False, error=True)) == said


def test_an_error_frame_without_data_says_what_its_class_says():
    assert condition(CanFrame(0.0, 0x4, b"", extended=False, error=True)) == BusCondition.OTHER

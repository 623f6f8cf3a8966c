"""The kernel's frames, byte by byte, as python-can builds them."""

import can
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame
from hypothesis import given
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.can.socketcan import parse_packet


@given(st.booleans(), st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8))
def test_a_classic_frame(extended, identifier, data):
    identifier &= 0x1FFF_FFFF if extended else 0x7FF
    packet = build_can_frame(can.Message(arbitration_id=identifier, is_extended_id=extended, data=data))
    assert len(packet) == 16
    assert parse_packet(packet, 2.5) == CanFrame(2.5, identifier, data, extended)


@pytest.mark.parametrize("size", [0, 8, 12, 16, 20, 24, 32, 48, 64])
def test_a_frame_of_can_fd(size):
    data = bytes(range(size))
    packet = build_can_frame(can.Message(arbitration_id=0x123, data=data, is_fd=True))
    assert len(packet) == 72
    assert parse_packet(packet, 2.5) == CanFrame(2.5, 0x123, data, extended=True, fd=True)


def test_an_error_frame_keeps_its_class():
    packet = build_can_frame(
        can.Message(arbitration_id=0x40, is_extended_id=False, is_error_frame=True, data=bytes(8))
    )
    assert parse_packet(packet, 1.0) == CanFrame(1.0, 0x40, bytes(8), extended=False, error=True)


def test_a_remote_frame_is_none():
    packet = build_can_frame(can.Message(arbitration_id=0x40, is_remote_frame=True, dlc=3))
    assert parse_packet(packet, 1.0) is None

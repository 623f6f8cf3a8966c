"""Frames as the kernel has them: all that they are comes in and goes out again."""

from __future__ import annotations

import sys
from dataclasses import replace

import can
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame
from hypothesis import given
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.can.packets import packed as packed_by_driver
from hil_tests.bridge.bus_frame import BusFrame, packed, unpacked

BRS, ESI, FDF = 1, 2, 4

MESSAGES = {
    "standard": can.Message(arbitration_id=0x123, is_extended_id=False, data=[1, 2, 3]),
    "extended": can.Message(arbitration_id=0x1404_0A0B, data=range(8)),
    "empty": can.Message(arbitration_id=0, is_extended_id=False),
    "remote": can.Message(arbitration_id=0x123, is_extended_id=False, is_remote_frame=True, dlc=5),
    "remote extended": can.Message(arbitration_id=0x1FFF_FFFF, is_remote_frame=True, dlc=0),
    "CAN FD": can.Message(arbitration_id=0x456, is_extended_id=False, is_fd=True, data=range(12)),
    "CAN FD, fast": can.Message(arbitration_id=0x1404_0A0B, is_fd=True, bitrate_switch=True, data=range(64)),
    "CAN FD, passive": can.Message(
        arbitration_id=0x1404_0A0B, is_fd=True, bitrate_switch=True, error_state_indicator=True, data=[7]
    ),
}


def kernel_packet(message):
    """python-can fills the byte of the raw DLC in of shorter frames, too; the kernel has zero there."""
    packet = bytearray(build_can_frame(message))
    packet[7] = 0
    return bytes(packet)


@pytest.mark.parametrize("message", MESSAGES.values(), ids=MESSAGES)
def test_what_comes_in_goes_out_byte_by_byte(message):
    packet = kernel_packet(message)
    frame = unpacked(packet, 1.5)
    assert packed(frame) == packet
    assert (frame.identifier, frame.extended, frame.fd) == (
        message.arbitration_id,
        message.is_extended_id,
        message.is_fd,
    )
    assert frame.data == bytes(message.data)
    assert (frame.time_s, frame.error) == (1.5, False)


def test_a_usual_frame_is_a_plain_one():
    assert type(unpacked(kernel_packet(MESSAGES["extended"]), 0.0)) is CanFrame


def test_a_changed_frame_keeps_what_else_it_was():
    frame = unpacked(kernel_packet(MESSAGES["CAN FD, fast"]), 0.0)
    assert packed(replace(frame, data=b"new"))[:8] == (0x9404_0A0B).to_bytes(4, sys.byteorder) + bytes([3, 5, 0, 0])
    eight = BusFrame(0.0, 0x1, bytes(8), extended=False, raw_dlc=12)
    assert packed(eight)[4:8] == bytes([8, 0, 0, 12])
    assert packed(replace(eight, data=b"12"))[4:8] == bytes([2, 0, 0, 0])


def test_an_error_frame_is_told_from_data():
    error = (0x2000_0040).to_bytes(4, sys.byteorder) + b"\x08" + bytes(11)
    frame = unpacked(error, 0.0)
    assert frame.error and frame.identifier == 0x40
    assert packed(frame) == error == packed(CanFrame(0.0, 0x40, bytes(8), extended=False, error=True))


@given(st.binary(max_size=80))
def test_any_bytes_are_a_frame_or_none(packet):
    frame = unpacked(packet, 0.0)
    assert (frame is None) == (len(packet) not in (16, 72) or packet[4] > (8 if len(packet) == 16 else 64))


@given(st.booleans(), st.binary(max_size=8), st.booleans(), st.data())
def test_frames_that_faults_have_made_are_packed_as_the_driver_does(extended, content, fd, data):
    identifier = data.draw(st.integers(0, 0x1FFF_FFFF if extended else 0x7FF))
    frame = CanFrame(0.0, identifier, content, extended, fd)
    assert packed(frame) == packed_by_driver(frame)

"""Recorded packets as bytes again: read by pymavlink, and sent later than they were."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink import formats
from drivers.mavlink.frames import Packet
from hil_tests.dive_logs.packet_bytes import TICKS_PER_S, later, packet_bytes


def parsed(data: bytes) -> dialect.MAVLink_message:
    (message,) = dialect.MAVLink(None).parse_buffer(data)
    return message


def packet_of(message: dialect.MAVLink_message, sequence: int = 0) -> Packet:
    message.pack(dialect.MAVLink(None))
    return Packet(message.get_msgId(), 1, 1, bytes(message.get_payload()), sequence)


@given(roll=st.floats(-3, 3, width=32), boot_ms=st.integers(0, 2**32 - 1), sequence=st.integers(0, 255))
def test_a_packet_is_what_pymavlink_reads(roll, boot_ms, sequence):
    message = dialect.MAVLink_attitude_message(boot_ms, roll, 0.0, 0.0, 0.0, 0.0, 0.0)
    read = parsed(packet_bytes(packet_of(message, sequence)))
    assert (read.get_type(), read.time_boot_ms, read.roll, read.get_seq()) == ("ATTITUDE", boot_ms, roll, sequence)
    assert (read.get_srcSystem(), read.get_srcComponent()) == (1, 1)


def test_a_message_of_mavlink_2_alone_keeps_its_long_number():
    read = parsed(packet_bytes(packet_of(dialect.MAVLink_esc_telemetry_1_to_4_message(*[[1, 2, 3, 4]] * 6))))
    assert read.rpm == [1, 2, 3, 4]


def test_a_message_of_zeros_keeps_one_of_them():
    data = packet_bytes(packet_of(dialect.MAVLink_ping_message(0, 0, 0, 0)))
    assert data[1] == 1
    assert parsed(data).get_type() == "PING"


@pytest.mark.parametrize(
    ("message", "field", "by_s", "then"),
    [
        (dialect.MAVLink_attitude_message(5000, *[0.0] * 6), "time_boot_ms", 12.5, 17_500),
        (dialect.MAVLink_raw_imu_message(5_000_000, *[7] * 9), "time_usec", 12.5, 17_500_000),
        (dialect.MAVLink_servo_output_raw_message(2**32 - 1, 0, *[1500] * 8), "time_usec", 1e-6, 0),  # wraps round
        (dialect.MAVLink_system_time_message(1_700_000_000 * 10**6, 5), "time_unix_usec", 2.0, 1_700_000_002 * 10**6),
        (dialect.MAVLink_vision_position_delta_message(0, 100_000, [0.0] * 3, [0.1] * 3, 90.0), "time_usec", 9.0, 0),
    ],
)  # fmt: skip
def test_times_in_a_packet_count_on(message, field, by_s, then):
    after = parsed(packet_bytes(later(packet_of(message), by_s, 77)))
    assert getattr(after, field) == then
    assert after.get_seq() == 77
    for name in set(message.get_fieldnames()) - TICKS_PER_S.keys():
        assert getattr(after, name) == pytest.approx(getattr(message, name))


def test_px4s_esc_status_counts_on_as_well():
    payload = formats.ESC_STATUS.payload.pack(1_000_000, *[100] * 4, *[16.0] * 4, *[3.0] * 4, 4)
    after = later(Packet(formats.ESC_STATUS.message_id, 1, 1, payload), 2.0, 3)
    assert formats.ESC_STATUS.unpack(after.payload)[0] == 3_000_000
    assert after.payload[8:] == payload[8:]


def test_a_time_that_was_cut_off_is_found_again():
    """MAVLink 2 cuts zeros off: of a time since boot below 65.536 s only two bytes need be there."""
    message = dialect.MAVLink_system_time_message(0, 300)
    cut = packet_of(message)
    cut.payload = cut.payload.rstrip(b"\0")
    assert parsed(packet_bytes(later(cut, 70.0, 0))).time_boot_ms == 70_300

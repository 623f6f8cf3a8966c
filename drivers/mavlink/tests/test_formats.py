"""Layouts: the checksum byte of PX4's messages follows from their names and types by MAVLink's own rule."""

import pytest
from pymavlink.generator.mavcrc import x25crc

from drivers.mavlink import formats

ESC_STATUS_FIELDS = [
    ("uint64_t", "time_usec", 0), ("int32_t", "rpm", 4), ("float", "voltage", 4), ("float", "current", 4),
    ("uint8_t", "index", 0),
]  # fmt: skip
ESC_INFO_FIELDS = [
    ("uint64_t", "time_usec", 0), ("uint32_t", "error_count", 4), ("uint16_t", "counter", 0),
    ("uint16_t", "failure_flags", 4), ("int16_t", "temperature", 4), ("uint8_t", "index", 0), ("uint8_t", "count", 0),
    ("uint8_t", "connection_type", 0), ("uint8_t", "info", 0),
]  # fmt: skip


def crc_extra(name, fields):
    crc = x25crc()
    crc.accumulate_str(f"{name} ")
    for kind, field, length in fields:
        crc.accumulate_str(f"{kind} {field} ")
        if length:
            crc.accumulate([length])
    return (crc.crc & 0xFF) ^ (crc.crc >> 8)


@pytest.mark.parametrize(
    ("name", "fields", "message"),
    [("ESC_STATUS", ESC_STATUS_FIELDS, formats.ESC_STATUS), ("ESC_INFO", ESC_INFO_FIELDS, formats.ESC_INFO)],
)
def test_crc_extra_follows_from_the_fields(name, fields, message):
    assert message.crc_extra == crc_extra(name, fields)
    assert formats.CRC_EXTRA[message.message_id] == message.crc_extra


def test_esc_telemetry_covers_32_escs():
    assert [message.message_id for message in formats.ESC_TELEMETRY] == [
        11030, 11031, 11032, 11040, 11041, 11042, 11043, 11044,
    ]  # fmt: skip

"""Writes PX4 logs by struct, for tests, after the ULog file format of the PX4 user guide."""

from __future__ import annotations

import struct

MAGIC = b"ULog\x01\x12\x35\x01"
SYNC = bytes((0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))
ESC = (
    "uint64_t timestamp;uint32_t esc_errorcount;int32_t esc_rpm;"
    "float esc_voltage;float esc_current;float esc_temperature;"
)

# number: name, instance, fields, their kinds for struct
TOPICS: dict[int, tuple[str, int, str, str]] = {
    1: (
        "actuator_outputs",
        0,
        "uint64_t timestamp;uint32_t noutputs;float[16] output;uint8_t[4] _padding0;",
        "QI16f",
    ),
    2: (
        "actuator_outputs",
        1,
        "uint64_t timestamp;uint32_t noutputs;float[16] output;uint8_t[4] _padding0;",
        "QI16f",
    ),
    3: ("esc_status", 0, "uint64_t timestamp;uint8_t esc_count;esc_report[2] esc;", "QB" + 2 * "QIifff"),
    4: ("vehicle_attitude", 0, "uint64_t timestamp;float[4] q;", "Q4f"),
    5: ("vehicle_angular_velocity", 0, "uint64_t timestamp;float[3] xyz;", "Q3f"),
    6: (
        "vehicle_local_position",
        0,
        "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;bool xy_valid;bool z_valid;",
        "Q6f2?",
    ),
    7: ("vehicle_global_position", 0, "uint64_t timestamp;double lat;double lon;float alt;", "Qddf"),
    8: ("sensor_combined", 0, "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;", "Q6f"),
    9: ("vehicle_visual_odometry", 0, "uint64_t timestamp;uint8_t velocity_frame;float[3] velocity;", "QB3f"),
    10: (
        "vehicle_status",
        0,
        "uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;bool failsafe;"
        "uint8_t system_type;uint8_t system_id;",
        "QBB?BB",
    ),
    11: ("vehicle_gps_position", 0, "uint64_t timestamp;uint64_t time_utc_usec;uint8_t fix_type;", "QQB"),
    12: ("cpuload", 0, "uint64_t timestamp;float load;", "Qf"),
    13: ("actuator_motors", 0, "uint64_t timestamp;float[12] control;", "Q12f"),
}


def message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def flags(*appended: int, unknown: int = 0) -> bytes:
    offsets = (*appended, 0, 0, 0)[:3]
    return message("B", bytes(8) + bytes([bool(appended) | unknown]) + bytes(7) + struct.pack("<3Q", *offsets))


def definitions(*without: int) -> bytes:
    """Header, formats and announcements; topics may be left out."""
    topics = {number: topic for number, topic in TOPICS.items() if number not in without}
    described = {name: fields for name, _, fields, _ in topics.values()}
    formats = [f"esc_report:{ESC}", *(f"{name}:{fields}" for name, fields in described.items())]
    return b"".join(
        (
            MAGIC + struct.pack("<Q", 1000),
            flags(),
            *(message("F", one.encode()) for one in formats),
            message("I", bytes([len(b"char[3] sys_name")]) + b"char[3] sys_namePX4"),
            *(message("A", struct.pack("<BH", one[1], number) + one[0].encode()) for number, one in topics.items()),
        )
    )


def data(number: int, *values: float) -> bytes:
    """A message of a topic; values that are not given are 0."""
    layout = struct.Struct("<" + TOPICS[number][3])
    filled = [*values, *([0] * (len(layout.unpack(bytes(layout.size))) - len(values)))]
    return message("D", struct.pack("<H", number) + layout.pack(*filled))


def sync() -> bytes:
    return message("S", SYNC)


def text(words: str, boot_us: int = 0) -> bytes:
    return message("L", struct.pack("<BQ", ord("6"), boot_us) + words.encode())

"""Small dataflash and PX4 logs with all that is read of them, written by struct."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

_HEAD = b"\xa3\x95"
_FMT = 128
_WIRE = {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}
_WIRE |= {"g": "e", "a": "64s"}


@dataclass(frozen=True, slots=True)
class DataflashType:
    """A type of records, and what one holds behind its time.

    Attributes:
        number, name: of the type.
        kinds: a letter for each field, the time's first.
        fields: their names.
        values: as they stand in the log, without the time.
    """

    number: int
    name: str
    kinds: str
    fields: str
    values: tuple[float | bytes, ...] = ()

    @property
    def head(self) -> bytes:
        """What every record begins with."""
        return _HEAD + bytes([self.number])

    @property
    def layout(self) -> struct.Struct:
        """Of a whole record."""
        return struct.Struct("<3s" + "".join(_WIRE.get(kind, kind) for kind in self.kinds))

    def description(self) -> bytes:
        """The FMT record."""
        texts = (self.name.encode(), self.kinds.encode(), self.fields.encode())
        return struct.pack("<2sBBB4s16s64s", _HEAD, _FMT, self.number, self.layout.size, *texts)

    def record(self, time_us: int) -> bytes:
        """One of them."""
        return self.layout.pack(self.head, time_us, *self.values)


DATAFLASH_TYPES = (
    DataflashType(125, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn", (19, 19, 1)),
    DataflashType(203, "ARM", "QBI", "TimeUS,ArmState,ArmChecks", (1, 0)),
    DataflashType(94, "RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4", (1600, 1500, 1400, 1300)),
    DataflashType(114, "ESC", "QBffffc", "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp", (0, 900, 900, 16, 3, 3000)),
    DataflashType(100, "ATT", "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw", (0, 100, 0, 200, 0, 9000)),
    DataflashType(118, "GPS", "QBBIHLLe", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Alt", (0, 3, 1000, 2200, 1, 2, 3)),
    DataflashType(162, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", (0, 0, 0, 0, 0, 0, -9.8)),
    DataflashType(103, "RATE", "Qffffff", "TimeUS,RDes,R,PDes,P,YDes,Y", (0, 1, 0, 2, 0, 3)),
    DataflashType(96, "BARO", "QBffc", "TimeUS,I,Alt,Press,Temp", (1, -5, 150_000, 1200)),
    DataflashType(189, "VISO", "Qfffffffff", "TimeUS,dt,AngDX,AngDY,AngDZ,PosDX,PosDY,PosDZ,conf,x", (0.1,) * 9),
    DataflashType(174, "RPM", "Qff", "TimeUS,rpm1,rpm2", (900, 800)),
    DataflashType(76, "XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD", (0, 0.1, 0.2, 0, 1, 2, 3)),
    DataflashType(79, "XKF4", "QBbHBIHb", "TimeUS,C,SV,FS,TS,SS,GPS,PI", (0, 1, 0, 0, 1, 0, 0)),
    DataflashType(102, "POS", "QLLf", "TimeUS,Lat,Lng,Alt", (437_000_000, 73_000_000, -5)),
    DataflashType(198, "EV", "QB", "TimeUS,Id", (10,)),
)


def dataflash_log(types: Sequence[DataflashType], rounds: int = 4) -> bytes:
    """A log of these types, a tenth of a second from one round to the next."""
    parameter = DataflashType(64, "PARM", "QNf", "TimeUS,Name,Value", (b"SYSID_THISMAV", 3.0))
    records = [one.record(1_000_000 + 100_000 * number) for number in range(rounds) for one in types]
    return b"".join([dataflash_head([parameter, *types]), parameter.record(0), *records])


def dataflash_head(types: Sequence[DataflashType]) -> bytes:
    """What a log begins with: it describes itself."""
    itself = DataflashType(_FMT, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    return b"".join(one.description() for one in (itself, *types))


# name, fields, layout, values behind the time
_ESC = "uint64_t timestamp;uint32_t esc_errorcount;int32_t esc_rpm;float esc_voltage;float esc_current;"
ULOG_TOPICS: tuple[tuple[str, str, str, tuple[float, ...]], ...] = (
    (
        "vehicle_status",
        "uint8_t arming_state;uint8_t nav_state;uint8_t system_type;uint8_t system_id;",
        "4B",
        (2, 1, 12, 3),
    ),
    (
        "actuator_outputs",
        "uint32_t noutputs;float[4] output;uint8_t[4] _padding0;",
        "I4f",
        (4, 1600, 1500, 1400, 1300),
    ),
    ("actuator_motors", "float[4] control;", "4f", (0.1, 0.2, -0.3, float("nan"))),
    ("esc_status", "uint8_t esc_count;esc_report[1] esc;", "BQIiff", (1, 1_000_000, 0, 900, 16.0, 3.0)),
    ("vehicle_attitude", "float[4] q;", "4f", (1, 0, 0, 0)),
    ("vehicle_angular_velocity", "float[3] xyz;", "3f", (0.1, 0.2, 0.3)),
    ("sensor_combined", "float[3] gyro_rad;float[3] accelerometer_m_s2;", "6f", (0, 0, 0, 0, 0, -9.8)),
    ("vehicle_local_position", "float x;float y;float z;float vx;float vy;float vz;", "6f", (1, 2, 3, 0.1, 0.2, 0)),
    ("vehicle_global_position", "double lat;double lon;float alt;", "ddf", (43.7, 7.3, -5)),
    ("vehicle_visual_odometry", "uint8_t velocity_frame;float[3] velocity;", "B3f", (3, 0.1, 0.2, 0.3)),
    ("vehicle_gps_position", "uint64_t time_utc_usec;uint8_t fix_type;", "QB", (1_700_000_000_000_000, 3)),
)


def ulog_log(rounds: int = 3) -> bytes:
    """A log of all topics, a tenth of a second from one round to the next."""
    data = [
        struct.pack("<HQ" + layout, number, 1_000_000 + 100_000 * turn, *values)
        for turn in range(rounds)
        for number, (_, _, layout, values) in enumerate(ULOG_TOPICS)
    ]
    return b"".join(
        [
            ulog_head([(name, fields) for name, fields, _, _ in ULOG_TOPICS]),
            *(ulog_message("D", one) for one in data),
            ulog_message("S", bytes((0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))),
            ulog_message("L", struct.pack("<BQ", ord("6"), 1_000_000) + b"armed"),
        ]
    )


def ulog_head(topics: Sequence[tuple[str, str]]) -> bytes:
    """What a log begins with: formats and announcements of topics of these names and fields."""
    formats = [f"esc_report:{_ESC}", *(f"{name}:uint64_t timestamp;{fields}" for name, fields in topics)]
    added = [struct.pack("<BH", 0, number) + name.encode() for number, (name, _) in enumerate(topics)]
    return b"".join(
        [
            b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1000),
            ulog_message("B", bytes(40)),
            *(ulog_message("F", one.encode()) for one in formats),
            *(ulog_message("A", one) for one in added),
        ]
    )


def ulog_message(kind: str, body: bytes) -> bytes:
    """As it stands in a log."""
    return struct.pack("<HB", len(body), ord(kind)) + body

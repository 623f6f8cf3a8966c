"""Dataflash logs: records to readings by our reader, and to message objects by pymavlink's.

Both read every record of the log; pymavlink is asked for messages of the types that our readings come from.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from functools import cache
from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pymavlink.DFReader import DFReader_binary

from drivers.command import CommandScale
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import read_dataflash
from drivers.logs.dataflash_format import FORMAT_TYPE, HEAD
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.readings import Attitude, Reading, ThrusterCommand
from hil_tests.bench.timing import Comparison

DIVE_S = 60
RATE_HZ = 10  # of ArduSub's logs, but for the inertial unit
IMU_RATE_HZ = 25
PULSES = CommandScale(1100.0, 1500.0, 1900.0)
THRUSTERS = [MavlinkThruster(one, servo_channel=one, command_scale=PULSES, esc_index=one - 1) for one in range(1, 7)]
READ = ("RCOU", "ESC", "ATT", "RATE", "IMU", "BARO", "XKF1", "XKF4", "POS", "MODE", "ARM", "EV")

# name: type, kinds of the fields, their names, their layout; as ArduSub 4.5 writes them
_TYPES: dict[str, tuple[int, str, str, str]] = {
    "FMT": (FORMAT_TYPE, "BBnNZ", "Type,Length,Name,Format,Columns", "BB4s16s64s"),
    "ARM": (203, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method", "QBIBB"),
    "MODE": (125, "QMBB", "TimeUS,Mode,ModeNum,Rsn", "QBBB"),
    "IMU": (162, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "QBffffff"),
    "ATT": (100, "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw", "QhhhhHH"),
    "RATE": (103, "Qffffff", "TimeUS,RDes,R,PDes,P,YDes,Y", "Qffffff"),
    "XKF1": (76, "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD", "QBffffff"),
    "RCOU": (94, "Q" + 14 * "H", "TimeUS," + ",".join(f"C{place}" for place in range(1, 15)), "Q14H"),
    "ESC": (114, "QBffffc", "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp", "QBffffh"),
    "BARO": (96, "QBffc", "TimeUS,I,Alt,Press,Temp", "QBffh"),
    "CTRL": (253, "Qfffff", "TimeUS,RMSRollP,RMSRollD,RMSPitchP,RMSPitchD,RMSYaw", "Qfffff"),
    "MAG": (117, "Qhhhhhhhhh", "TimeUS,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ", "Q9h"),
}


def dataflash() -> Comparison:
    """A dive's log, with all that the gateway reads and some of what it does not."""
    path = _log()

    def ours() -> list[Reading]:
        return [one for batch in read_dataflash(path, THRUSTERS, DamageReport(), True) for one in batch]

    def theirs() -> list[Any]:
        reader = DFReader_binary(str(path))
        messages: list[Any] = []
        while (message := reader.recv_match(type=set(READ))) is not None:
            messages.append(message)
        reader.filehandle.close()
        return messages

    def agree(readings: list[Reading], messages: list[Any]) -> bool:
        commands = [one.fraction for one in readings if isinstance(one, ThrusterCommand) and one.thruster == 1]
        rolls = [round(one.roll_rad, 9) for one in readings if isinstance(one, Attitude)]
        return commands == [PULSES.fraction(m.C1) for m in messages if m.get_type() == "RCOU"] and rolls == [
            round(radians(m.Roll), 9) for m in messages if m.get_type() == "ATT"
        ]

    records = sum(1 for _ in _records())
    return Comparison("dataflash log to readings", "pymavlink DFReader", "record", records, ours, theirs, agree)


@cache
def _folder() -> TemporaryDirectory[str]:
    """Kept until the process ends."""
    return TemporaryDirectory()


def _log() -> Path:
    path = Path(_folder().name) / "dive.BIN"
    path.write_bytes(b"".join(_records()))
    return path


def _records() -> Iterator[bytes]:
    for name, (number, kinds, fields, layout) in _TYPES.items():
        described = (number, struct.calcsize("<3x" + layout), name.encode(), kinds.encode(), fields.encode())
        yield _record("FMT", *described)
    yield _record("MODE", 1000, 19, 19, 1)
    yield _record("ARM", 1000, 1, 0, 0, 0)
    for tick in range(DIVE_S * IMU_RATE_HZ):
        time_us = 1_000_000 + tick * 1_000_000 // IMU_RATE_HZ
        yield _record("IMU", time_us, 0, 0.01, 0.02, 0.03, 0.1, 0.2, -9.8)
        if tick * RATE_HZ % IMU_RATE_HZ < RATE_HZ:
            yield from _slower(time_us, tick)


def _slower(time_us: int, tick: int) -> Iterator[bytes]:
    yield _record("RATE", time_us, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0)
    yield _record("ATT", time_us, 0, tick % 900, 0, -300, 0, tick % 36_000)
    yield _record("XKF1", time_us, 0, 0.1, 0.2, 0.0, 0.01 * tick, 2.0, 3.0)
    yield _record("RCOU", time_us, *(1100 + (7 * tick + 50 * output) % 800 for output in range(14)))
    yield _record("BARO", time_us, 0, 0.0, 101_325.0, 2500)
    yield _record("BARO", time_us, 1, -5.0, 150_000.0, 1200)
    yield _record("CTRL", time_us, 0.1, 0.2, 0.3, 0.4, 0.5)
    yield _record("MAG", time_us, 1, 2, 3, 4, 5, 6, 7, 8, 9)
    for esc in range(len(THRUSTERS)):
        rpm = 1000.0 + (3 * tick + esc) % 500
        yield _record("ESC", time_us, esc, rpm, rpm, 15.5, 2.5, 3000)


def _record(name: str, *values: int | float | bytes) -> bytes:
    number, _, _, layout = _TYPES[name]
    return struct.pack("<2sB" + layout, HEAD, number, *values)

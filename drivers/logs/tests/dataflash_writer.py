"""Writes dataflash logs by struct, for tests: ArduPilot's own formats, and whatever values a test wants in them."""

from __future__ import annotations

import struct
from collections.abc import Sequence

# name: type, kinds of the fields, their names; as ArduSub 4.1 and later write them
FORMATS: dict[str, tuple[int, str, str]] = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "PARM": (64, "QNf", "TimeUS,Name,Value"),
    "MSG": (91, "QZ", "TimeUS,Message"),
    "RCOU": (94, "Q" + 14 * "H", "TimeUS," + ",".join(f"C{n}" for n in range(1, 15))),
    "RCO2": (95, "Q" + 4 * "H", "TimeUS," + ",".join(f"C{n}" for n in range(15, 19))),
    "BARO": (96, "QBffcfIffB", "TimeUS,I,Alt,Press,Temp,CRt,SMS,Offset,GndTemp,Health"),
    "ATT": (100, "QccccCCCCB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF"),
    "POS": (102, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "RATE": (103, "Qffffff", "TimeUS,RDes,R,PDes,P,YDes,Y"),
    "ESC": (
        114,
        "QBffffcfcf",
        "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp,CTot,MotTemp,Err",
    ),
    "GPS": (118, "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
    "MODE": (125, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "IMU": (162, "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"),
    "RPM": (174, "Qff", "TimeUS,rpm1,rpm2"),
    "VISO": (189, "Qffffffff", "TimeUS,dt,AngDX,AngDY,AngDZ,PosDX,PosDY,PosDZ,conf"),
    "EV": (198, "QB", "TimeUS,Id"),
    "ARM": (203, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "NKF1": (66, "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH"),
    "XKF1": (76, "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH"),
    "XKF4": (79, "QBcccccfffHBIHb", "TimeUS,C,SV,SP,SH,SM,SVT,errRP,OFN,OFE,FS,TS,SS,GPS,PI"),
}
_PACKED = {"M": "B", "n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i"}
_SCALES = {"c": 100, "C": 100, "e": 100, "E": 100, "L": 10_000_000}


def layout(kinds: str) -> struct.Struct:
    """Of a record with its head."""
    return struct.Struct("<3s" + "".join(_PACKED.get(kind, kind) for kind in kinds))


def record(name: str, *values: float | str) -> bytes:
    """A record with these values, in their documented units; those not given are 0."""
    number, kinds, _ = FORMATS[name]
    filled: Sequence[float | str] = (*values, *([0] * (len(kinds) - len(values))))
    wire = [_wire(kind, value) for kind, value in zip(kinds, filled, strict=True)]
    return layout(kinds).pack(b"\xa3\x95" + bytes([number]), *wire)


def _wire(kind: str, value: float | str) -> bytes | float | int:
    if kind in "nNZ":
        return str(value or "").encode()
    if kind in "fdg":
        return float(value)
    return round(float(value) * _SCALES.get(kind, 1))


def description(name: str) -> bytes:
    """The FMT record of a type."""
    number, kinds, names = FORMATS[name]
    return record("FMT", number, layout(kinds).size, name, kinds, names)


def heading(*parameters: tuple[str, float]) -> bytes:
    """What a log of ArduSub begins with."""
    return b"".join(
        (
            *map(description, FORMATS),
            *(record("PARM", 0, name, value) for name, value in parameters),
            record("MSG", 0, "ArduSub V4.1.0 (89639005)"),
            record("MODE", 1, 19, 19, 1),
        )
    )

"""What an ArduSub says while it dives: packets as they come, packed by pymavlink, in the mix of a real log.

The rates are those that the ground station's log of a BlueROV2 shows: the autopilot's own streams, a ground station
with a joystick, a positioning system, a camera. What this product reads of them is about a third.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import sin
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

AUTOPILOT, GROUND, POSITIONING, CAMERA = (1, 1), (255, 190), (1, 220), (1, 100)
START_S = 1_700_000_000.0
BOOT_MS = 60_000
SERVOS, ESCS = 8, 4

# Hz, and who sends it; the heartbeat first, for nothing of an autopilot is read before it
_BY_RATE: Mapping[tuple[float, tuple[int, int]], str] = {
    (1.0, AUTOPILOT): "HEARTBEAT",
    (20.0, AUTOPILOT): "ATTITUDE AHRS2",
    (16.0, AUTOPILOT): "NAMED_VALUE_FLOAT",
    (11.6, AUTOPILOT): "VFR_HUD",
    (5.5, GROUND): "MANUAL_CONTROL",
    (3.8, POSITIONING): "GPS_INPUT",
    (3.0, AUTOPILOT): "SYSTEM_TIME GLOBAL_POSITION_INT AHRS HWSTATUS MOUNT_STATUS EKF_STATUS_REPORT "
    "LOCAL_POSITION_NED VIBRATION BATTERY_STATUS",
    (2.0, AUTOPILOT): "SCALED_PRESSURE2 SYS_STATUS POWER_STATUS MEMINFO NAV_CONTROLLER_OUTPUT MISSION_CURRENT "
    "SERVO_OUTPUT_RAW ESC_TELEMETRY_1_TO_4 RC_CHANNELS RAW_IMU SCALED_IMU2 SCALED_PRESSURE GPS_RAW_INT",
    (1.0, CAMERA): "CAMERA_CAPTURE_STATUS",
}
RATES = [(name, rate_hz, sender) for (rate_hz, sender), names in _BY_RATE.items() for name in names.split()]

# what the gateway asks for more often, where it watches thrusters, speed and navigation over MAVLink
ASKED_HZ = {
    "SERVO_OUTPUT_RAW": 20.0,
    "ESC_TELEMETRY_1_TO_4": 20.0,
    "GLOBAL_POSITION_INT": 10.0,
    "LOCAL_POSITION_NED": 10.0,
    "GPS_RAW_INT": 5.0,
}


@cache
def packets(seconds: float, asked: bool = False) -> tuple[tuple[float, bytes], ...]:
    """Time of reception (unix) and packet, in order. `asked`: with the rates that the gateway asks for."""
    rates = [ASKED_HZ.get(name, rate_hz) if asked else rate_hz for name, rate_hz, _ in RATES]
    due = sorted(
        (number / rate_hz + 1e-3 * place, name, sender)
        for place, ((name, _, sender), rate_hz) in enumerate(zip(RATES, rates, strict=True))
        for number in range(int(seconds * rate_hz))
    )
    senders = {sender: mavlink.MAVLink(None, *sender) for sender in (AUTOPILOT, GROUND, POSITIONING, CAMERA)}
    random = np.random.default_rng(1)
    return tuple(
        (START_S + at_s, packed(senders[sender], _message(name, at_s, random))) for at_s, name, sender in due
    )


def packed(sender: Any, message: Any) -> bytes:
    """A message, with the sender's next number."""
    data: bytes = message.pack(sender)
    sender.seq = (sender.seq + 1) % 256
    return data


def _message(name: str, at_s: float, random: np.random.Generator) -> Any:
    """One message, with values that are likely where they are read, and any others elsewhere."""
    kind = getattr(mavlink, f"MAVLink_{name.lower()}_message")
    known = _known(name, at_s)
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    return kind(*(known.get(one, _any(types[one], lengths[one], random)) for one in kind.fieldnames))


def _known(name: str, at_s: float) -> Mapping[str, Any]:
    boot_ms = BOOT_MS + round(1e3 * at_s)
    swing = sin(at_s)
    values: dict[str, Any] = {"time_boot_ms": boot_ms, "time_usec": 1000 * boot_ms}
    match name:
        case "HEARTBEAT":
            values |= {"type": mavlink.MAV_TYPE_SUBMARINE, "autopilot": mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA}
        case "SERVO_OUTPUT_RAW":
            values |= {f"servo{one}_raw": round(1500 + 300 * swing) if one <= SERVOS else 0 for one in range(1, 17)}
            values["port"] = 0
        case "ESC_TELEMETRY_1_TO_4":
            values |= {"rpm": [round(1500 + 900 * swing)] * ESCS, "count": [round(100 * at_s) % 65536] * ESCS}
        case "GPS_INPUT" | "GPS_RAW_INT" | "GLOBAL_POSITION_INT":
            values |= {"lat": 474_000_000 + round(1e3 * swing), "lon": 85_000_000, "fix_type": 3}
    return values


def _any(kind: str, length: int, random: np.random.Generator) -> Any:
    if kind == "char":
        return b"PilotGain"
    values = (
        random.uniform(-1.0, 1.0, max(length, 1))
        if kind in ("float", "double")
        else random.integers(0, 100, max(length, 1))
    )
    return values.tolist() if length else values.tolist()[0]

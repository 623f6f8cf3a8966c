"""What pilots call the modes that HEARTBEAT tells as numbers."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.readings import AutopilotHeartbeat
from gateway.supervision.autopilots import AutopilotKind, kind_of

# ArduSub/mode.h
ARDUSUB: Mapping[int, str] = {
    0: "STABILIZE",
    1: "ACRO",
    2: "ALT_HOLD",
    3: "AUTO",
    4: "GUIDED",
    7: "CIRCLE",
    9: "SURFACE",
    16: "POSHOLD",
    19: "MANUAL",
    20: "MOTOR_DETECT",
    21: "SURFTRAK",
}
# PX4_CUSTOM_MAIN_MODE (commander/px4_custom_mode.h), in bits 16 to 23
PX4: Mapping[int, str] = {
    1: "MANUAL",
    2: "ALTCTL",
    3: "POSCTL",
    4: "AUTO",
    5: "ACRO",
    6: "OFFBOARD",
    7: "STABILIZED",
}


def mode_name(heard: AutopilotHeartbeat) -> str:
    """In the autopilot's own words; "mode 42" where they are not known."""
    match kind_of(heard):
        case AutopilotKind.ARDUSUB:
            name = ARDUSUB.get(heard.custom_mode)
        case AutopilotKind.PX4:
            name = PX4.get(heard.custom_mode >> 16 & 0xFF)
        case _:
            name = None
    return name or f"mode {heard.custom_mode}"

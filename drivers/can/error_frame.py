"""What a CAN controller's error frame says of its bus.

Source: Linux include/uapi/linux/can/error.h. The error class is in the identifier, details of controller problems are
in data byte 1.
"""

from __future__ import annotations

from enum import Enum

from drivers.can.frame import CanFrame


class BusCondition(Enum):
    """A change that an error frame reports, in words."""

    BUS_OFF = "bus-off"
    RESTARTED = "restarted after bus-off"
    ACTIVE = "error active"
    PASSIVE = "error passive"
    WARNING = "error warning"
    OVERFLOW = "controller overflow"
    NO_ACKNOWLEDGE = "no acknowledgement"
    OTHER = "error frame"


# (bits, condition), the gravest first: a frame may say several things.
_CLASSES = (
    (0x40, BusCondition.BUS_OFF),
    (0x100, BusCondition.RESTARTED),
)
_CONTROLLER = 0x4
_CONTROLLER_STATES = (
    (0x03, BusCondition.OVERFLOW),
    (0x30, BusCondition.PASSIVE),
    (0x0C, BusCondition.WARNING),
    (0x40, BusCondition.ACTIVE),
)
_NO_ACKNOWLEDGE = 0x20


def condition(frame: CanFrame) -> BusCondition:
    """The gravest thing that an error frame says."""
    for bits, state in _CLASSES:
        if frame.identifier & bits:
            return state
    if frame.identifier & _CONTROLLER and len(frame.data) > 1:
        for bits, state in _CONTROLLER_STATES:
            if frame.data[1] & bits:
                return state
    return BusCondition.NO_ACKNOWLEDGE if frame.identifier & _NO_ACKNOWLEDGE else BusCondition.OTHER

"""The words of MAVLink's command protocol, as far as the simulated autopilots understand it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import isfinite

CUSTOM_MODE_ENABLED = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
FORCE = 21196.0  # param2 of COMPONENT_ARM_DISARM


class Command(IntEnum):
    """The MAV_CMD that act on the vehicle and are answered here."""

    NAV_LOITER_UNLIM = 17
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    DO_SET_MODE = 176
    DO_FLIGHTTERMINATION = 185
    COMPONENT_ARM_DISARM = 400


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of a command, and what the autopilot says to it (empty: nothing)."""

    result: Result
    text: str = ""


ACCEPTED = Answer(Result.ACCEPTED)


def whole(parameter: float) -> int:
    """A parameter that stands for a number of something; 0 where it is none."""
    return int(parameter) if isfinite(parameter) else 0

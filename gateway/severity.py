"""How urgent a text to the pilot is."""

from __future__ import annotations

from enum import IntEnum


class Severity(IntEnum):
    """MAV_SEVERITY, after RFC 5424. Ground stations pop up what is ERROR or worse, and only list the rest."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2  # onset of a fault, once
    ERROR = 3  # a failsafe action did not come about
    WARNING = 4  # a suspicion, a silence, a fault that goes on
    NOTICE = 5  # over
    INFO = 6
    DEBUG = 7  # never on the link

"""Speeds of which the course in between is lost: a straight line between them would be a fault of the thruster.

Where reports are lost while a thruster speeds up or slows down, nobody knows when it did, and a detector that is
shown a straight line, and commands of which some are lost as well, sees a thruster that does not follow. Such a place
must be a gap to the alignment, which makes nothing up across one: reports are withheld until it is as long as that.
"""

from __future__ import annotations

import math

from drivers.readings import ThrusterReport

# half a sample of the coarse ones that such thrusters get: the detector allows for so much by itself
KNOWN_S = 0.05
# relative change of the speed that matters by how it came about. Of 72 healthy dives of 160 s, commanded wildly and
# with 10 to 30 % of the frames lost, three had a false alarm without this rule, one at 0.1, none at 0.05
CHANGE = 0.05


class TornSpeeds:
    """Reports of one thruster that may be joined.

    Args:
        gap_s: reports further apart than this are not joined by the alignment.
    """

    def __init__(self, gap_s: float) -> None:
        self._gap_s = gap_s
        self._time_s, self._speed_rpm = -math.inf, 0.0
        self._withheld_until_s = -math.inf

    def admits(self, report: ThrusterReport) -> bool:
        """Whether to pass a report on; one without a speed always."""
        if report.speed_rpm is None:
            return True
        if self._tears(report.time_s, report.speed_rpm):
            self._withheld_until_s = self._time_s + self._gap_s
        # not so long: a clock that was set back begins anew
        if report.time_s <= self._withheld_until_s <= report.time_s + self._gap_s:
            return False
        self._time_s, self._speed_rpm = report.time_s, report.speed_rpm
        return True

    def _tears(self, time_s: float, speed_rpm: float) -> bool:
        apart = KNOWN_S < time_s - self._time_s <= self._gap_s
        larger_rpm = max(abs(speed_rpm), abs(self._speed_rpm))
        return apart and abs(speed_rpm - self._speed_rpm) > CHANGE * larger_rpm

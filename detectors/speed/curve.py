"""The normal speed over the command: as configured, or learnt by driving."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite

NEAR = 0.3  # between two points at most so far apart, a command is as good as learnt ...
REACH = 0.1  # ... and so far from a single one
BEYOND = 10.0  # no command is so far from another


@dataclass(frozen=True, slots=True)
class SpeedCurve:
    """Speed through the water that a healthy vehicle reaches at a command.

    Straight from point to point and to (0, 0); beyond the points, and astern where there are only points ahead (or
    the other way round), in proportion to the command of the nearest one.

    Attributes:
        commands: ascending, from -1 to 1, none of them 0.
        speeds_mps: with the signs of their commands.

    Raises:
        ValueError: no points, or not as said.
    """

    commands: tuple[float, ...]
    speeds_mps: tuple[float, ...]

    def __post_init__(self) -> None:
        points = list(zip(self.commands, self.speeds_mps, strict=False))
        if not points or len(self.commands) != len(self.speeds_mps):
            count = f"{len(self.commands)} commands and {len(self.speeds_mps)} speeds"
            raise ValueError(f"speed curve has {count}: want at least one command, and one speed for each")
        if any(
            not isfinite(speed) or not 0.0 < abs(command) <= 1.0 or command * speed <= 0.0
            for command, speed in points
        ):
            raise ValueError(
                f"speed curve = {points}: want commands from -1 to 1 but not 0, and speeds of the same signs"
            )
        if any(left >= right for left, right in pairwise(self.commands)):
            raise ValueError(f"speed curve's commands = {self.commands}: want them ascending")

    def speed_mps(self, command: float) -> float:
        """Normal speed at a command."""
        size = abs(command)
        inner = (0.0, 0.0)
        for known, speed_mps in self._from_zero(command > 0.0):
            if size <= abs(known):
                share = (size - abs(inner[0])) / (abs(known) - abs(inner[0]))
                return inner[1] + (speed_mps - inner[1]) * share
            inner = known, speed_mps
        if inner[0] == 0.0:  # only driven the other way
            inner = min(self._points(), key=lambda point: abs(point[0]))
        return command * inner[1] / inner[0]

    def _from_zero(self, ahead: bool) -> Iterator[tuple[float, float]]:
        """The points on one side, outwards."""
        points = self._points() if ahead else reversed(self._points())
        return (point for point in points if (point[0] > 0.0) is ahead)

    def covers(self, command: float) -> bool:
        """Whether the speed at a command is known by more than proportion."""
        above = min((known - command for known in self.commands if known >= command), default=BEYOND)
        below = min((command - known for known in self.commands if known <= command), default=BEYOND)
        return above + below <= NEAR or min(above, below) <= REACH

    def beyond(self, command: float) -> float:
        """How many times the greatest command that is known on its side; 0 where none is."""
        greatest = max((abs(known) for known in self.commands if known * command > 0.0), default=0.0)
        return abs(command) / greatest if greatest > 0.0 else 0.0

    def scaled(self, factor: float) -> SpeedCurve:
        """The same with all speeds times a factor above 0."""
        return SpeedCurve(self.commands, tuple(speed * factor for speed in self.speeds_mps))

    def with_point(self, command: float, speed_mps: float) -> SpeedCurve:
        """The same with one more point, in place of one at the same command."""
        points = dict(self._points()) | {command: speed_mps}
        return SpeedCurve(*zip(*sorted(points.items()), strict=True))

    def _points(self) -> list[tuple[float, float]]:
        return list(zip(self.commands, self.speeds_mps, strict=True))

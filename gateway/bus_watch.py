"""What is wrong with the nodes of a CAN bus, in the supervisor's terms.

A conflict is said again every 10 s by the driver while it lasts, and is over when it is not. That a node is well
again, it says itself: one that falls silent is not well.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from detectors.verdict import Level
from drivers.bus_readings import (
    BabblingNode,
    BusReading,
    CommanderConflict,
    EscConflict,
    Health,
    NodeHealth,
    NodeIdConflict,
    NodeMode,
)
from gateway.observation import Observation

LINK = "link"
# the driver says so again every 10 s while it lasts
OVER_S = 30.0
# over for this long, it is over for the supervisor, too
FORGOTTEN_S = 40.0
# whoever has just started may still be busy with that
STARTED_S = 10.0


class BusWatch:
    """Remembers what is wrong until it is over."""

    def __init__(self) -> None:
        self._conflicts: dict[str, Observation] = {}
        self._unwell: set[str] = set()

    def take(self, link: str, reading: BusReading, disarmed: bool) -> Iterator[Observation]:
        """What a node or the bus is, in the terms of the supervisor.

        Args:
            link: the bus.
            reading: what was seen on it.
            disarmed: whether the vehicle is known to be: then an ESC need not be ready.
        """
        if isinstance(reading, NodeHealth):
            yield from self._health(reading, disarmed)
        elif (observation := _conflict(link, reading)) is not None:
            self._conflicts[observation.subject] = observation
            yield observation

    def advance(self, time_s: float) -> Iterator[Observation]:
        """Takes a tick: what has not been said again is over."""
        for subject, seen in list(self._conflicts.items()):
            if time_s - seen.time_s > OVER_S:
                yield replace(seen, time_s=time_s, level=Level.NORMAL, trouble="")
            if time_s - seen.time_s > FORGOTTEN_S:
                del self._conflicts[subject]

    def _health(self, reading: NodeHealth, disarmed: bool) -> Iterator[Observation]:
        """Of a node that is the ESC of a thruster; that it is well is told only where it was not."""
        level, trouble = _unwell(reading, disarmed)
        for thruster in reading.thrusters:
            subject = f"thruster {thruster} node"
            if level is not Level.NORMAL:
                self._unwell.add(subject)
            if subject in self._unwell:
                yield _observation(reading.time_s, subject, f"T{thruster} ESC", level, trouble)


def _unwell(reading: NodeHealth, disarmed: bool) -> tuple[Level, str]:
    if reading.health >= Health.ERROR:
        level = Level.FAULT if reading.health is Health.CRITICAL else Level.SUSPECT
        return level, f"node {reading.node_id} says {reading.health.name}"
    if reading.mode is NodeMode.OPERATIONAL or disarmed or reading.uptime_s < STARTED_S:
        return Level.NORMAL, ""
    return Level.SUSPECT, f"node {reading.node_id} not ready: {reading.mode.name.lower().replace('_', ' ')}"


def _conflict(link: str, reading: BusReading) -> Observation | None:
    match reading:
        case EscConflict():
            subject, label = f"thruster {reading.thruster} esc index", f"T{reading.thruster} ESC"
            trouble = _claimed(reading)
        case CommanderConflict():
            subject, label = f"link {link} commands", f"{link} commands"
            trouble = f"from {_nodes(reading.node_ids)}"
        case NodeIdConflict():
            label = f"{link} node {reading.node_id}"
            subject, trouble = f"link {label}", "id used by two devices"
        case BabblingNode():
            label = f"{link} node {reading.node_id}"
            subject, trouble = f"link {label} rate", f"sends over {reading.frames_per_s} frames/s"
        case _:
            return None
    return _observation(reading.time_s, subject, label, Level.SUSPECT, trouble)


def _claimed(reading: EscConflict) -> str:
    """Who claims an ESC index; the nodes beside the right one, where that is known."""
    if reading.node_id is not None and reading.node_id not in reading.node_ids:
        return f"index {reading.esc_index} from {_nodes(reading.node_ids)}, want {reading.node_id}"
    return f"index {reading.esc_index} claimed by {_nodes(reading.node_ids)}"


def _nodes(node_ids: Sequence[int]) -> str:
    *rest, last = map(str, node_ids)
    return f"nodes {', '.join(rest)} and {last}" if rest else f"node {last}"


def _observation(time_s: float, subject: str, label: str, level: Level, trouble: str) -> Observation:
    return Observation(time_s, LINK, subject, label, level, math.nan, trouble)

"""How the nodes of a bus are, by what they say of themselves; and whether two of them use one node id."""

from __future__ import annotations

from dataclasses import dataclass, field

from drivers.bus_readings import BusReading, EscCondition, NodeHealth, NodeIdConflict
from drivers.can.dronecan.claims import CONFLICT_REPEAT_S, NODE_TIMEOUT_S
from drivers.can.dronecan.esc_status import EscStatusExtended
from drivers.can.dronecan.node_status import NodeStatus
from drivers.can.dronecan.reminder import Reminder
from drivers.can.dronecan.transfer import TRANSFER_ID_MASK

HEALTH_REPEAT_S = 5.0
# two messages that are less apart are one that came twice
SAME_S = 0.1
# uptime is in whole seconds, and clocks are not all the same
UPTIME_TOLERANCE_S = 1.5
# a message lost, or one out of order, is not yet a second device
RETURNS_MIN = 3
RETURNS_WITHIN_S = 10.0

KELVIN = 273.15


@dataclass(frozen=True, slots=True)
class _Said:
    """The newest message of one device: the next one counts on from it, in messages and in seconds."""

    time_s: float
    transfer_id: int
    uptime_s: int

    def precedes(self, later: _Said) -> bool:
        """Whether a later message may be the one after this."""
        passed_s = later.time_s - self.time_s
        return (
            later.transfer_id == (self.transfer_id + 1 & TRANSFER_ID_MASK)
            and 0.0 <= passed_s < NODE_TIMEOUT_S
            and abs(later.uptime_s - self.uptime_s - passed_s) <= UPTIME_TOLERANCE_S
        )

    def is_again(self, later: _Said) -> bool:
        """Whether a later message is this one, delivered twice."""
        return (self.transfer_id, self.uptime_s) == (later.transfer_id, later.uptime_s) and (
            0.0 <= later.time_s - self.time_s < SAME_S
        )


@dataclass(slots=True)
class _Node:
    """What is known of one node id.

    Two devices that use it count their messages apart. One that restarts or loses a message begins a new count, and
    never comes back to the old one: coming back again and again is the sign of two.
    """

    newest: _Said | None = None
    other: _Said | None = None
    returns: int = 0
    since_s: float = 0.0
    conflict: Reminder = field(default_factory=lambda: Reminder(CONFLICT_REPEAT_S))
    health: Reminder = field(default_factory=lambda: Reminder(HEALTH_REPEAT_S))

    def repeats(self, said: _Said) -> bool:
        return any(one is not None and one.is_again(said) for one in (self.newest, self.other))

    def is_two(self, said: _Said) -> bool:
        """Takes a message; whether there is no doubt now that two devices send them."""
        if self.newest is not None and self.newest.precedes(said):
            self.newest = said
            return False
        back = self.other is not None and self.other.precedes(said)
        self.newest, self.other = said, self.newest
        if not back:
            return False
        if not 0.0 <= said.time_s - self.since_s < RETURNS_WITHIN_S:
            self.returns, self.since_s = 0, said.time_s
        self.returns += 1
        return self.returns >= RETURNS_MIN


class NodeWatch:
    """Takes what nodes and ESCs say of themselves besides speeds, one message after the other."""

    def __init__(self) -> None:
        self._nodes: dict[int, _Node] = {}
        self._conditions: dict[int, Reminder] = {}
        self._node_of: dict[int, int] = {}

    def speaks_for(self, thruster: int, node: int) -> None:
        """A node speaks as the ESC of a thruster from now on."""
        self._node_of[thruster] = node

    def node_of(self, thruster: int) -> int | None:
        """The node that speaks as the ESC of a thruster; None: none yet."""
        return self._node_of.get(thruster)

    def status(self, node: int, transfer_id: int, status: NodeStatus, time_s: float) -> list[BusReading] | None:
        """Takes a NodeStatus; None: it came twice."""
        known = self._nodes.setdefault(node, _Node())
        said = _Said(time_s, transfer_id, status.uptime_s)
        if known.repeats(said):
            return None
        readings: list[BusReading] = []
        if known.is_two(said) and known.conflict.due(node, time_s):
            readings.append(NodeIdConflict(time_s, node))
        thrusters = tuple(sorted(number for number, owner in self._node_of.items() if owner == node))
        if known.health.due((status.health, status.mode, thrusters), time_s):
            readings.append(
                NodeHealth(time_s, node, status.health, status.mode, status.uptime_s, thrusters),
            )
        return readings

    def condition(self, thruster: int, status: EscStatusExtended, time_s: float) -> list[BusReading]:
        """Takes a StatusExtended of a thruster's ESC."""
        reminder = self._conditions.setdefault(thruster, Reminder(HEALTH_REPEAT_S))
        if not reminder.due(status.status_flags, time_s):
            return []
        celsius = status.motor_temperature_c
        return [
            EscCondition(
                time_s,
                thruster,
                status.input_percent,
                status.output_percent,
                celsius + KELVIN,
                status.status_flags,
            )
        ]

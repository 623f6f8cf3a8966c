"""What a simulated autopilot and its ESCs have to say on a CAN bus, whatever its protocol."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from drivers.can.frame import CanFrame
from hil_tests.rig.bus_clock import Unsent
from hil_tests.rig.dbc_nodes import Database, DbcCommander, DbcEscs
from hil_tests.rig.dronecan_nodes import DroneCanCommander, DroneCanEscs
from hil_tests.rig.esc_messages import EscReport
from hil_tests.rig.profile import Profile


class AutopilotNode(Protocol):
    """Commands the ESCs."""

    def publish(self, time_s: float, commands: Sequence[float]) -> list[Unsent]:
        """Frames that carry one command of -1 to 1 per thruster, and whatever else is due."""
        ...

    def restart(self) -> None:
        """It begins to count anew."""
        ...


class EscNodes(Protocol):
    """All ESCs of a bus; `place` is that in the profile, from 0."""

    def take(self, time_s: float, frames: Sequence[CanFrame]) -> None:
        """Frames have come."""
        ...

    def commands(self, time_s: float) -> list[float]:
        """What they apply now, -1 to 1 each; nothing where no command has come for too long."""
        ...

    def report(self, time_s: float, place: int, report: EscReport) -> list[Unsent]:
        """Frames of one that reports, and whatever else of it is due."""
        ...

    def restart(self, place: int) -> None:
        """One begins to count anew."""
        ...


def nodes_of(profile: Profile) -> tuple[AutopilotNode, EscNodes]:
    """Of a vehicle's bus.

    Raises:
        ValueError: its database lacks a signal.
    """
    if profile.database is not None:
        database = Database(profile.database, profile.bus.checksum)
        return DbcCommander(database, profile.thrusters), DbcEscs(database, profile.thrusters)
    places = range(len(profile.thrusters))
    indexes, node_ids = ([of(place) for place in places] for of in (profile.esc_index, profile.node_id))
    rated_power_w = [one.rated_power_w for one in profile.build().each_thruster]
    escs = DroneCanEscs(indexes, node_ids, rated_power_w)
    return DroneCanCommander(indexes, profile.bus.autopilot_node), escs

"""Which end of a bus a recorded frame came from: the autopilot's, which commands, or the devices', which report.

A log does not say. By the configuration: what carries commands is the autopilot's, and on a DroneCAN bus all else
that its node sends; the rest is the devices'. What the controller told of an error was told to who listens.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drivers.can.dbc_database import find_signal, load_database
from drivers.can.dronecan.setpoints import RAW_COMMAND, RPM_COMMAND
from drivers.can.dronecan.transfer import MESSAGE_MASK, SOURCE_MASK
from drivers.can.frame import CanFrame
from drivers.can.vesc_messages import Packet
from gateway.config import Config
from gateway.config_sections import CanBus
from hil_tests.wires.way import Towards

COMMAND_TYPES = frozenset({RAW_COMMAND.data_type.key, RPM_COMMAND.data_type.key})
VESC_COMMANDS = frozenset(packet for packet in Packet if packet.name.startswith("SET_"))

Side = Callable[[CanFrame], Towards]


def side_of(bus: CanBus, config: Config) -> Side:
    """Tells of each frame of a bus, in their order, where it was going.

    Raises:
        ValueError: the bus's database cannot be read, or has not the signals of the commands.
    """
    if bus.protocol == "dronecan":
        return DroneCanSides().towards
    if bus.protocol == "vesc":
        return _vesc_side
    commands = frozenset(_command_identifiers(bus, config))
    return lambda frame: Towards.DEVICES if frame.identifier in commands else Towards.AUTOPILOT


class DroneCanSides:
    """Knows the node that commands by its commands, from the first one on."""

    def __init__(self) -> None:
        self._commanders: set[int] = set()

    def towards(self, frame: CanFrame) -> Towards:
        """Where a frame was going."""
        if frame.error or not frame.extended:
            return Towards.AUTOPILOT
        source = frame.identifier & SOURCE_MASK
        if frame.identifier & MESSAGE_MASK in COMMAND_TYPES:
            self._commanders.add(source)
        return Towards.DEVICES if source in self._commanders else Towards.AUTOPILOT


def _vesc_side(frame: CanFrame) -> Towards:
    commands = not frame.error and frame.extended and frame.identifier >> 8 in VESC_COMMANDS
    return Towards.DEVICES if commands else Towards.AUTOPILOT


def _command_identifiers(bus: CanBus, config: Config) -> Iterator[int]:
    commands = [one.command.signal for one in config.thruster if one.command.link == bus.name]
    if bus.database is not None and any(commands):
        database = load_database(bus.database)
        for signal in commands:
            if signal is not None:
                yield find_signal(database, signal)[0].frame_id

"""Where the commands and speeds of thrusters are in the frames of one CAN bus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from drivers.can.dbc_database import load_database, message_layout
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.load import BitRates
from drivers.can.messages.decoder import MessageDecoder
from drivers.can.messages.plan import MessagePlan
from gateway.config import Config
from gateway.config_sections import CanBus
from gateway.wiring import can_decoder
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault
from hil_tests.wires.message_edits import EditedMessage
from hil_tests.wires.protection import Protection, protection

Protocol = Literal["dronecan", "dbc", "vesc"]
USUAL_RATES = BitRates(1_000_000)  # DroneCAN's recommendation, and ArduPilot's default
Algorithms = Mapping[str, str]
FOUND_OUT: Algorithms = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class CanSignals:
    """What is known of a bus; one of which nothing is known can have faults of frames only.

    Attributes:
        protocol: of its frames.
        thrusters: behind DroneCAN ESCs.
        messages: of the other protocols.
        speeds, commands: numbers of the thrusters whose speeds, and whose commands, are on this bus.
        rates: how fast it is.
    """

    protocol: Protocol = "dronecan"
    thrusters: tuple[DroneCanThruster, ...] = ()
    messages: tuple[EditedMessage, ...] = ()
    speeds: frozenset[int] = frozenset()
    commands: frozenset[int] = frozenset()
    rates: BitRates = USUAL_RATES

    @classmethod
    def of(
        cls, config: Config, bus: str, *, rates: BitRates = USUAL_RATES, algorithms: Algorithms = FOUND_OUT
    ) -> CanSignals:
        """What the gateway's configuration says of a bus.

        Args:
            config: of the gateway.
            bus: the bus's name in it.
            rates: how fast it is.
            algorithms: of checksums, by the names of their messages; the others are found out from frames.

        Raises:
            ValueError: there is no such bus, or an algorithm that is not known.
        """
        section = config.bus(bus)
        if section is None:
            known = ", ".join(one.name for one in config.can) or "none"
            raise ValueError(f"bus = {bus!r}: the configuration has no such CAN bus, known there: {known}")
        decoder = can_decoder(section, config.thruster)
        return cls(
            section.protocol,
            decoder.thrusters if isinstance(decoder, DroneCanDecoder) else (),
            _messages(section, decoder, algorithms) if isinstance(decoder, MessageDecoder) else (),
            frozenset(one.number for one in config.thruster if one.rpm.link == bus),
            frozenset(one.number for one in config.thruster if one.command.link == bus),
            rates,
        )

    def concerned(self, faults: Sequence[Fault]) -> list[Fault]:
        """Faults of speeds and commands that are on this bus."""
        numbers = {Target.RPM: self.speeds, Target.COMMAND: self.commands}
        return [one for one in faults if one.subject.thruster in numbers.get(one.subject.target, ())]


def _messages(bus: CanBus, decoder: MessageDecoder, algorithms: Algorithms) -> tuple[EditedMessage, ...]:
    protections = {} if bus.database is None else _protections(bus.database, algorithms)
    return tuple(
        EditedMessage(
            plan.message,
            # a brake of a VESC is a command, but no number of it is
            tuple(command for command in plan.commands if command.signal.scale != 0.0),
            tuple((report.thruster, report.speed) for report in plan.reports if report.speed is not None),
            protections.get((plan.message.identifier, plan.message.extended)),
        )
        for plan in decoder.plans
        if isinstance(plan, MessagePlan)
    )


def _protections(database: Path, algorithms: Algorithms) -> dict[tuple[int, bool], Protection]:
    """By identifier and kind of frame."""
    found = {}
    for message in load_database(database).messages:
        protected = protection(message, algorithms.get(message.name))
        if protected is not None:
            layout = message_layout(message)
            found[layout.identifier, layout.extended] = protected
    return found

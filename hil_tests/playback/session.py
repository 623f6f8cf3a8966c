"""A play, step by step: vehicle, wires, bus and link. The same code in virtual time, in real time, on any bus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress
from operator import not_
from typing import Protocol

from drivers.can.frame import CanFrame
from hil_tests.playback.ends import Vehicle, VehicleBus, VehicleLink
from hil_tests.playback.recorder import Recorder
from hil_tests.wires.way import Passed, Towards, Wire

STEP_S = 0.02


class BusWire(Wire[CanFrame], Protocol):
    """A CAN wire that knows whether the gateway hears the autopilot, whose frames come there without passing it."""

    def bus_off(self, time_s: float) -> bool:
        """Whether the gateway's controller is bus-off then, and hears none of them."""
        ...


@dataclass(frozen=True, slots=True)
class Parts:
    """What is played together.

    Attributes:
        vehicle: all that is not under test.
        is_recorded: the vehicle obeys nobody any more: what faults make of its commands is what is heard of them.
        bus, can_wire: the CAN bus by which the gateway hears ESCs, and what faults make of it; None: there is none.
        bus_name: in the gateway's configuration.
        link, mavlink_wire: the same of the autopilot's link.
        recorder: of what the gateway gets, and says.
    """

    vehicle: Vehicle
    is_recorded: bool
    bus: VehicleBus | None
    can_wire: BusWire
    bus_name: str
    link: VehicleLink
    mavlink_wire: Wire[bytes]
    recorder: Recorder


class Session:
    """Moves frames and packets to where they belong; told the time, and never waits.

    Args:
        parts: what is played.
    """

    def __init__(self, parts: Parts) -> None:
        self._parts = parts

    def step(self, time_s: float) -> None:
        """All that happens by this time, in unix seconds."""
        parts = self._parts
        parts.vehicle.advance(time_s)
        if parts.bus is not None:
            self._exchange_frames(parts.bus, time_s)
        self._exchange_packets(time_s)

    def _exchange_frames(self, bus: VehicleBus, time_s: float) -> None:
        vehicle, wire, is_recorded = self._parts.vehicle, self._parts.can_wire, self._parts.is_recorded
        from_autopilot = vehicle.sent_by_autopilot()
        heard, missed = ([], []) if is_recorded else self._heard_and_missed(from_autopilot)
        bus.send(heard, ())
        commands = from_autopilot if is_recorded else [*bus.heard_by_devices(), *missed]
        entering = [(frame, Towards.DEVICES) for frame in commands]
        entering += [(frame, Towards.AUTOPILOT) for frame in vehicle.sent_by_devices()]
        for frame, towards in sorted(entering, key=_time_s):
            wire.put(frame.time_s, frame, towards)
        passed = wire.due(time_s)
        to_devices, from_devices = (_towards(passed, end) for end in (Towards.DEVICES, Towards.AUTOPILOT))
        if is_recorded:
            heard, _ = self._heard_and_missed(to_devices)
            bus.send(heard, from_devices)
        else:
            vehicle.to_devices(to_devices)
            bus.send((), from_devices)
        on_bus = sorted([*heard, *from_devices], key=lambda frame: frame.time_s)
        self._parts.recorder.frames(self._parts.bus_name, on_bus)

    def _heard_and_missed(self, from_autopilot: Sequence[CanFrame]) -> tuple[list[CanFrame], list[CanFrame]]:
        """The autopilot's frames that the gateway hears, and those that only the ESCs do."""
        missed = [self._parts.can_wire.bus_off(frame.time_s) for frame in from_autopilot]
        return list(compress(from_autopilot, map(not_, missed))), list(compress(from_autopilot, missed))

    def _exchange_packets(self, time_s: float) -> None:
        parts = self._parts
        for sent_s, datagram in parts.vehicle.datagrams():
            parts.mavlink_wire.put(min(sent_s, time_s), datagram, Towards.GATEWAY)
        for datagram in parts.link.heard():
            parts.recorder.said(time_s, datagram)
            parts.mavlink_wire.put(time_s, datagram, Towards.AUTOPILOT)
        for one in parts.mavlink_wire.due(time_s):
            if one.towards is Towards.AUTOPILOT:
                parts.vehicle.to_autopilot(time_s, one.item)
            else:
                parts.recorder.heard(time_s, one.item)
                parts.link.send(one.item)


def _time_s(one: tuple[CanFrame, Towards]) -> float:
    return one[0].time_s


def _towards(passed: Sequence[Passed[CanFrame]], towards: Towards) -> list[CanFrame]:
    return [one.item for one in passed if one.towards is towards]

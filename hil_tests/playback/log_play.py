"""A recorded dive on its way onto buses and a link, with faults laid over it. Told the time; it never waits.

Both ends of a recorded bus are played, and all of it passes a wire: what comes out at either end is put on the bus.
So a fault of a command is one of what is heard of it: the thrusters of then did what they did.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

from drivers.can.frame import CanFrame
from gateway.config import Config
from hil_tests.playback.recorded import RecordedDive
from hil_tests.scenario.failures import PHYSICAL, Target
from hil_tests.scenario.fault import Fault
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.mavlink_wire import MavlinkWire
from hil_tests.wires.way import Towards, Wire


@dataclass(frozen=True, slots=True)
class Sent:
    """What is due: frames with the names of their buses, and packets of the link, each in its order."""

    frames: Sequence[tuple[str, CanFrame]]
    packets: Sequence[bytes]


@dataclass(frozen=True, slots=True)
class Wires:
    """What lies between the dive and those who hear it.

    Attributes:
        buses: by their names.
        link: of MAVLink.
    """

    buses: Mapping[str, Wire[CanFrame]]
    link: Wire[bytes]

    @staticmethod
    def of(config: Config, faults: Sequence[Fault], start_s: float, seed: int = 0) -> Wires:
        """Wires that these faults act on; their times count from `start_s`.

        Raises:
            ValueError: a fault that only a vehicle can have, or of a bus or thruster that there is not.
        """
        _check(config, faults)
        own = [bus for bus in config.can if not bus.forwarded]
        buses = {bus.name: CanWire(bus.name, CanSignals.of(config, bus.name), faults, start_s, seed) for bus in own}
        return Wires(buses, MavlinkWire(faults, start_s, seed, None, config))

    def counts(self) -> Counter[str]:
        """What faults have done, by cause."""
        return sum((wire.counts for wire in self.buses.values()), Counter(self.link.counts))


class LogPlay:
    """Moves what was recorded through the wires.

    Args:
        dive: what is played.
        wires: that it passes.
    """

    def __init__(self, dive: RecordedDive, wires: Wires) -> None:
        self.dive = dive
        self.wires = wires

    def next_s(self) -> float:
        """When something is due again, unix seconds of the play; infinity: never."""
        return min(self.dive.next_s(), self.wires.link.next_s(), *(one.next_s() for one in self.wires.buses.values()))

    def due(self, time_s: float) -> Sent:
        """All that is due by this time."""
        self.dive.advance(time_s)
        frames = [(bus, frame) for bus, wire in self.wires.buses.items() for frame in self._frames(bus, wire, time_s)]
        return Sent(frames, self._packets(time_s))

    def hear(self, time_s: float, data: bytes) -> None:
        """Something has come over the link."""
        self.wires.link.put(time_s, data, Towards.AUTOPILOT)

    def _frames(self, bus: str, wire: Wire[CanFrame], time_s: float) -> list[CanFrame]:
        sent = [(frame, Towards.DEVICES) for frame in self.dive.sent_by_autopilot(bus)]
        sent += [(frame, Towards.AUTOPILOT) for frame in self.dive.sent_by_devices(bus)]
        for frame, towards in sorted(sent, key=lambda one: one[0].time_s):
            wire.put(frame.time_s, frame, towards)
        return sorted((passed.item for passed in wire.due(time_s)), key=attrgetter("time_s"))

    def _packets(self, time_s: float) -> list[bytes]:
        wire = self.wires.link
        for sent_s, datagram in self.dive.datagrams():
            wire.put(sent_s, datagram, Towards.GATEWAY)
        packets = []
        for passed in wire.due(time_s):
            if passed.towards is Towards.GATEWAY:
                packets.append(passed.item)
            else:
                self.dive.to_autopilot(time_s, passed.item)
        return packets


def _check(config: Config, faults: Sequence[Fault]) -> None:
    thrusters, buses = {str(one.number) for one in config.thruster}, {bus.name for bus in config.can}
    for fault in faults:
        subject = fault.subject
        if subject.target in PHYSICAL:
            raise ValueError(f"{fault.words}: only a vehicle can have that; change what is told of it instead")
        if subject.thruster is not None and str(subject.thruster) not in thrusters:
            raise ValueError(f"{fault.words}: the configuration has thrusters {', '.join(sorted(thrusters))}")
        if subject.target is Target.BUS and subject.name not in buses:
            raise ValueError(f"{fault.words}: the configuration has buses {', '.join(sorted(buses)) or 'none'}")

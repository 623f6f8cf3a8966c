"""CAN buses of the autopilot in the configuration: what its forwarding cannot give."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from drivers.mavlink.messages import CAN_BUSES_MAX
from gateway.config_sections import MAVLINK, CanBus
from gateway.problems import Problem

# keys that mean something only where frames are counted on the bus itself
_OF_THE_BUS = {
    "bitrate": "is the autopilot's to set (CAN_P1_BITRATE): remove it",
    "load_max": "means nothing on a bus that is only sampled over MAVLink: remove it",
}


def contradictions(can: Sequence[CanBus], named: Collection[str]) -> Iterator[Problem]:
    """What contradicts each other.

    Args:
        can: all buses.
        named: links that the file names, valid or not.
    """
    forwarded = [bus for bus in can if bus.forwarded]
    for bus in forwarded:
        yield from _bus_problems(bus)
        if MAVLINK not in named:
            wanted = f"needs a [{MAVLINK}] table: the autopilot forwards its bus over that link"
            yield Problem(f"can[name={bus.name}].interface", bus.interface, wanted)
    for bus in forwarded[1:]:
        wanted = f"an autopilot forwards one of its buses at a time, and {forwarded[0].name} is one: read it directly"
        yield Problem(f"can[name={bus.name}].interface", bus.interface, wanted)


def _bus_problems(bus: CanBus) -> Iterator[Problem]:
    path = f"can[name={bus.name}]"
    if bus.channel not in {str(number) for number in range(1, CAN_BUSES_MAX + 1)}:
        wanted = 'should be the number of the autopilot\'s bus: "1" for CAN1'
        yield Problem(f"{path}.channel", bus.channel, wanted)
    for key, wanted in _OF_THE_BUS.items():
        if key in bus.model_fields_set:
            yield Problem(f"{path}.{key}", getattr(bus, key), wanted)

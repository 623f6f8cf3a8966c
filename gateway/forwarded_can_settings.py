"""CAN buses of the autopilot in the configuration: what its forwarding cannot give, and what makes do with less."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

from drivers.mavlink.messages import CAN_BUSES_MAX
from gateway.config_sections import MAVLINK, Align, CanBus
from gateway.problems import Problem

# keys that mean something only where frames are counted on the bus itself
_OF_THE_BUS = {
    "bitrate": "is the autopilot's to set (CAN_P1_BITRATE): remove it",
    "load_max": "means nothing on a bus that is only sampled over MAVLink: remove it",
}


# Where a frame in ten or in three is lost, commands are known to some 50 ms, and a detector that sees finer samples
# takes that for a fault; at the default, one healthy thruster in six. Bursts are gaps, and no straight lines.
SAMPLED: Mapping[str, float] = {"sample_rate_hz": 10.0, "gap_s": 0.25, "stale_s": 0.25}


def sampled(align: Align) -> Align:
    """How a thruster is aligned that is read from a sampled bus: what the file says, and else slower and stricter."""
    left_out = {key: value for key, value in SAMPLED.items() if key not in align.model_fields_set}
    return align.model_copy(update=left_out)


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

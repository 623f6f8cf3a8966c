"""CAN buses in the configuration: what contradicts each other in a table `[[can]]`."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches

from can.interfaces import VALID_INTERFACES

from drivers.can.interface import LISTEN_ONLY, SOCKETCAN
from gateway.config_sections import MAVLINK, CanBus
from gateway.problems import Problem, is_file


def contradictions(bus: CanBus) -> Iterator[Problem]:
    """What contradicts each other in one table, or in what it points to."""
    path = f"can[name={bus.name}]"
    if bus.name == MAVLINK:
        yield Problem(f"{path}.name", bus.name, f'"{MAVLINK}" is the link to the autopilot: want another name')
    interfaces = {*VALID_INTERFACES, MAVLINK}
    if bus.interface not in interfaces:
        nearest = get_close_matches(bus.interface, interfaces, n=1, cutoff=0.5)
        hint = f"did you mean {nearest[0]}?" if nearest else f"want one of {', '.join(sorted(interfaces))}"
        yield Problem(f"{path}.interface", bus.interface, f"unknown to python-can, {hint}")
    if bus.listen_only and bus.interface not in LISTEN_ONLY:
        yield Problem(f"{path}.listen_only", True, _listen_only_remedy(bus))
    if bus.protocol == "dbc" and bus.database is None:
        yield Problem(f"{path}.database", None, 'missing: protocol "dbc" needs a .dbc, .kcd, .sym or .arxml file')
    if bus.protocol != "dbc" and bus.database is not None:
        yield Problem(f"{path}.database", bus.database, f'protocol "{bus.protocol}" reads no database: remove it')
    if bus.database is not None and not is_file(bus.database):
        yield Problem(
            f"{path}.database", bus.database, "no such file (a relative path starts at the configuration's folder)"
        )


def _listen_only_remedy(bus: CanBus) -> str:
    if bus.interface == SOCKETCAN:
        return f"is set by: sudo ip link set {bus.channel} type can bitrate 1000000 listen-only on; remove it here"
    return f"{bus.interface} cannot be told so; those that can: {', '.join(sorted(LISTEN_ONLY))}"

"""What no single key of the configuration shows: keys that need each other, exclude each other, or point elsewhere.

It works on whatever tables are valid in themselves, so that a misspelt key in one does not hide a clash in another.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivers.mavlink.endpoint import parse_endpoint
from gateway import can_settings, failsafe_settings, forwarded_can_settings, navigation_settings, speed_settings
from gateway.config_sections import (
    MAVLINK,
    CanBus,
    CommandSource,
    Failsafe,
    Mavlink,
    Navigation,
    RpmSource,
    Speed,
    Thruster,
)
from gateway.problems import Problem, is_file
from gateway.signing import settings as signing_settings
from gateway.wiring import UNITS_OF_FULL_THRUST, command_scale, refused_signals


@dataclass(frozen=True, slots=True)
class _Keys:
    """Keys of a source that a protocol needs ("a | b": one of the two), and those that it can use."""

    needed: tuple[str, ...]
    usable: tuple[str, ...] = ()


_SCALE = ("minimum", "neutral", "maximum")
# where an ESC has a place of its own on the bus, the key that says which
_ESC_KEYS: Mapping[str, str] = {"dronecan": "esc_index", "vesc": "controller_id"}
COMMAND_KEYS: Mapping[str, _Keys] = {
    "dronecan": _Keys(("esc_index",), ("bidirectional", "maximum_rpm", "reverse")),
    "vesc": _Keys(("controller_id", "control"), ("minimum", "maximum", "dead_band", "reverse")),
    "dbc": _Keys(("signal", *_SCALE), ("dead_band", "reverse")),
    MAVLINK: _Keys(("servo_channel | actuator",), (*_SCALE, "dead_band", "reverse")),
}
RPM_KEYS: Mapping[str, _Keys] = {
    "dronecan": _Keys(("esc_index",), ("node_id", "signed", "reverse")),
    "vesc": _Keys(("controller_id", "pole_pairs"), ("signed", "reverse")),
    "dbc": _Keys(("signal",), ("unit", "pole_pairs", "signed", "reverse", "voltage", "current")),
    MAVLINK: _Keys(("esc_index | rpm_sensor",), ("signed", "reverse")),
}


def path_of(thruster: Thruster, *keys: str) -> str:
    """Key path of a thruster's table, or of a key in it."""
    return ".".join([f"thruster[number={thruster.number}]", *keys])


def inconsistencies(
    tables: Mapping[str, Any],
    can: Sequence[CanBus],
    mavlink: Mavlink | None,
    thruster: Sequence[Thruster],
    speed: Speed | None,
    navigation: Navigation | None,
    failsafe: Failsafe | None,
) -> list[Problem]:
    """All contradictions among the valid tables.

    Args:
        tables: the raw file, to tell a link that is not there from one whose own table has a problem.
        can, mavlink, thruster, speed, navigation, failsafe: what is valid of it.
    """
    protocols: dict[str, str] = {bus.name: bus.protocol for bus in can}
    if mavlink is not None:
        protocols[MAVLINK] = MAVLINK
    named = _named_links(tables)
    return [
        *_missing_thrusters(tables),
        *(problem for bus in can for problem in can_settings.contradictions(bus)),
        *forwarded_can_settings.contradictions(can, named),
        *_endpoint_problems(mavlink),
        *_twins("name", ((f"can[name={bus.name}].name", bus.name) for bus in can)),
        *_twins("number", ((path_of(one, "number"), one.number) for one in thruster)),
        *(problem for one in thruster for problem in _source_problems(one, protocols, named)),
        *_shared_places(thruster, protocols),
        *(problem for one in thruster for problem in _split_escs(one, protocols)),
        *(problem for bus in can for problem in _signal_problems(bus, thruster)),
        *_watch_problems(tables),
        *(speed_settings.contradictions(speed, thruster, tables) if speed is not None else ()),
        *(navigation_settings.contradictions(navigation) if navigation is not None else ()),
        *(failsafe_settings.contradictions(failsafe, thruster, tables) if failsafe is not None else ()),
        *(signing_settings.contradictions(mavlink) if mavlink is not None else ()),
    ]


def _named_links(tables: Mapping[str, Any]) -> set[str]:
    buses = tables.get("can", [])
    names = [table.get("name") for table in buses if isinstance(table, dict)] if isinstance(buses, list) else []
    return {name for name in names if isinstance(name, str)} | ({MAVLINK} if MAVLINK in tables else set())


def _missing_thrusters(tables: Mapping[str, Any]) -> Iterator[Problem]:
    if not tables.get("thruster"):
        yield Problem("thruster", None, "missing: want at least one table [[thruster]]")


def _endpoint_problems(mavlink: Mavlink | None) -> Iterator[Problem]:
    if mavlink is not None:
        try:
            parse_endpoint(mavlink.endpoint)
        except ValueError as error:
            yield Problem("mavlink.endpoint", mavlink.endpoint, str(error))


def _twins(what: str, places: Iterable[tuple[str, Hashable]]) -> Iterator[Problem]:
    """A problem for every value that stands in more than one place."""
    by_value = defaultdict(list)
    for path, value in places:
        by_value[value].append(path)
    for value, paths in by_value.items():
        if len(paths) > 1:
            others = "" if len(set(paths)) == 1 else f" ({', '.join(paths)})"
            yield Problem(paths[-1], value, f"given {len(paths)} times{others}: each {what} once")


def _source_problems(thruster: Thruster, protocols: Mapping[str, str], named: set[str]) -> Iterator[Problem]:
    for key, source, table in (("command", thruster.command, COMMAND_KEYS), ("rpm", thruster.rpm, RPM_KEYS)):
        path = path_of(thruster, key)
        if source.link in protocols:
            yield from _key_problems(path, source, table, protocols[source.link])
        elif source.link not in named:
            wanted = ", ".join(sorted(named)) or "a [[can]] table or [mavlink] first"
            yield Problem(f"{path}.link", source.link, f"no such link: want {wanted}")
    yield from _scale_problems(thruster, protocols)


def _key_problems(
    path: str, source: CommandSource | RpmSource, table: Mapping[str, _Keys], protocol: str
) -> Iterator[Problem]:
    needed, usable = table[protocol].needed, table[protocol].usable
    given = source.model_fields_set
    alternatives = [tuple(key.split(" | ")) for key in needed]
    for keys in alternatives:
        if len(given.intersection(keys)) != 1:
            meaning = " or ".join(f"{key}: {type(source).model_fields[key].description}" for key in keys)
            yield Problem(f"{path}.{keys[0]}", None, f"a source on a {protocol} link needs exactly one of {meaning}")
    for key in sorted(given.difference(["link"], usable, *alternatives)):
        wanted = f"means nothing on a {protocol} link; usable there: {', '.join((*needed, *usable))}"
        yield Problem(f"{path}.{key}", getattr(source, key), wanted)


def _scale_problems(thruster: Thruster, protocols: Mapping[str, str]) -> Iterator[Problem]:
    source = thruster.command
    if protocols.get(source.link) == "dbc" and None in (source.minimum, source.neutral, source.maximum):
        return  # told already
    if protocols.get(source.link) == "vesc" and source.maximum is None and source.control in UNITS_OF_FULL_THRUST:
        wanted = f"missing: want {UNITS_OF_FULL_THRUST[source.control]} at full thrust"
        yield Problem(path_of(thruster, "command", "maximum"), None, wanted)
        return
    if source.maximum_rpm is not None and not source.bidirectional:
        wanted = "means nothing with maximum_rpm: of esc.RPMCommand 0 is always neutral"
        yield Problem(path_of(thruster, "command", "bidirectional"), False, wanted)
    try:
        command_scale(source)
    except ValueError as error:
        given = {key: getattr(source, key) for key in (*_SCALE, "dead_band") if key in source.model_fields_set}
        yield Problem(path_of(thruster, "command"), given, str(error))


def _shared_places(thrusters: Sequence[Thruster], protocols: Mapping[str, str]) -> Iterator[Problem]:
    """Two thrusters cannot have one ESC, one servo output or one signal."""
    alone = {"command": ("servo_channel", "actuator", "signal"), "rpm": ("signal", "rpm_sensor")}
    for key, place in ((key, place) for key, places in alone.items() for place in places):
        yield from _twins(place, _places(thrusters, protocols, (key,), place))
    for place in ("esc_index", "controller_id"):
        yield from _twins(place, _places(thrusters, protocols, ("command", "rpm"), place))


def _places(
    thrusters: Sequence[Thruster], protocols: Mapping[str, str], keys: Sequence[str], place: str
) -> Iterator[tuple[str, Hashable]]:
    """Where each thruster's sources stand, by key path; a place that its command and its speed share once."""
    for thruster in thrusters:
        taken = set()
        for key in keys:
            source = getattr(thruster, key)
            value = getattr(source, place, None)
            if value is not None and source.link in protocols and (source.link, value) not in taken:
                taken.add((source.link, value))
                yield path_of(thruster, key, place), f"{source.link} {value}"


def _split_escs(thruster: Thruster, protocols: Mapping[str, str]) -> Iterator[Problem]:
    """On one bus the command and the speed of a thruster belong to one ESC."""
    command, rpm = thruster.command, thruster.rpm
    protocol = protocols.get(rpm.link, "")
    if command.link != rpm.link or protocol not in _ESC_KEYS:
        return
    for key in (_ESC_KEYS[protocol], "reverse"):
        if getattr(command, key) != getattr(rpm, key):
            wanted = f"command.{key} is {getattr(command, key)!r}: on one {protocol} bus both are the same ESC"
            yield Problem(path_of(thruster, "rpm", key), getattr(rpm, key), wanted)


def _signal_problems(bus: CanBus, thrusters: Sequence[Thruster]) -> Iterator[Problem]:
    if bus.protocol == "dbc" and bus.database is not None and is_file(bus.database):
        for path, value, wanted in refused_signals(bus, bus.database, thrusters):
            yield Problem(path, value, wanted)


# tables that switch a watch on, and what each needs of the autopilot
_WATCHES: Mapping[str, str] = {
    "speed": "heading and position come from the autopilot",
    "navigation": "inertial unit, DVL and depth come over it",
}


def _watch_problems(tables: Mapping[str, Any]) -> Iterator[Problem]:
    detectors = tables.get("detector")
    for watch, need in _WATCHES.items():
        if watch not in tables and isinstance(detectors, dict) and watch in detectors:
            wanted = f"means nothing without a table [{watch}], which switches the watch on"
            yield Problem(f"detector.{watch}", None, wanted)
        if watch in tables and MAVLINK not in tables:
            yield Problem(watch, None, f"needs a [mavlink] table: {need}")

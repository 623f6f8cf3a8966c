"""Never onto a real vehicle by accident: what must be true before, and while, a play touches anything real.

Rules, each with its way out; the defaults refuse:

| what is touched | refused | unless |
|---|---|---|
| an interface that is not there | always | |
| a bus that is not virtual | always | `--transmit` names what may be put on it |
| a bridge between such buses | with identifiers | `--transmit all`: it passes on whatever comes |
| such a bus, otherwise | a play that sends more than is named | the rest is named as well |
| such a bus, or an autopilot | an autopilot that reports armed, or a mission that arms it | `--while-armed` |
| the same | no autopilot heard | `--no-autopilot` |

That nothing is heard is no evidence that nothing is armed: the endpoint may be mistyped, the link unplugged. So
whoever works on a bench without an autopilot has to say so; and if one is heard then, that was wrong, and is told.
Whether an endpoint leads to a simulator cannot be seen from here: all autopilots count as real.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hil_tests.bridge.transmission import SHOWN, Transmission

ABSENT = "not there"  # the kind of an interface that there is none of
EXAMPLE = "--transmit node:20-27, --transmit 14040A0B,7E0"


class RefusedError(Exception):
    """It must not be played there; the text says why, and the way out."""


@dataclass(frozen=True, slots=True)
class Bus:
    """A bus of the play; `kind` is what it was found to be: "can", "vcan", "slcan", ... in words."""

    name: str
    virtual: bool
    kind: str


@dataclass(frozen=True, slots=True)
class Touched:
    """What a play wants to touch.

    Attributes:
        buses: all that frames are put on.
        bridge: it passes frames on between two buses, instead of sending its own.
        lacking: identifiers that it sends, and that `--transmit` does not allow (`Transmission.lacking`).
        mavlink: endpoint of an autopilot that is not the play's own; None: there is none.
        arms: its mission arms the vehicle.
    """

    buses: tuple[Bus, ...] = ()
    bridge: bool = False
    lacking: tuple[str, ...] = ()
    mavlink: str | None = None
    arms: bool = False

    @property
    def real_buses(self) -> tuple[Bus, ...]:
        """Those that are not virtual."""
        return tuple(bus for bus in self.buses if not bus.virtual)

    @property
    def anything_real(self) -> bool:
        """Whether a vehicle may be at the other end."""
        return bool(self.real_buses) or self.mavlink is not None


@dataclass(frozen=True, slots=True)
class Granted:
    """What the user has said.

    Attributes:
        transmit: `--transmit`; None: not given.
        while_armed, no_autopilot: the flags of these names.
    """

    transmit: Transmission | None = None
    while_armed: bool = False
    no_autopilot: bool = False


@dataclass(frozen=True, slots=True)
class HeardAutopilot:
    """An autopilot by its HEARTBEAT; `name` in words: "ArduSub (system 1)"."""

    name: str
    armed: bool


Rule = Callable[[Touched, Granted], str]
HeardRule = Callable[[Touched, Granted, Sequence[HeardAutopilot]], str]


def _absent(touched: Touched, _granted: Granted) -> str:
    names = [bus.name for bus in touched.buses if bus.kind == ABSENT]
    if not names:
        return ""
    made = f"sudo ip link add {names[0]} type vcan && sudo ip link set {names[0]} up"
    return f"no interface {' and '.join(names)} is here: want what `ip link` shows; a virtual one is made by {made}"


def _unnamed(touched: Touched, granted: Granted) -> str:
    known = [bus for bus in touched.real_buses if bus.kind != ABSENT]
    if not known or granted.transmit is not None:
        return ""
    buses = " and ".join(f"{bus.name} is a real bus ({bus.kind})" for bus in known)
    way_out = "--transmit all" if touched.bridge else f"{EXAMPLE}, or --transmit all"
    return f"{buses}: nothing is put on it without leave; say what may be: {way_out}"


def _half_bridge(touched: Touched, granted: Granted) -> str:
    named = granted.transmit
    if not (touched.bridge and touched.real_buses) or named is None or named.everything:
        return ""
    buses = ":".join(bus.name for bus in touched.buses)
    return f"a bridge passes on all that comes, and so --bridge {buses} needs --transmit all, not {named.text}"


def _lacking(touched: Touched, granted: Granted) -> str:
    if not touched.real_buses or touched.bridge or granted.transmit is None or not touched.lacking:
        return ""
    first = ", ".join(touched.lacking[:SHOWN])
    more = f" and {len(touched.lacking) - SHOWN} more" if len(touched.lacking) > SHOWN else ""
    return f"the play sends {first}{more} as well, which --transmit {granted.transmit.text} does not name: add them"


def _arming_mission(touched: Touched, granted: Granted) -> str:
    if not (touched.anything_real and touched.arms) or granted.while_armed:
        return ""
    return "the mission arms the vehicle, and its thrusters will turn: if that is meant, say --while-armed"


def _armed(touched: Touched, granted: Granted, heard: Sequence[HeardAutopilot]) -> str:
    armed = [one.name for one in heard if one.armed]
    if not (touched.anything_real and armed) or granted.while_armed:
        return ""
    names, verb = " and ".join(armed), "report" if len(armed) > 1 else "reports"
    return f"{names} {verb} armed: disarm it, or, if its thrusters may turn, say --while-armed"


def _unheard(touched: Touched, granted: Granted, heard: Sequence[HeardAutopilot]) -> str:
    if not touched.anything_real or heard or granted.no_autopilot:
        return ""
    if touched.mavlink is None:
        seen, way_out = "no endpoint of the autopilot is named", "name it with --mavlink"
    else:
        seen = f"no autopilot is heard on {touched.mavlink}"
        way_out = "mend the endpoint (one that is udpout hears only who speaks first)"
    return f"{seen}, and so it is not known whether it is armed: {way_out}, or say --no-autopilot if there is none"


def _unexpected(touched: Touched, granted: Granted, heard: Sequence[HeardAutopilot]) -> str:
    if not (touched.anything_real and granted.no_autopilot and heard):
        return ""
    return f"--no-autopilot was said, but {heard[0].name} is heard: leave it out, or take {touched.mavlink} away"


# first those that need nobody to be heard: they are asked before anything is opened
RULES: tuple[Rule, ...] = (_absent, _unnamed, _half_bridge, _lacking, _arming_mission)
HEARD_RULES: tuple[HeardRule, ...] = (_armed, _unheard, _unexpected)


def refusals(touched: Touched, granted: Granted) -> list[str]:
    """Why it must not begin, as far as is known before the autopilot was listened to; empty: it may."""
    return [text for rule in RULES if (text := rule(touched, granted))]


def refusals_heard(touched: Touched, granted: Granted, heard: Sequence[HeardAutopilot]) -> list[str]:
    """Why it must not begin, once the autopilot was listened to for a few seconds; empty: it may.

    Where nothing real is touched, nobody needs to be listened to: it may.
    """
    return [text for rule in HEARD_RULES if (text := rule(touched, granted, heard))]

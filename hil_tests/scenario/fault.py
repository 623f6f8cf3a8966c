"""One scripted fault: what, on whom, when, and how badly. The value that rig and wires act on."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import inf, isfinite

from hil_tests.scenario.failures import BODY_AXES, LARGEST, FailureKind, Quantity, Target, kinds_of

AXES = BODY_AXES

# Subjects that there is one of; thrusters and buses have numbers and names of their own.
SINGLE: Mapping[str, Target] = {
    "battery": Target.BATTERY,
    "hull": Target.HULL,
    "water": Target.WATER,
    "dvl": Target.DVL,
    "depth": Target.DEPTH,
    "accelerometer": Target.ACCELEROMETER,
    "gyroscope": Target.GYROSCOPE,
    "heading": Target.HEADING,
    "position": Target.POSITION,
    "mavlink": Target.LINK,
    "autopilot": Target.AUTOPILOT,
}
# what others call failures of the table
OTHER_WORDS: Mapping[str, tuple[str, ...]] = {
    "frozen": ("stuck",),
    "dead": ("off",),
    "silent": ("off", "cut"),
    "dropout": ("off", "intermittent", "loss"),
    "lost": ("off", "loss"),
    "offset": ("bias",),
    "step": ("bias",),
    "jump": ("reset", "bias"),
    "inverted": ("reverse",),
    "weeds": ("entangled",),
    "jammed": ("blocked",),
    "jitter": ("latency", "delay"),
    "latency": ("delay", "delayed"),
    "delay": ("latency", "delayed"),
}
_OF_THRUSTER = {None: Target.THRUSTER, "rpm": Target.RPM, "command": Target.COMMAND}
THRUSTER_NUMBER = "([1-9][0-9]?)"
BUS_NAME = "(?=.*(?:[Cc][Aa][Nn]|[0-9]))[A-Za-z0-9_-]{1,16}"  # as [[can]] names them, and not just any word
_THRUSTER = re.compile(f"thruster {THRUSTER_NUMBER}(?: (rpm|command))?")
_LIKE_A_THRUSTER = re.compile(r"t(hr)?(uster)?[ _#-]*[0-9]", re.IGNORECASE)
_BUS = re.compile(BUS_NAME)


@dataclass(frozen=True, slots=True)
class Subject:
    """Whom it befalls.

    Attributes:
        target: what kind of thing.
        name: as in the scenario file: "thruster 3 rpm", "dvl", "can0", ...
        thruster: its number from 1; None: no thruster's.
    """

    target: Target
    name: str
    thruster: int | None = None


def subject_named(name: str) -> Subject:
    """The subject of a name in a scenario file. Whether the vehicle has such a thruster or bus is not known here.

    Raises:
        ValueError: no subject is called so.
    """
    thruster = _THRUSTER.fullmatch(name)
    if thruster:
        return Subject(_OF_THRUSTER[thruster[2]], name, int(thruster[1]))
    if name in SINGLE:
        return Subject(SINGLE[name], name)
    nearest = get_close_matches(name, [*SINGLE, "thruster"], n=1, cutoff=0.6)
    if nearest or _LIKE_A_THRUSTER.match(name) or not _BUS.fullmatch(name):
        raise ValueError(f"no such subject, {_subject_hint(name, nearest)}")
    return Subject(Target.BUS, name)


def _subject_hint(name: str, nearest: list[str]) -> str:
    if "thruster" in nearest or _LIKE_A_THRUSTER.match(name):
        number = re.search(r"[1-9][0-9]?", name)
        return f'want "thruster {number[0] if number else 1}", or that with "rpm" or "command" behind it'
    if nearest:
        return f"did you mean {nearest[0]}?"
    return f"known here: thruster 3, thruster 3 rpm, thruster 3 command, {', '.join(SINGLE)}, the name of a CAN bus"


def failure_hint(target: Target, failure: str) -> str:
    """What to say of a failure that the table does not have for a target."""
    known = list(kinds_of(target))
    meant = [word for word in OTHER_WORDS.get(failure, ()) if word in known]
    nearest = meant or get_close_matches(failure, known, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known here: {', '.join(known)}"
    return f"no failure of a {target}, {hint}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault on the time line; checked against the table of `hil_tests.scenario.failures`.

    Attributes:
        subject: whom it befalls.
        failure: what happens, as in the table.
        at_s: onset, seconds since the start.
        until_s: when it is over; infinity: never.
        ramp_s: how long it takes to its full size, rising linearly; 0: at once.
        values: all quantities of the table's row, by their names; those that are left out have their defaults.
        axis: component of a vector that it is of: 0 forward (of a position: north), 1 right (east), 2 down;
            None: all of them.

    Raises:
        ValueError: what the table does not know or allow.
    """

    subject: Subject
    failure: str
    at_s: float
    until_s: float = inf
    ramp_s: float = 0.0
    values: Mapping[str, float] = field(default_factory=dict)
    axis: int | None = None

    def __post_init__(self) -> None:
        row = self.kind
        _want("at_s", self.at_s, isfinite(self.at_s) and self.at_s >= 0.0, "seconds since the start, 0 or more")
        _want("until_s", self.until_s, self.until_s > self.at_s, f"later than at_s = {self.at_s:g}")
        _want("ramp_s", self.ramp_s, isfinite(self.ramp_s) and self.ramp_s >= 0.0, "0 or more seconds")
        allowed = [None, *range(len(row.axes))]
        _want("axis", self.axis, self.axis in allowed, f"one of {allowed}")
        object.__setattr__(self, "values", _complete(row, self.values))

    @property
    def kind(self) -> FailureKind:
        """Its row of the table."""
        row = kinds_of(self.subject.target).get(self.failure)
        if row is None:
            raise ValueError(f"failure = {self.failure}: {failure_hint(self.subject.target, self.failure)}")
        return row

    def active(self, since_s: float) -> bool:
        """Whether it is there at an instant, in seconds since the start."""
        return self.at_s <= since_s < self.until_s

    def grown(self, since_s: float) -> float:
        """How much of its size it has reached: 0 before the onset and after the end, 1 after the ramp."""
        if not self.active(since_s):
            return 0.0
        passed_s = since_s - self.at_s
        return 1.0 if passed_s >= self.ramp_s else passed_s / self.ramp_s

    @property
    def words(self) -> str:
        """For reports: "thruster 3 entangled"."""
        return f"{self.subject.name} {self.failure.replace('_', ' ')}"


def _complete(row: FailureKind, given: Mapping[str, float]) -> Mapping[str, float]:
    """All quantities of a row."""
    names = [quantity.name for quantity in row.quantities]
    for name in given:
        _want(name, given[name], name in names, f"no quantity of {row.failure}, known here: {names}")
    values = {}
    for quantity in row.quantities:
        value = given.get(quantity.name, quantity.default)
        if value is None:
            raise ValueError(f"{quantity.name}: missing, want {_bounds(quantity)} ({quantity.text})")
        _want(quantity.name, value, quantity.allows(value), f"{_bounds(quantity)} ({quantity.text})")
        values[quantity.name] = value
    return values


def _bounds(quantity: Quantity) -> str:
    return quantity.wanted or f"a number of at most {LARGEST:.10g}, either way"


def _want(name: str, value: object, right: bool, wanted: str) -> None:
    if not right:
        raise ValueError(f"{name} = {value}: want {wanted}")

"""What can go wrong, as one table: which subject, what happens to it, and by which quantities.

The words are those of MAVLink's MAV_CMD_INJECT_FAILURE where they fit (off, stuck, garbage, wrong, slow, delayed,
intermittent). The table is what scenario files are checked against, what editors learn from the exported schema, and
what `gateway hil list --failures` prints; whoever acts on a fault (rig, wires) is tested to know each row.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from math import isfinite


class Target(StrEnum):
    """What a fault can befall."""

    THRUSTER = "thruster"  # motor, propeller and ESC: what really happens
    RPM = "rpm"  # what is reported of a thruster's speed
    COMMAND = "command"  # what its ESC is told, on the way from the autopilot
    BATTERY = "battery"
    HULL = "hull"
    WATER = "water"
    DVL = "dvl"
    DEPTH = "depth"
    ACCELEROMETER = "accelerometer"
    GYROSCOPE = "gyroscope"
    HEADING = "heading"
    POSITION = "position"
    BUS = "bus"  # a CAN bus, by its name
    LINK = "link"  # the MAVLink link
    AUTOPILOT = "autopilot"


# What only a simulated vehicle can have; all else happens on the way of frames and packets, real ones as well.
PHYSICAL = frozenset({Target.THRUSTER, Target.BATTERY, Target.HULL, Target.WATER, Target.AUTOPILOT})
SENSORS = frozenset(
    {Target.DVL, Target.DEPTH, Target.ACCELEROMETER, Target.GYROSCOPE, Target.HEADING, Target.POSITION}
)


# Of what has no bounds of its own: more is a slip of the pen, and no wire has a place for it.
LARGEST = 1e6


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number that a failure needs.

    Attributes:
        name: key in the scenario file, with its unit.
        text: what it means.
        default: where the file says nothing; None: it has to.
        minimum, maximum: bounds; `minimum` itself is allowed only where `inclusive`.
    """

    name: str
    text: str
    default: float | None = None
    minimum: float = -LARGEST
    maximum: float = LARGEST
    inclusive: bool = True

    def allows(self, value: float) -> bool:
        """Whether a value is finite and within the bounds."""
        above = value >= self.minimum if self.inclusive else value > self.minimum
        return isfinite(value) and above and value <= self.maximum

    @property
    def wanted(self) -> str:
        """The bounds that are its own, in words: "above 0, at most 0.95"; "" where it has none."""
        least = "" if self.minimum == -LARGEST else f"{'at least' if self.inclusive else 'above'} {self.minimum:.10g}"
        most = "" if self.maximum == LARGEST else f"at most {self.maximum:.10g}"
        return ", ".join(filter(None, (least, most)))


@dataclass(frozen=True, slots=True)
class FailureKind:
    """A row of the table.

    Attributes:
        target: what it befalls.
        failure: its name in a scenario file.
        text: what happens.
        quantities: the numbers that it needs.
        axes: names of the components of which one alone can have it; empty: there are none.
    """

    target: Target
    failure: str
    text: str
    quantities: tuple[Quantity, ...] = ()
    axes: tuple[str, ...] = ()


def _share(text: str, default: float | None = None, maximum: float = 1.0) -> Quantity:
    return Quantity("share", text, default, 0.0, maximum, inclusive=False)


def _seconds(name: str, text: str, default: float | None = None, maximum: float = LARGEST) -> Quantity:
    return Quantity(name, text, default, 0.0, maximum, inclusive=False)


BODY_AXES = ("forward", "right", "down")
EARTH_AXES = ("north", "east", "down")


def _sensor(target: Target, unit: str, per_s: str, what: str, axes: tuple[str, ...] = ()) -> tuple[FailureKind, ...]:
    """The failures that every measured quantity can have: of when it comes, and of what it says."""
    return (
        FailureKind(target, "off", f"no {what} comes any more"),
        FailureKind(target, "slow", "tells less often", (_seconds("interval_s", "between two"),)),
        FailureKind(target, "delayed", "tells later", (_seconds("delay_s", "by so much"),)),
        FailureKind(
            target, "intermittent", "comes and goes", (_seconds("period_s", "gone for the second half of it", 2.0),)
        ),
        *(replace(row, axes=axes) for row in _distorted(target, unit, per_s, what)),
    )


def _distorted(target: Target, unit: str, per_s: str, what: str) -> tuple[FailureKind, ...]:
    return (
        FailureKind(target, "stuck", f"the last {what} is repeated"),
        FailureKind(
            target, "garbage", f"{what} at random", (Quantity(f"spread_{unit}", "standard deviation", None, 0.0),)
        ),
        FailureKind(target, "wrong", f"one and the same {what}", (Quantity(f"value_{unit}", "what is told", 0.0),)),
        FailureKind(target, "scale", "is multiplied", (Quantity("factor", "by this"),)),
        FailureKind(target, "bias", "is off by an amount", (Quantity(f"bias_{unit}", "what is added"),)),
        FailureKind(target, "drift", "goes astray more and more", (Quantity(f"drift_{per_s}", "added each second"),)),
        FailureKind(target, "reverse", "has the other sign"),
        FailureKind(target, "noise", "scatters", (Quantity(f"noise_{unit}", "standard deviation", None, 0.0),)),
    )


ONLY = Quantity("node", "frames of this DroneCAN node only; -1: of all", -1.0, -1.0, 127.0)

TABLE: tuple[FailureKind, ...] = (
    FailureKind(
        Target.THRUSTER,
        "entangled",
        "weeds or line brake it",
        (_share("of the full-throttle speed lost", 0.25, 0.95),),
    ),
    FailureKind(Target.THRUSTER, "blocked", "the rotor is held", (_share("of the speed lost", 1.0),)),
    FailureKind(Target.THRUSTER, "propeller_lost", "a bare shaft", (_share("of the torque that is gone", 1.0),)),
    FailureKind(
        Target.THRUSTER,
        "worn",
        "weak magnets, windings or ESC",
        (_share("of the full-throttle speed lost", None, 0.95),),
    ),
    FailureKind(Target.THRUSTER, "off", "dead: the ESC does not drive", (_share("of the drive voltage lost", 1.0),)),
    FailureKind(
        Target.THRUSTER,
        "reset",
        "the ESC restarts, again and again while it lasts",
        (_seconds("silent_s", "without drive and reports", 1.5), _seconds("every_s", "from restart to restart", 1e6)),
    ),
    FailureKind(
        Target.THRUSTER, "delayed", "obeys later than before", (_seconds("delay_s", "by so much", None, 60.0),)
    ),
    FailureKind(
        Target.THRUSTER,
        "slow",
        "takes longer to its speed",
        (Quantity("factor", "of its time constants", 3.0, 1.0, 1000.0),),
    ),
    FailureKind(Target.THRUSTER, "reverse", "turns the other way: two phases are swapped"),
    *_sensor(Target.RPM, "rpm", "rpm_per_s", "speed"),
    FailureKind(Target.RPM, "dropped_pulses", "Hall pulses get lost", (_share("of the pulses"),)),
    *_sensor(Target.COMMAND, "share", "share_per_s", "command"),
    FailureKind(
        Target.BATTERY, "sag", "the supply falls, whatever the load", (Quantity("sag_v", "volts", None, 0.0, 1000.0),)
    ),
    FailureKind(
        Target.HULL,
        "net",
        "something catches on the hull",
        (Quantity("drag_factor", "of its drag", 3.7, 1.0, 1000.0),),
    ),
    FailureKind(
        Target.HULL,
        "pull",
        "the tether pulls",
        (Quantity("force_n", "newtons", None, 0.0, 10_000.0), Quantity("towards_deg", "true bearing", 0.0)),
    ),
    FailureKind(
        Target.WATER,
        "gust",
        "a current comes and goes",
        (
            Quantity("speed_mps", "at last", None, 0.0, 10.0),
            Quantity("towards_deg", "true bearing that it sets to", 0.0),
        ),
    ),
    *_sensor(Target.DVL, "mps", "mps2", "velocity", BODY_AXES),
    FailureKind(Target.DVL, "no_lock", "bottom lock is lost: zeros, and says so (confidence 0)"),
    *_sensor(Target.DEPTH, "m", "mps", "depth"),
    *_sensor(Target.ACCELEROMETER, "mps2", "mps3", "specific force", BODY_AXES),
    *_sensor(Target.GYROSCOPE, "radps", "radps2", "angular rate", BODY_AXES),
    *_sensor(Target.HEADING, "deg", "degps", "heading"),
    *_sensor(Target.POSITION, "m", "mps", "position", EARTH_AXES),
    FailureKind(
        Target.POSITION,
        "reset",
        "jumps, for good",
        (Quantity("north_m", "by so much", 0.0), Quantity("east_m", "by so much", 0.0)),
    ),
    FailureKind(Target.BUS, "bus_off", "the gateway's controller goes bus-off, and comes back at the end"),
    FailureKind(Target.BUS, "loss", "frames get lost", (_share("of them"), ONLY)),
    FailureKind(
        Target.BUS, "corruption", "bits of the data flip, unseen by the bus's own CRC", (_share("of frames"), ONLY)
    ),
    FailureKind(Target.BUS, "duplication", "frames come twice", (_share("of them"), ONLY)),
    FailureKind(
        Target.BUS,
        "reordering",
        "frames are overtaken",
        (_share("of them"), _seconds("held_s", "held back for", 0.005), ONLY),
    ),
    FailureKind(
        Target.BUS,
        "delay",
        "frames come later",
        (_seconds("delay_s", "all of them"), Quantity("jitter_s", "and up to so much more", 0.0, 0.0), ONLY),
    ),
    FailureKind(
        Target.BUS,
        "babbling",
        "a node talks without pause, and drives out what has less priority",
        (
            Quantity("frames_per_s", "of the babbler", 5000.0, 1.0, 20000.0),
            Quantity("identifier", "29 bits; 0 wins every arbitration", 0.0, 0.0, float(0x1FFFFFFF)),
        ),
    ),
    FailureKind(Target.BUS, "wrong_dlc", "frames are cut short or too long", (_share("of them"), ONLY)),
    FailureKind(
        Target.BUS,
        "node_conflict",
        "a second device speaks with the same node id",
        (Quantity("node", "that there are two of", None, 1.0, 127.0),),
    ),
    FailureKind(Target.LINK, "loss", "packets get lost", (_share("of them"),)),
    FailureKind(
        Target.LINK,
        "latency",
        "packets come later",
        (_seconds("delay_s", "all of them"), Quantity("jitter_s", "and up to so much more", 0.0, 0.0)),
    ),
    FailureKind(Target.LINK, "duplication", "packets come twice", (_share("of them"),)),
    FailureKind(
        Target.LINK,
        "reordering",
        "packets are overtaken",
        (_share("of them"), _seconds("held_s", "held back for", 0.1)),
    ),
    FailureKind(
        Target.LINK, "garbage", "bytes that are no MAVLink between packets", (_share("of packets that they follow"),)
    ),
    FailureKind(Target.LINK, "bad_checksum", "bits flip on the way", (_share("of packets"),)),
    FailureKind(Target.LINK, "cut", "nothing passes, either way"),
    FailureKind(
        Target.LINK,
        "foreign_system",
        "a second autopilot is heard",
        (Quantity("system_id", "its own", 2.0, 1.0, 254.0),),
    ),
    FailureKind(
        Target.LINK,
        "replay",
        "old packets are sent again by somebody, signatures and all",
        (_seconds("age_s", "how old they are", 10.0),),
    ),
    FailureKind(
        Target.AUTOPILOT, "reboot", "it starts anew: disarmed", (_seconds("silent_s", "until it speaks", 3.0),)
    ),
)


def kinds_of(target: Target) -> dict[str, FailureKind]:
    """The rows of a target, by failure."""
    return {row.failure: row for row in TABLE if row.target is target}

"""A telemetry as the rows of a picture: subjects worst first, what each says in a few words, how far it is off."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan

from detectors.verdict import Level
from gateway.telemetry import SubjectTelemetry
from gateway.watch.words import UNKNOWN, flow_words, listed, number, short

# what is not judged deserves a look before what is well
RANKS: Mapping[Level, int] = {Level.FAULT: 0, Level.SUSPECT: 1, Level.UNKNOWN: 2, Level.NORMAL: 3}
# a drift of a thruster's curve that is worth a word
WEAR = 0.05


@dataclass(frozen=True, slots=True)
class SubjectRow:
    """A subject with something to show.

    Attributes:
        name: as pilots call it.
        level: as the pilot was told.
        share: how far it is off, signed, 1 = its threshold; NaN where that is not known.
        score: of its detector, 1 = the threshold; NaN where there is none.
        values: in words with units.
        text: why its level is what it is; empty where it is well.
    """

    name: str
    level: Level
    share: float
    score: float
    values: tuple[str, ...]
    text: str


@dataclass(frozen=True, slots=True)
class Subjects:
    """All subjects. `rows`: those with something to show, worst first; `others`: the rest in words, by level."""

    rows: tuple[SubjectRow, ...]
    others: Mapping[Level, str]


def subjects(telemetry: Sequence[SubjectTelemetry]) -> Subjects:
    """The subjects of a telemetry; those of one level stay in the order that they are given in."""
    worst_first = sorted(telemetry, key=lambda one: RANKS[one.level])
    shown = [one for one in worst_first if _has_something(one)]
    rest = [one for one in worst_first if not _has_something(one)]
    others = {level: listed(one.subject for one in rest if one.level is level) for level in RANKS}
    return Subjects(tuple(map(_row, shown)), {level: names for level, names in others.items() if names})


def _has_something(one: SubjectTelemetry) -> bool:
    return one.level in (Level.FAULT, Level.SUSPECT) or isfinite(one.score) or bool(one.values)


def _row(one: SubjectTelemetry) -> SubjectRow:
    text = "" if one.level is Level.NORMAL else one.text
    return SubjectRow(short(one.subject), one.level, share(one), one.score, values_words(one.values), text)


def share(one: SubjectTelemetry) -> float:
    """How far a subject is off, signed, as a share of its threshold; NaN where nothing shows it."""
    values = one.values
    threshold_rpm = values.get("threshold_rpm", nan)
    residual = values.get("residual_rpm", nan) / threshold_rpm if threshold_rpm > 0.0 else nan
    least_mps, most_mps = values.get("speed_min_mps", nan), values.get("speed_max_mps", nan)
    half_mps = (most_mps - least_mps) / 2.0
    speed = (values.get("speed_mps", nan) - least_mps) / half_mps - 1.0 if half_mps > 0.0 else nan
    return next((one for one in (residual, speed, one.score) if isfinite(one)), nan)


def values_words(values: Mapping[str, float]) -> tuple[str, ...]:
    """What a detector says beside its level, in parts that may be cut apart."""
    parts = (_rpm(values), *_drive(values), *_speed(values), *_sensor(values))
    return tuple(filter(None, parts))


def _known(values: Mapping[str, float], names: Iterable[str]) -> list[float]:
    """Those of the values, NaN where one is not known; empty where none is."""
    numbers = [values.get(name, nan) for name in names]
    return numbers if any(map(isfinite, numbers)) else []


def _rpm(values: Mapping[str, float]) -> str:
    """Command, and the measured speed of the predicted one."""
    match _known(values, ("speed_rpm", "predicted_rpm")):
        case [measured, predicted]:
            command = number(100.0 * values.get("command", nan), "+.0f")
            return f"{command:>4} %  {number(measured):>5} of {number(predicted):>5} rpm"
    return ""


def _drive(values: Mapping[str, float]) -> Iterable[str]:
    """Current of a thruster, and how far it has drifted from how it was."""
    if isfinite(amperes := values.get("current_a", nan)):
        yield f"{amperes:4.1f} A"
    if abs(wear := values.get("wear", nan)) >= WEAR:
        yield f"worn {100.0 * wear:+.0f} %"


def _speed(values: Mapping[str, float]) -> Iterable[str]:
    match _known(values, ("speed_mps", "speed_min_mps", "speed_max_mps")):
        case [speed_mps, least_mps, most_mps]:
            normal = f" of {least_mps:.2f}-{most_mps:.2f}" if isfinite(least_mps) and isfinite(most_mps) else ""
            yield f"{number(speed_mps, '.2f')}{normal} m/s"
    flow = flow_words((values.get("flow_north_mps", nan), values.get("flow_east_mps", nan)))
    if flow != UNKNOWN:
        yield f"flow {flow}"


def _sensor(values: Mapping[str, float]) -> Iterable[str]:
    """Of the navigation watch: how far a sensor is off what is expected, where the vehicle is, what is left out."""
    match _known(values, ("innovation_forward_mps", "innovation_right_mps")):
        case [forward, right]:
            yield f"off {number(forward, '+z.2f')} {number(right, '+z.2f')} m/s"
    for name, form in (("innovation_depth_m", "off {:+z.2f} m"), ("depth_m", "depth {:.1f} m")):
        if isfinite(value := values.get(name, nan)):
            yield form.format(value)
    if isfinite(heading := values.get("heading_deg", nan)):
        yield f"heading {round(heading) % 360:03d}"
    if values.get("isolated", 0.0) > 0.0:
        yield "not used"

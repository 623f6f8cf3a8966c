"""What the speed watch needs of healthy dives: the normal speed over the thrust, and how far it may be off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from detectors.speed import PoseSample, SpeedConfig, SpeedCurve
from gateway.commissioning.dive import RecordedDive
from gateway.commissioning.health import faulty_dives
from gateway.commissioning.part import Part, Quantity, Setting, Value
from gateway.commissioning.peaks import Tail, counted
from gateway.commissioning.speed_figures import speed_figures
from gateway.commissioning.speed_learning import SQUARE, Learnt, MissingError, learn, percent
from gateway.commissioning.speed_tolerance import Watched, false_alarms, judged_hours, tail, tolerance_for, watched
from gateway.config import Config

SUBJECT = "speed"
FOLDS = 4  # dives that are left out, one after the other, to see what the rest is worth
TOLERABLE = 0.4  # with a wider range, little is found

Samples = Sequence[PoseSample]


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far the speed may be off.

    Attributes:
        share: of the normal speed. law: what it was taken from; None: too little, it is as configured.
    """

    share: float
    law: Tail | None


@dataclass(frozen=True, slots=True)
class Reached:
    """FAULTs in healthy dives that nothing was learnt from. `hours`: of them, judged; 0: there is none."""

    events: int = 0
    hours: float = 0.0


def commission_speed(
    config: Config, dives: Sequence[RecordedDive], false_alarms_per_hour: float, vouched: bool = False
) -> Part:
    """The settings of `[speed]` that these healthy dives support.

    Args:
        config: that they were read by; with `[speed]`.
        dives: with their pose samples.
        false_alarms_per_hour: that are wanted.
        vouched: the user says that they are healthy, whatever was found in them.

    Raises:
        ValueError: the configuration has no `[speed]`, or the wanted rate is not above 0.
    """
    settings = config.detector.speed
    if settings is None:
        raise ValueError("no [speed] in the configuration: want the table, it may be empty")
    if not false_alarms_per_hour > 0.0:
        raise ValueError(f"false_alarms_per_hour = {false_alarms_per_hour}: want above 0")
    if not vouched and (faults := faulty_dives("speed", dives)):
        return Part(SUBJECT, missing=faults)
    samples = [[one.sample for one in dive.poses] for dive in dives]
    try:
        learnt = learn(samples)
    except MissingError as error:
        return Part(SUBJECT, missing=error.args)
    courses = [watched(one, learnt.normal, settings) for one in samples]
    tolerance = tolerance_of(courses, learnt, settings, false_alarms_per_hour)
    reached = held_out(samples, settings, false_alarms_per_hour)
    return Part(
        SUBJECT,
        settings=tuple(_settings(learnt, tolerance)),
        quantities=tuple(_quantities(learnt, tolerance, reached)),
        remarks=tuple(_remarks(learnt, tolerance)),
        removed=_removed(learnt),
        figures=speed_figures(learnt, courses, tolerance.share),
    )


def tolerance_of(
    courses: Sequence[Watched], learnt: Learnt, settings: SpeedConfig, false_alarms_per_hour: float
) -> Tolerance:
    """From what the watch saw of healthy dives; as configured, where that is too little."""
    law = tail(courses)
    if law is None:
        return Tolerance(settings.tolerance, None)
    return Tolerance(tolerance_for(law, false_alarms_per_hour, learnt.error), law)


def held_out(samples: Sequence[Samples], settings: SpeedConfig, false_alarms_per_hour: float) -> Reached:
    """Learns from some dives, and counts false alarms in the others; of one dive, its halves."""
    events, hours = 0, 0.0
    for rest, left_out in _folds(samples):
        try:
            learnt = learn(rest)
        except MissingError:
            continue
        normal = learnt.normal
        seen = [watched(one, normal, settings) for one in rest]
        share = tolerance_of(seen, learnt, settings, false_alarms_per_hour).share
        events += false_alarms(left_out, normal, settings, share)
        hours += judged_hours([watched(left_out, normal, settings)])
    return Reached(events, hours)


def _folds(samples: Sequence[Samples]) -> Iterator[tuple[list[Samples], Samples]]:
    parts = [one for one in samples if len(one) > 1]
    if len(parts) == 1:
        half = len(parts[0]) // 2
        parts = [parts[0][:half], parts[0][half:]]
    for index in range(min(len(parts), FOLDS)):
        yield [*parts[:index], *parts[index + 1 :]], parts[index]


def _settings(learnt: Learnt, tolerance: Tolerance) -> Iterator[Setting]:
    speed = learnt.normal.speed
    of_law = f"of {tolerance.law.hours:.2f} h of healthy dives" if tolerance.law is not None else ""
    if isinstance(speed, SpeedCurve):
        points: list[Value] = [[*point] for point in zip(speed.commands, speed.speeds_mps, strict=True)]
        yield Setting("speed.curve", points, "[thrust, m/s], learnt in healthy dives")
        if tolerance.law is not None:
            yield Setting("speed.tolerance", tolerance.share, of_law)
        if len(points) > 1:
            yield Setting(
                "detector.speed.surge_time_s", learnt.normal.surge_time_s, "how the hull follows its thrust"
            )
    else:
        low_mps, high_mps = (speed * (1.0 + side * tolerance.share) for side in (-1.0, 1.0))
        yield Setting("speed.minimum_mps", round(low_mps, 3), f"usual: {speed:.2f} m/s, at whatever thrust")
        yield Setting("speed.maximum_mps", round(high_mps, 3), of_law)


def _removed(learnt: Learnt) -> tuple[str, ...]:
    """Keys that say otherwise what is normal."""
    if isinstance(learnt.normal.speed, SpeedCurve):
        return "speed.minimum_mps", "speed.maximum_mps", "speed.command"
    return "speed.curve", "speed.command"


def _quantities(learnt: Learnt, tolerance: Tolerance, reached: Reached) -> Iterator[Quantity]:
    levels, told = learnt.fit.levels, isinstance(learnt.normal.speed, SpeedCurve)
    columns = (levels.commands, levels.seconds, learnt.fit.speed_mps, learnt.fit.error_mps, learnt.known)
    for command, seconds, speed_mps, error_mps, known in zip(*columns, strict=True):
        name = f"speed at {percent(command)} thrust" if told else "speed"
        doubt = "" if known else "; not used: the headings cannot tell it from the current"
        yield Quantity(name, f"{speed_mps:.2f} m/s", f"+-{error_mps:.2f} m/s, of {seconds:.0f} s{doubt}")
    law = tolerance.law
    yield Quantity("tolerance", percent(tolerance.share), f"of {law.hours:.2f} h" if law else "as configured")
    if reached.hours > 0.0:
        bound = counted(reached.events, reached.hours).bound_per_hour
        sure = f"in {reached.hours:.2f} h; below {bound:.{1 if bound < 10.0 else 0}f} an hour (95 %)"
        yield Quantity("false alarms where nothing was learnt", f"{reached.events}", sure)


def _remarks(learnt: Learnt, tolerance: Tolerance) -> Iterator[str]:
    if tolerance.law is None:
        yield "too short to learn a tolerance: it stays as it is; ten minutes of turns are enough for one"
    if tolerance.share >= TOLERABLE:
        yield (
            f"the speed wavers so much that less than {percent(tolerance.share)} of it lost is not found: was the "
            "vehicle well, and are its positions?"
        )
    if not isinstance(learnt.normal.speed, SpeedCurve):
        yield "no thrust was known: with `ahead` of the thrusters that drive the vehicle, the speed is learnt over it"
    for command, known in zip(learnt.fit.levels.commands, learnt.known, strict=True):
        if not known:
            side = "ahead" if command > 0.0 else "astern"
            thrust = f"{percent(abs(command))} thrust {side}"
            yield f"the speed at {thrust} is not known: {SQUARE.format(thrust)}"

"""From what is known of the sensors to what is said of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from detectors.navigation.blame import Blame, Suspicion
from detectors.navigation.isolation import Isolation
from detectors.navigation.sample import (
    MEASURED,
    DvlSample,
    ImuSample,
    NavigationSample,
    Sensor,
    SensorVerdict,
)
from detectors.navigation.thresholds import SUSPECT_SHARE
from detectors.verdict import Level

SampleType = type[NavigationSample]

# Those that are missed when they do not come, and by what name.
MISSED: tuple[tuple[str, SampleType], ...] = (("imu", ImuSample), *MEASURED.items())
NOTHING_HEARD = "no sample of the DVL yet"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """What is known of the sensors.

    Attributes:
        isolated: those whose measurements are not used.
        jumped: inertial ones whose bias is another than it was, and what was found then.
        blame: what there is against the others.
        settled: the filter has found itself.
        begun: it has had a sample of the DVL.
        silent: kinds of samples that do not come any more. unheard: that never came.
    """

    isolated: Mapping[Sensor, Isolation] = field(default_factory=dict)
    jumped: Mapping[Sensor, Suspicion] = field(default_factory=dict)
    blame: Blame = field(default_factory=Blame)
    settled: bool = False
    begun: bool = False
    silent: frozenset[SampleType] = frozenset()
    unheard: frozenset[SampleType] = frozenset()


@dataclass(frozen=True, slots=True)
class Conclusion:
    """What is said of the sensors, as in `NavigationVerdict`."""

    sensors: tuple[SensorVerdict, ...] = ()
    level: Level = Level.UNKNOWN
    score: float = 0.0
    reason: str = NOTHING_HEARD


def conclude(situation: Situation) -> Conclusion:
    """The verdict on each sensor, and on all of them."""
    sensors = tuple(_of(sensor, situation) for sensor in Sensor)
    level = Level.FAULT if situation.blame.doubtful else max(one.level for one in sensors)
    return Conclusion(sensors, level, max(one.score for one in sensors), _reason(situation, sensors))


def _of(sensor: Sensor, situation: Situation) -> SensorVerdict:
    if (isolation := situation.isolated.get(sensor)) is not None:
        return SensorVerdict(sensor, Level.FAULT, 1.0, isolation.kind, isolation.size, isolation.rate, isolated=True)
    if (jump := situation.jumped.get(sensor)) is not None:
        return SensorVerdict(sensor, Level.FAULT, max(jump.score, 1.0), jump.kind, jump.size, jump.rate)
    suspicion = situation.blame.against(sensor)
    score = 0.0 if suspicion is None else max(suspicion.score, 0.0)
    if not situation.settled or sensor in situation.blame.doubtful or _unjudgeable(sensor, situation):
        return SensorVerdict(sensor, Level.UNKNOWN, score)
    if suspicion is None or score < SUSPECT_SHARE:
        return SensorVerdict(sensor, Level.NORMAL, score)
    level = Level.FAULT if score >= 1.0 else Level.SUSPECT
    return SensorVerdict(sensor, level, score, suspicion.kind, suspicion.size, suspicion.rate)


def _unjudgeable(sensor: Sensor, situation: Situation) -> bool:
    """Not heard, or not to be judged without another that is not heard: the inertial sensors without the DVL, and
    all without the inertial ones."""
    needed = {ImuSample, MEASURED.get(sensor, DvlSample)}
    return not needed.isdisjoint(situation.silent | situation.unheard)


def _reason(situation: Situation, sensors: tuple[SensorVerdict, ...]) -> str:
    if situation.blame.doubtful:
        return " or ".join(situation.blame.doubtful)
    if not situation.settled:
        return "finding out how the sensors are mounted" if situation.begun else NOTHING_HEARD
    troubles = [f"{one.sensor} {one.kind}" for one in sensors if one.kind is not None]
    return ", ".join(troubles + [f"{name} silent" for name, kind in MISSED if kind in situation.silent])

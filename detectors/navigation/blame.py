"""From evidence to the sensor that is to blame, where one can be told from the others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from detectors.navigation.condition import Condition
from detectors.navigation.ratio import Explanation
from detectors.navigation.sample import FaultKind, Sensor, Vector

INERTIAL = (Sensor.GYROSCOPE, Sensor.ACCELEROMETER)
# One sensor is named when it explains what is seen so much better than any other, as twice the logarithm of the
# likelihood ratio.
NAMED = 6.0


@dataclass(frozen=True, slots=True, eq=False)
class Suspicion:
    """What there is against one sensor.

    Attributes:
        sensor, kind: which, and how it seems to fail.
        score: 1.0 is a fault.
        explanation: size and consequences, where they are known.
    """

    sensor: Sensor
    kind: FaultKind
    score: float
    explanation: Explanation | None = None

    @property
    def proven(self) -> bool:
        """The sensor's own samples show it, whatever else may explain them."""
        return self.score >= 1.0 and self.kind in (FaultKind.STUCK, FaultKind.NOISE, FaultKind.INTERMITTENT)

    @property
    def size(self) -> Vector:
        """(3,) of the error now."""
        found = self.explanation
        return (0.0, 0.0, 0.0) if found is None else found.size_now

    @property
    def rate(self) -> float:
        """At which it grows, per second."""
        found = self.explanation
        return 0.0 if found is None or self.kind is not FaultKind.DRIFT else float(np.linalg.norm(found.size))


@dataclass(frozen=True, slots=True, eq=False)
class Blame:
    """What there is against all sensors.

    Attributes:
        suspicions: the gravest first.
        explanations: the best of each sensor, where the likelihood ratio judges.
        doubtful: something is wrong, and it may be any of these sensors; empty where it can be told.
    """

    suspicions: Sequence[Suspicion] = ()
    explanations: Sequence[Explanation] = ()
    doubtful: tuple[Sensor, ...] = ()

    @property
    def worst(self) -> float:
        """Score of the gravest."""
        return max((one.score for one in self.suspicions), default=0.0)

    def against(self, sensor: Sensor) -> Suspicion | None:
        """The gravest suspicion of one sensor."""
        return next((one for one in self.suspicions if one.sensor is sensor), None)


def blame(
    explanations: Sequence[Explanation],
    threshold: float,
    conditions: Mapping[Sensor, Condition],
    *,
    explained: bool = False,
) -> Blame:
    """Weighs what the likelihood ratio and the sensors' own samples say.

    Args:
        explanations, threshold, conditions: as for `suspicions`.
        explained: a sensor was blamed already, and that may be an inertial one's doing: one fault explains it all,
            whoever's it is.
    """
    possible = named(explanations)
    found = suspicions([one for one in explanations if one.family.sensor in possible], threshold, conditions)
    if explained:
        return Blame([one for one in found if one.sensor not in INERTIAL], explanations)
    doubtful = len(possible) > 1 and explanations[0].ratio > threshold
    return Blame(found, explanations, possible if doubtful else ())


def suspicions(
    explanations: Iterable[Explanation], threshold: float, conditions: Mapping[Sensor, Condition]
) -> list[Suspicion]:
    """All that there is against each sensor, the gravest first.

    Args:
        explanations: one for each sensor.
        threshold: ratio at which an explanation is a fault.
        conditions: what shows in the sensors' own samples.
    """
    found = [Suspicion(one.family.sensor, one.family.kind, one.ratio / threshold, one) for one in explanations]
    likely = {one.sensor: one.explanation for one in found if one.score >= 0.5}
    for sensor, condition in conditions.items():
        score, kind = condition.evidence()
        found.append(Suspicion(sensor, kind, score, likely.get(sensor)))
    return sorted(found, key=lambda one: (not one.proven, -one.score))


def named(explanations: Sequence[Explanation]) -> tuple[Sensor, ...]:
    """The sensors that what is seen may come from: one where it can be told."""
    weighed = {one.family.sensor: one.weight for one in explanations}
    best = max(weighed.values(), default=0.0)
    return tuple(sensor for sensor, ratio in weighed.items() if ratio > best - NAMED)

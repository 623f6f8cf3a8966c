"""What the first run with a commissioned configuration starts from: a state file in which its thrusters are known."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from detectors.thruster import ThrusterDetector
from detectors.verdict import Level
from gateway.channel import Learnt
from gateway.commissioning.dive import ThrusterSamples
from gateway.commissioning.excitation import excitation
from gateway.commissioning.successive import successive
from gateway.commissioning.thruster import LearntThruster
from gateway.config import Config
from gateway.moment import present
from gateway.pipeline import Pipeline
from gateway.state import State


@dataclass(frozen=True, slots=True)
class Taught:
    """Detectors that went through the dives with the settings of the new configuration.

    Attributes:
        state: what a run takes up.
        faults: how often they said FAULT.
        thruster_hours: that they judged, of all thrusters together.
    """

    state: State
    faults: int
    thruster_hours: float


def taught(config: Config, thrusters: Sequence[LearntThruster]) -> Taught:
    """Has detectors of the new configuration go through the dives, the learnt curves being the commissioned ones."""
    pipeline = Pipeline(config)
    fresh, learnt = pipeline.learnt(), dict[str, Learnt]()
    faults, hours = 0, 0.0
    for one in thrusters:
        if not one.sound or one.response is None:
            continue
        subject = f"thruster {one.number}"
        detector = ThrusterDetector(fresh[subject].detector.config, one.response.curve.commissioned())
        dives = sorted(one.samples, key=_reach)
        for samples, columns in zip(dives, successive(dives), strict=True):
            level = detector.run(*columns).level
            faults += int(((level[1:] == Level.FAULT) & (level[:-1] != Level.FAULT)).sum())
            hours += float((level != Level.UNKNOWN).sum()) / samples.rate_hz / 3600.0
        detector.begin_dive()
        learnt[subject] = replace(fresh[subject], alignment=one.samples[0].rate_hz, detector=detector)
    return Taught(State(present(), time.time(), learnt, pipeline.remember()), faults, hours)


def _reach(samples: ThrusterSamples) -> float:
    """How much of its commands a dive shows: the one that shows most comes last, for a detector knows its newest."""
    driven = excitation([samples])
    return driven.ahead + driven.astern

"""The kind of a fault, as far as speed and current can tell it."""

from dataclasses import replace

import numpy as np
import pytest

from detectors.thruster import FaultKind, ThrusterDetector
from detectors.thruster.tests.simulation import Thruster, cruising, lasting
from detectors.verdict import Level

COUNT, ONSET = 1100, 750
SURE = 25  # samples after the onset from which on the kind must be right: a motor takes a while to stop
SEEDS = (10, 12)


def simulated(seed, gain=1.0, load=1.0):
    gains, loads = lasting(COUNT, ONSET, gain), lasting(COUNT, ONSET, load)
    return Thruster().simulate(cruising(COUNT, seed, low=0.3), gain=gains, load=loads, current=True, seed=seed)


def without_current(series):
    return replace(series, current_a=None)


CASES = {
    "weeds": (FaultKind.ENTANGLED, lambda seed: simulated(seed, 0.8, 2.5)),
    "weeds, current not known": (FaultKind.ENTANGLED, lambda seed: without_current(simulated(seed, 0.8))),
    "propeller off": (FaultKind.PROPELLER_LOST, lambda seed: simulated(seed, 1.25, 0.15)),
    "propeller off, current not known": (
        FaultKind.PROPELLER_LOST,
        lambda seed: without_current(simulated(seed, 1.25)),
    ),
    "stuck": (
        FaultKind.BLOCKED,
        lambda seed: simulated(seed, 0.0).spoiled(slice(ONSET + 3, None), current_a=25.0),
    ),
    "no power": (FaultKind.DEAD, lambda seed: simulated(seed, 0.0)),
    "at a standstill, current not known": (FaultKind.STOPPED, lambda seed: without_current(simulated(seed, 0.0))),
    "phases swapped": (FaultKind.REVERSED, lambda seed: simulated(seed, -1.0)),
    "propeller off, far faster than ever": (FaultKind.PROPELLER_LOST, lambda seed: simulated(seed, 1.8, 0.05)),
    "impossible speed": (
        FaultKind.SENSOR,
        lambda seed: simulated(seed).spoiled(slice(ONSET, None), speed_rpm=65535.0),
    ),
    "faster at unchanged load": (FaultKind.SENSOR, lambda seed: simulated(seed, 1.25)),
}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("case", CASES)
def test_kind(case, seed):
    kind, make = CASES[case]
    verdicts = ThrusterDetector().run(*make(seed).arguments)
    assert set(verdicts.level[:ONSET].tolist()) == {Level.UNKNOWN, Level.NORMAL}
    assert set(verdicts.kind[:ONSET]) == {FaultKind.NONE}
    assert set(verdicts.level[ONSET + SURE :].tolist()) == {Level.FAULT}
    assert set(verdicts.kind[ONSET + SURE :]) == {kind}


@pytest.mark.parametrize("seed", SEEDS)
def test_a_frozen_sensor_stays_one(seed):
    series = simulated(seed)
    frozen = series.spoiled(slice(ONSET, None), speed_rpm=float(series.speed_rpm[ONSET]))
    verdicts = ThrusterDetector().run(*frozen.arguments)
    faults = np.flatnonzero(verdicts.level == Level.FAULT)
    assert ONSET < faults[0] < ONSET + 100
    assert set(verdicts.kind[faults[0] + 60 :]) == {FaultKind.SENSOR}

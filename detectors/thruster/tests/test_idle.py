"""When the detector learns: rarely where nothing is new, soon where something is."""

import numpy as np
import pytest

from detectors.thruster import ThrusterDetector
from detectors.thruster.schedule import IDLE_MAX, INTERVAL_MAX, INTERVAL_MIN
from detectors.thruster.tests.simulation import Thruster
from detectors.verdict import Level

MATURE, COUNT = 5100, 9000  # samples


def swinging(samples: int = COUNT) -> np.ndarray:
    number = np.arange(samples)
    return 0.5 + 0.2 * np.sin(number / 11.0) + 0.1 * np.sin(number / 37.0)


def refits(command, gain=1.0) -> np.ndarray:
    series = Thruster().simulate(command, gain=gain, seed=4)
    verdicts = ThrusterDetector().run(*series.arguments)
    assert (verdicts.level[MATURE:] < Level.FAULT).all()
    return np.flatnonzero(verdicts.refitted)


@pytest.fixture(scope="module")
def undisturbed() -> np.ndarray:
    return refits(swinging())


def test_where_nothing_is_new_it_learns_rarely_but_on_and_on(undisturbed):
    late = np.diff(undisturbed[undisturbed > MATURE])
    assert len(late) >= 2
    assert (late == (1 + IDLE_MAX) * INTERVAL_MAX).all()


def test_a_young_model_is_learnt_at_every_interval(undisturbed):
    early = np.diff(undisturbed[undisturbed < 5000])
    assert early.min() >= INTERVAL_MIN
    assert early.max() <= INTERVAL_MAX


def test_a_new_command_is_learnt_soon(undisturbed):
    begin = int(undisturbed[undisturbed > MATURE][0]) + 100
    command = swinging()
    command[begin : begin + 400] = 0.95
    later = refits(command)
    later = later[later > begin]
    assert later[0] - begin <= INTERVAL_MAX
    assert later[1] - later[0] == INTERVAL_MIN  # that confirms it


def test_a_drift_is_followed_at_every_interval():
    drifting = np.interp(np.arange(COUNT), [0, MATURE, COUNT], [1.0, 1.0, 0.93])
    late = np.diff(refits(swinging(), drifting))[-4:]
    assert late.min() < (1 + IDLE_MAX) * INTERVAL_MAX

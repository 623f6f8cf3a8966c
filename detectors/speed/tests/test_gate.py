from math import inf

import numpy as np
import pytest

from detectors.speed.gate import AGREEING, Fate, PositionGate

SPREAD_M = 0.2


def fates(*left_m, gate=None):
    gate = gate or PositionGate()
    return [gate.judge(np.array(one, dtype=float), SPREAD_M) for one in left_m]


def test_normal_scatter_is_taken():
    scatter = np.random.default_rng(0).normal(size=(20000, 3)) * SPREAD_M
    assert set(fates(*scatter)) == {Fate.TAKEN}


@pytest.mark.parametrize("far_m", [(25.0, 0.0), (0.0, -5.0), (1e6, 1e6), (0.0, 0.0, 3.0)])
def test_an_outlier_is_refused_and_the_next_position_taken(far_m):
    near_m = (0.0,) * len(far_m)
    assert fates(near_m, far_m, near_m, far_m, near_m) == [
        Fate.TAKEN, Fate.OUTLIER, Fate.TAKEN, Fate.OUTLIER, Fate.TAKEN,
    ]  # fmt: skip


def test_positions_that_stay_elsewhere_are_a_jump_and_only_once():
    there_m = (30.0, 0.0)
    said = fates(*[there_m] * AGREEING)
    assert said == [Fate.OUTLIER] * (AGREEING - 1) + [Fate.JUMP]


def test_after_a_jump_it_begins_to_count_anew():
    gate = PositionGate()
    fates(*[(30.0, 0.0)] * AGREEING, gate=gate)
    assert fates((0.0, 0.0), (30.0, 0.0), gate=gate) == [Fate.TAKEN, Fate.OUTLIER]


def test_outliers_that_do_not_agree_are_no_jump():
    rng = np.random.default_rng(1)
    assert set(fates(*rng.uniform(-1e3, 1e3, size=(200, 2)))) == {Fate.OUTLIER}


def test_outliers_that_agree_but_for_positions_between_them_are_no_jump():
    series = [(30.0, 0.0), (0.0, 0.0)] * 20
    assert Fate.JUMP not in fates(*series)


def test_one_disagreement_starts_the_count_over():
    said = fates((30.0, 0.0), (30.0, 0.1), (-40.0, 0.0), (30.0, 0.0), (30.0, 0.1), (30.0, 0.0))
    assert said == [Fate.OUTLIER] * 5 + [Fate.JUMP]


def test_where_nothing_is_known_every_position_is_taken():
    gate = PositionGate()
    assert gate.judge(np.array([1e6, -1e6]), inf) is Fate.TAKEN

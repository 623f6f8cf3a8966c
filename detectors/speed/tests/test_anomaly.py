import pickle
from math import nan

import numpy as np
import pytest

from detectors.speed.anomaly import LEVELS, Flag, FlowComparison, ForeseenFlow, flag
from detectors.speed.basis import FlowBasis
from detectors.speed.flow_models import ConstantFlow
from detectors.speed.learnt_flow import FixedBasisFlow
from detectors.speed.moving_basis import MovingBasisFlow
from detectors.verdict import Level

HERE = np.zeros(2)
EAST, WEST = np.array([0.0, 0.5]), np.array([0.0, -0.5])
TIDAL = FlowBasis(((0.0, 0.0),), (5.0,), (0.01,))


class Silent:
    """An outside model that ends at 10 s."""

    def velocity_mps(self, time_s, position_m):
        return np.full(2, nan) if time_s > 10.0 else EAST


def taught(flow, velocity, place=HERE, time_s=0.0):
    flow.move(place, time_s)
    values = flow.values(place, time_s)
    flow.learn(values, (velocity - flow.velocity_mps(time_s, place)) / (values @ values))
    return flow


def test_equation_14():
    comparison = FlowComparison()
    assert comparison.error(EAST, EAST) == 0.0
    assert comparison.error(EAST, WEST) == pytest.approx(1.0)  # as far apart as can be
    assert comparison.error(EAST, 0.5 * EAST) == pytest.approx(0.25)
    assert comparison.error(np.array([0.5, 0.0]), EAST) == pytest.approx(np.sqrt(0.5) / 1.0)


def test_equation_14_divides_by_the_running_maximum_of_both():
    comparison = FlowComparison()
    assert comparison.error(0.1 * EAST, 0.2 * EAST) == pytest.approx(0.25)
    comparison.error(0.2 * EAST, 4.0 * EAST)
    assert comparison.error(0.1 * EAST, 0.2 * EAST) == pytest.approx(0.25 / 20)
    comparison.error(8.0 * EAST, 4.0 * EAST)
    assert comparison.error(0.1 * EAST, 0.2 * EAST) == pytest.approx(0.25 / 40)


def test_water_that_never_moves_is_as_foreseen():
    assert FlowComparison().error(HERE, HERE) == 0.0


@pytest.mark.parametrize(
    ("flow_error", "normal", "expected"),
    [
        (0.0, True, Flag.NO_ANOMALY),
        (0.07, True, Flag.NO_ANOMALY),
        (0.0701, True, Flag.FALSE_ALARM),
        (0.07, False, Flag.ANOMALY),
        (0.0701, False, Flag.FALSE_ALARM),
    ],
)
def test_algorithm_2(flow_error, normal, expected):
    assert flag(flow_error, 0.07, normal) is expected


def test_levels_of_the_flags():
    assert [LEVELS[one] for one in (0, 1, 2)] == [Level.NORMAL, Level.FAULT, Level.UNKNOWN]


@pytest.mark.parametrize("learnt", [FixedBasisFlow(FlowBasis(((0.0, 0.0),), (1e6,))), MovingBasisFlow()])
def test_while_the_speed_is_normal_the_learnt_flow_is_foreseen(learnt):
    foreseen = ForeseenFlow()
    for velocity in (EAST, WEST):
        taught(learnt, velocity)
        np.testing.assert_allclose(foreseen.velocity_mps(learnt, True, 0.0, HERE), velocity)


@pytest.mark.parametrize("learnt", [FixedBasisFlow(FlowBasis(((0.0, 0.0),), (1e6,))), MovingBasisFlow()])
def test_while_it_is_not_the_last_normal_one_is(learnt):
    foreseen = ForeseenFlow()
    foreseen.velocity_mps(taught(learnt, EAST), True, 0.0, HERE)
    taught(learnt, WEST)
    np.testing.assert_allclose(foreseen.velocity_mps(learnt, False, 1.0, HERE), EAST)
    np.testing.assert_allclose(foreseen.velocity_mps(learnt, True, 2.0, HERE), WEST)


def test_frozen_parameters_are_carried_on_in_time_and_place():
    """What is frozen is xi: tide and place are those of now."""
    foreseen, learnt = ForeseenFlow(), taught(FixedBasisFlow(TIDAL), EAST)
    foreseen.velocity_mps(learnt, True, 0.0, HERE)
    taught(learnt, WEST)
    later, there = 200.0, np.array([3.0, 4.0])
    expected = EAST * TIDAL.values(there, later)[0]
    np.testing.assert_allclose(foreseen.velocity_mps(learnt, False, later, there), expected)


def test_an_outside_model_is_believed_where_it_says_something():
    foreseen, learnt = ForeseenFlow(Silent()), taught(MovingBasisFlow(), WEST)
    np.testing.assert_array_equal(foreseen.velocity_mps(learnt, True, 5.0, HERE), EAST)
    np.testing.assert_allclose(foreseen.velocity_mps(learnt, True, 11.0, HERE), WEST)


def test_pickled_they_go_on():
    foreseen, comparison = ForeseenFlow(ConstantFlow(0.1, 0.2)), FlowComparison()
    learnt = taught(MovingBasisFlow(), EAST)
    comparison.error(EAST, foreseen.velocity_mps(learnt, False, 0.0, HERE))
    again, compared = pickle.loads(pickle.dumps((foreseen, comparison)))  # noqa: S301
    said = foreseen.velocity_mps(learnt, False, 1.0, HERE)
    np.testing.assert_array_equal(again.velocity_mps(learnt, False, 1.0, HERE), said)
    assert compared.error(0.1 * EAST, said) == comparison.error(0.1 * EAST, said)

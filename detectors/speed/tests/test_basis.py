import pickle
from dataclasses import replace
from math import cos, exp, inf, nan, sqrt

import numpy as np
import pytest

from detectors.speed.basis import FlowBasis
from detectors.speed.learnt_flow import FixedBasisFlow
from detectors.speed.tides import constituent

TIDAL = FlowBasis(
    centres_m=((0.0, 0.0), (10.0, 10.0)), widths_m=(5.0, 2.0), frequencies_radps=(0.0, 1.4e-4), phases_rad=(0.0, 0.5)
)


def test_equation_6_as_printed():
    first, second = TIDAL.values(np.array([3.0, 4.0]), 1000.0)
    assert first == pytest.approx(exp(-5.0 / (2 * 5.0)))
    assert second == pytest.approx(exp(-sqrt(49 + 36) / (2 * 2.0)) * cos(0.14 + 0.5))


def test_equation_6_with_the_norm_squared():
    first, second = replace(TIDAL, squared=True).values(np.array([3.0, 4.0]), 1000.0)
    assert first == pytest.approx(exp(-25.0 / (2 * 25.0)))
    assert second == pytest.approx(exp(-85.0 / (2 * 4.0)) * cos(0.14 + 0.5))


def test_the_printed_norm_has_a_cusp_at_the_centre_and_its_square_none():
    printed = FlowBasis(((0.0, 0.0),), (5.0,))
    near = np.array([1e-3, 0.0])
    assert 1.0 - printed.values(near, 0.0)[0] == pytest.approx(1e-4, rel=1e-3)
    assert 1.0 - replace(printed, squared=True).values(near, 0.0)[0] < 1e-7


def test_without_frequencies_it_is_steady():
    steady = FlowBasis(TIDAL.centres_m, TIDAL.widths_m)
    place = np.array([1.0, 7.0])
    np.testing.assert_array_equal(steady.values(place, 0.0), steady.values(place, 1e6))
    assert steady.fastest_radps == 0.0


def test_a_tide_returns_after_its_period():
    moon = constituent("M2")
    tidal = FlowBasis(((0.0, 0.0),), (5.0,), (moon.frequency_radps,))
    place = np.array([1.0, 1.0])
    here = tidal.values(place, 100.0)
    np.testing.assert_allclose(tidal.values(place, 100.0 + moon.period_s), here, rtol=1e-9)
    np.testing.assert_allclose(tidal.values(place, 100.0 + moon.period_s / 2), -here, rtol=1e-9)


def test_depth_has_no_part_in_it():
    flat, deep = np.array([1.0, 2.0]), np.array([1.0, 2.0, 50.0])
    np.testing.assert_array_equal(TIDAL.values(flat, 5.0), TIDAL.values(deep, 5.0))


@pytest.mark.parametrize("squared", [False, True])
@pytest.mark.parametrize("place", [1e15, 1e30])
def test_far_away_it_is_nothing(squared, place):
    np.testing.assert_array_equal(replace(TIDAL, squared=squared).values(np.array([place, -place]), 1e15), 0.0)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"centres_m": ()}, "centres_m"),
        ({"centres_m": ((0.0, 0.0, 1.0),) * 2}, "centres_m"),
        ({"centres_m": ((0.0, nan), (0.0, 0.0))}, "centres_m"),
        ({"widths_m": (1.0,)}, "widths_m"),
        ({"widths_m": (1.0, 0.0)}, "widths_m"),
        ({"widths_m": (1.0, inf)}, "widths_m"),
        ({"frequencies_radps": (1.0,)}, "frequencies_radps"),
        ({"phases_rad": (1.0, nan)}, "phases_rad"),
    ],
)
def test_what_is_wrong_is_named(wrong, named):
    with pytest.raises(ValueError, match=named):
        replace(TIDAL, **wrong)


def test_it_is_a_value():
    again = pickle.loads(pickle.dumps(TIDAL))  # noqa: S301
    assert again == TIDAL
    assert hash(again) == hash(TIDAL)
    place = np.array([2.0, 9.0])
    np.testing.assert_array_equal(again.values(place, 77.0), TIDAL.values(place, 77.0))
    with pytest.raises(AttributeError):
        again.squared = True


def test_flow_is_parameters_times_basis():
    parameters = np.array([[0.9, 0.5], [0.8, -0.5]])
    flow = FixedBasisFlow(TIDAL, parameters=parameters)
    place = np.array([4.0, 6.0])
    np.testing.assert_allclose(flow.velocity_mps(50.0, place), parameters @ TIDAL.values(place, 50.0))


def test_learning_adds_the_outer_product_and_leaves_a_frozen_copy_alone():
    flow = FixedBasisFlow(TIDAL, dimensions=3)
    frozen = flow.frozen()
    flow.learn(np.array([0.5, 2.0]), np.array([1.0, 0.0, -1.0]))
    np.testing.assert_array_equal(flow.parameters, [[0.5, 2.0], [0.0, 0.0], [-0.5, -2.0]])
    np.testing.assert_array_equal(frozen.parameters, np.zeros((3, 2)))
    assert flow.dimensions == 3


@pytest.mark.parametrize("parameters", [np.zeros((2, 3)), np.full((2, 2), nan)])
def test_parameters_must_fit(parameters):
    with pytest.raises(ValueError, match="parameters"):
        FixedBasisFlow(TIDAL, parameters=parameters)

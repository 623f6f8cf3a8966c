"""Outside models of the flow against independent sums and interpolations."""

from __future__ import annotations

import pickle
from math import cos, pi, radians, sin, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator

from detectors.speed.flow_models import ConstantFlow, TidalConstituent, TidalFlow
from detectors.speed.gridded_flow import GriddedFlow
from detectors.speed.tides import constituent

HERE = np.array([10.0, 20.0])
DEEP = np.array([10.0, 20.0, 30.0])
NOW_S = 1_717_243_200.0


def test_constant_flow_sets_towards_its_direction():
    flow = ConstantFlow.towards(0.4, radians(85))
    assert flow.velocity_mps(NOW_S, HERE) == pytest.approx([0.4 * cos(radians(85)), 0.4 * sin(radians(85))])
    assert ConstantFlow(0.1, 0.2, -0.3).velocity_mps(NOW_S, DEEP) == pytest.approx([0.1, 0.2, -0.3])


def harmonics(hours: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A tide summed up with speeds in degrees an hour, as on paper: north and east."""
    m2, k1 = np.radians(28.984104 * hours), np.radians(15.041069 * hours)
    north = 0.05 + 0.40 * np.cos(m2 - 1.0) + 0.10 * np.cos(k1 + 2.0)
    east = -0.02 + 0.25 * np.cos(m2 - 2.5) + 0.05 * np.cos(k1 - 0.5)
    return north, east


def test_tide_with_an_epoch_is_the_sum_of_its_harmonics():
    tide = (TidalConstituent("M2", 0.40, 1.0, 0.25, 2.5), TidalConstituent("K1", 0.10, -2.0, 0.05, 0.5))
    flow = TidalFlow((0.05, -0.02), tide, epoch_s=NOW_S)
    hours = np.linspace(-200, 700, 400)
    told = np.array([flow.velocity_mps(NOW_S + 3600 * hour, HERE) for hour in hours])
    np.testing.assert_allclose(told.T, harmonics(hours), atol=2e-5)


def test_tide_without_one_has_greenwich_phases_and_nodal_corrections():
    flow = TidalFlow((0.0, 0.0), (TidalConstituent("O1", 1.0, 0.3, 0.5, -0.2),))
    factor, angle = constituent("O1").nodal(NOW_S)
    phase = constituent("O1").argument_rad(NOW_S) + angle
    wanted = [factor * cos(phase - 0.3), factor * 0.5 * cos(phase + 0.2), 0.0]
    assert flow.velocity_mps(NOW_S, DEEP) == pytest.approx(wanted)
    assert factor > 1.15  # in 2024 the nodal correction is no small one


@given(st.floats(0, 2), st.floats(-1, 1), st.floats(0, pi), st.floats(-pi, pi), st.floats(0, tau))
def test_tidal_ellipse_is_gone_round_as_its_numbers_say(semi_major, share, inclination, lag, phase):
    semi_minor = share * semi_major
    flow = TidalFlow(
        (0.0, 0.0), (TidalConstituent.from_ellipse("M2", semi_major, semi_minor, inclination, lag),), epoch_s=0.0
    )
    north, east = flow.velocity_mps(phase / constituent("M2").frequency_radps, HERE)
    wanted = complex(cos(inclination), sin(inclination)) * complex(
        semi_major * cos(phase - lag), semi_minor * sin(phase - lag)
    )
    assert complex(east, north) == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: ConstantFlow(float("nan"), 0.0), "north_mps = nan"),
        (lambda: TidalConstituent("M9", 1.0, 0.0, 1.0, 0.0), "'M9'"),
        (lambda: TidalConstituent("M2", 1.0, 0.0, -1.0, 0.0), "east_mps = -1.0"),
        (lambda: TidalConstituent("M2", 1.0, float("inf"), 1.0, 0.0), "north_lag_rad = inf"),
        (
            lambda: TidalFlow((0.0, 0.0), (TidalConstituent("M2", 1, 0, 1, 0), TidalConstituent("m2", 1, 0, 1, 0))),
            "M2",
        ),
        (lambda: TidalFlow((0.0, 0.0, 0.0), ()), "mean_mps"),
    ],
)
def test_models_that_make_no_sense_are_refused(make, named):
    with pytest.raises(ValueError, match=named):
        make()


TIMES = np.array([0.0, 3600.0, 5400.0])
LEVELS = np.array([0.5, 2.0, 10.0, 50.0])
NORTHS = np.array([-4000.0, -1000.0, 0.0, 2500.0])
EASTS = np.array([-3000.0, 0.0, 4000.0])


def grid(components: int = 2) -> GriddedFlow:
    shape = (len(TIMES), len(LEVELS), len(NORTHS), len(EASTS), components)
    return GriddedFlow(TIMES, LEVELS, NORTHS, EASTS, np.random.default_rng(5).normal(0, 0.3, shape))


times = st.floats(TIMES[0], TIMES[-1])
depths = st.floats(LEVELS[0], LEVELS[-1])
norths = st.floats(NORTHS[0], NORTHS[-1]) | st.sampled_from(list(NORTHS))
easts = st.floats(EASTS[0], EASTS[-1]) | st.sampled_from(list(EASTS))


@given(times, depths, norths, easts)
def test_grid_is_linear_between_its_nodes(time_s, depth, north, east):
    flow = grid(3)
    reference = RegularGridInterpolator((TIMES, LEVELS, NORTHS, EASTS), flow.grid_mps)
    told = flow.velocity_mps(time_s, np.array([north, east, depth]))
    assert told == pytest.approx(reference((time_s, depth, north, east)), abs=1e-12)


def test_above_the_uppermost_level_it_is_that_level():
    flow = grid()
    top = flow.velocity_mps(100.0, np.array([5.0, 6.0, LEVELS[0]]))
    assert flow.velocity_mps(100.0, np.array([5.0, 6.0, -0.2])) == pytest.approx(top)
    assert flow.velocity_mps(100.0, np.array([5.0, 6.0])) == pytest.approx(top[:2])
    assert top[2] == 0.0


@pytest.mark.parametrize(
    ("time_s", "position"),
    [
        (-1.0, (0, 0, 1)),
        (5401.0, (0, 0, 1)),
        (10.0, (2501, 0, 1)),
        (10.0, (0, -3001, 1)),
        (10.0, (0, 0, 50.1)),
        (10.0, (float("nan"), 0, 1)),
    ],
)
def test_outside_the_grid_nothing_is_known(time_s, position):
    assert np.isnan(grid().velocity_mps(time_s, np.array(position, dtype=float))).all()
    assert np.isfinite(grid().velocity_mps(10.0, np.array([0.0, 0.0, 1.0]))).all()


def test_land_reaches_as_far_as_it_would_count_and_no_farther():
    whole = grid()
    velocities = whole.grid_mps.copy()
    velocities[:, :, 3, 1] = np.nan  # one node of land, at north 2500, east 0
    flow = GriddedFlow(TIMES, LEVELS, NORTHS, EASTS, velocities)
    for north, east, dry in ((1, -1, True), (2500, 0, True), (2499, 3999, True), (0, 0, False), (-1, 0, False)):
        position = np.array([north, east, 3.0], dtype=float)
        assert np.isnan(flow.velocity_mps(60.0, position)).all() == dry
    shore = np.array([0.0, 10.0])  # along the nodes next to land
    assert flow.velocity_mps(60.0, shore) == pytest.approx(whole.velocity_mps(60.0, shore))


def test_steady_current_of_all_depths():
    flow = GriddedFlow(np.zeros(1), np.zeros(1), NORTHS, EASTS, np.full((1, 1, 4, 3, 2), 0.25))
    assert flow.velocity_mps(1e9, np.array([1.0, 2.0, 300.0])) == pytest.approx([0.25, 0.25, 0.0])


@pytest.mark.parametrize(
    ("axes", "shape", "named"),
    [
        ((TIMES[::-1], LEVELS, NORTHS, EASTS), (3, 4, 4, 3, 2), "time_s"),
        ((TIMES, LEVELS, NORTHS[:1], EASTS), (3, 4, 1, 3, 2), "north_m"),
        ((TIMES, LEVELS, NORTHS, EASTS), (3, 4, 3, 4, 2), "grid_mps has the shape"),
        ((TIMES, LEVELS, NORTHS, EASTS), (3, 4, 4, 3, 4), "2 or 3 components"),
    ],
)
def test_grid_that_does_not_fit_is_refused(axes, shape, named):
    with pytest.raises(ValueError, match=named):
        GriddedFlow(*axes, np.zeros(shape))


@pytest.mark.parametrize(
    "flow",
    [ConstantFlow(0.1, 0.2), TidalFlow((0.1, 0.0), (TidalConstituent("S2", 0.3, 0.1, 0.2, 0.4),)), grid()],
    ids=["constant", "tidal", "gridded"],
)
def test_pickled_it_says_the_same_bit_for_bit(flow):
    copy = pickle.loads(pickle.dumps(flow))  # noqa: S301
    for time_s in (0.0, 1234.5, 5400.0):
        assert (copy.velocity_mps(time_s, DEEP) == flow.velocity_mps(time_s, DEEP)).all()

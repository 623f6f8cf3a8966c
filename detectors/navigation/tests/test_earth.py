from math import pi, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.navigation.earth import (
    ROTATION_RADPS,
    curvature_radii_m,
    earth_rate_radps,
    gravity_gradient_ps2,
    gravity_mps2,
    transport_rate_radps,
)
from detectors.navigation.tests.ecef import ecef_m, ned_axes

latitudes = st.floats(-1.5, 1.5)


@given(latitudes)
def test_radii_are_those_by_which_positions_move_on_the_ellipsoid(latitude):
    step = 1e-6
    moved = [ecef_m(latitude + sign * step, 0.3, 0.0) for sign in (1, -1)]
    turned = [ecef_m(latitude, 0.3 + sign * step, 0.0) for sign in (1, -1)]
    meridian, transverse = curvature_radii_m(latitude)
    assert np.linalg.norm(moved[0] - moved[1]) / (2 * step) == pytest.approx(meridian, rel=1e-8)
    assert np.linalg.norm(turned[0] - turned[1]) / (2 * step) == pytest.approx(
        transverse * np.cos(latitude), rel=1e-6
    )


@pytest.mark.parametrize(
    ("latitude_deg", "depth_m"), [(0, 0), (0, 6000), (30, 0), (45, 100), (-60, 2000), (85, 0), (90, 10), (60, 11000)]
)
def test_gravity_is_that_of_oceanography(latitude_deg, depth_m):
    """TEOS-10, appendix D.3: GRS 80, and one relative gradient of sea water for all latitudes."""
    sine_squared = sin(radians(latitude_deg)) ** 2
    surface = 9.780327 * (1.0 + 5.2792e-3 * sine_squared + 2.32e-5 * sine_squared**2)
    expected = surface * (1.0 + 2.26e-7 * depth_m)
    assert gravity_mps2(radians(latitude_deg), depth_m) == pytest.approx(expected, abs=5e-6 + 3e-8 * depth_m)


def test_gravity_on_the_surface_by_published_values():
    """WGS 84: at the equator, at 45 degrees and at the poles."""
    assert gravity_mps2(0.0, 0.0) == pytest.approx(9.7803253359, abs=1e-10)
    assert gravity_mps2(pi / 4, 0.0) == pytest.approx(9.8061977695, abs=1e-8)
    assert gravity_mps2(-pi / 2, 0.0) == pytest.approx(9.8321849379, abs=1e-9)


@given(latitudes, st.floats(-10.0, 11000.0))
def test_the_gradient_is_gravitys(latitude, depth):
    difference = gravity_mps2(latitude, depth + 500.0) - gravity_mps2(latitude, depth - 500.0)
    assert difference / 1000.0 == pytest.approx(gravity_gradient_ps2(latitude), rel=1e-8)


@given(latitudes)
def test_the_rate_of_the_earth_is_about_its_axis(latitude):
    axis = ned_axes(latitude, 1.0) @ np.array([0.0, 0.0, ROTATION_RADPS])
    np.testing.assert_allclose(earth_rate_radps(latitude), axis, atol=1e-18)


@given(st.floats(-1.4, 1.4), st.tuples(*[st.floats(-5.0, 5.0)] * 3), st.floats(0.0, 6000.0))
def test_the_transport_rate_is_the_rotation_of_the_axes_under_way(latitude, velocity, depth):
    interval = 1.0
    meridian, transverse = curvature_radii_m(latitude)
    north, east = velocity[0] / (meridian - depth), velocity[1] / (transverse - depth) / np.cos(latitude)
    after = ned_axes(latitude + 0.5 * north * interval, 0.5 * east * interval)
    before = ned_axes(latitude - 0.5 * north * interval, -0.5 * east * interval)
    spin = (before @ after.T - np.eye(3)) / interval  # the cross-product matrix of the rotation
    expected = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    np.testing.assert_allclose(transport_rate_radps(velocity, latitude, depth), expected, atol=1e-9 * 0.05)

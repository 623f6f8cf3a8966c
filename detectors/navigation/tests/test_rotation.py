from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from detectors.navigation.rotation import (
    between,
    cross,
    from_euler,
    from_rotation_vector,
    inverse,
    matrix,
    normalised,
    product,
    rotate,
    rotate_back,
    to_euler,
    to_rotation_vector,
)

numbers = st.floats(-1.0, 1.0)
vectors = st.tuples(*[st.floats(-20.0, 20.0)] * 3)
quaternions = st.tuples(*[numbers] * 4).filter(lambda q: np.linalg.norm(q) > 0.01).map(normalised)
turns = st.tuples(*[st.floats(-1.8, 1.8)] * 3)  # shorter than half a turn


def scipys(quaternion):
    return Rotation.from_quat(quaternion, scalar_first=True)


def same_rotation(one, other):
    return abs(abs(np.dot(one, other)) - 1.0) < 1e-14 and (scipys(one).inv() * scipys(other)).magnitude() < 3e-15


@given(quaternions, quaternions, vectors)
def test_products_and_rotated_vectors_are_scipys(one, other, vector):
    np.testing.assert_allclose(rotate(one, vector), scipys(one).apply(vector), atol=1e-13)
    np.testing.assert_allclose(rotate_back(one, vector), scipys(one).inv().apply(vector), atol=1e-13)
    np.testing.assert_allclose(matrix(one), scipys(one).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(matrix(product(one, other)), (scipys(one) * scipys(other)).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(matrix(inverse(one)), matrix(one).T, atol=1e-15)


@given(turns)
@example((0.0, 0.0, 0.0))
@example((0.02, 0.0, 0.0))
@example((1e-9, -2e-9, 3e-9))
@example((5e-324, 0.0, 0.0))
def test_rotation_vectors_are_scipys_and_come_back(vector):
    assert same_rotation(from_rotation_vector(vector), Rotation.from_rotvec(vector).as_quat(scalar_first=True))
    np.testing.assert_allclose(to_rotation_vector(from_rotation_vector(vector)), vector, rtol=1e-13, atol=1e-15)


@given(st.floats(0.0199, 0.0201), quaternions)
def test_the_series_of_small_angles_goes_over_into_the_functions(angle, attitude):
    axis = rotate(attitude, (0.0, 0.0, 1.0))
    real, *imaginary = from_rotation_vector(tuple(angle * part for part in axis))
    assert real == pytest.approx(cos(0.5 * angle), abs=1e-15)
    np.testing.assert_allclose(imaginary, [sin(0.5 * angle) * part for part in axis], atol=1e-15)


def test_angles_too_small_for_the_square_of_their_sine_are_kept():
    assert to_rotation_vector(from_rotation_vector((1e-12, 0.0, -1e-100))) == pytest.approx((1e-12, 0.0, -1e-100))


@given(quaternions, quaternions)
def test_between_two_attitudes_lies_the_rotation_that_turns_one_into_the_other(one, other):
    vector = between(one, other)
    assert np.linalg.norm(vector) <= pi + 1e-12
    assert same_rotation(product(from_rotation_vector(vector), one), other)


@given(st.tuples(st.floats(-pi, pi), st.floats(-1.57, 1.57), st.floats(-pi, pi)))
def test_roll_pitch_and_yaw_are_scipys_and_come_back(attitude):
    roll, pitch, yaw = attitude
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(scalar_first=True)
    assert same_rotation(from_euler(attitude), expected)
    # towards straight up or down, roll and yaw lose the digits that their difference keeps
    np.testing.assert_allclose(np.exp(1j * np.array(to_euler(from_euler(attitude)))), np.exp(1j * np.array(attitude)),
                               atol=1e-11)  # fmt: skip


@pytest.mark.parametrize("pitch", [pi / 2, -pi / 2])
@given(roll=st.floats(-3.0, 3.0), yaw=st.floats(-3.0, 3.0))
def test_straight_up_and_down_it_is_the_same_attitude_without_roll(pitch, roll, yaw):
    attitude = from_euler((roll, pitch, yaw))
    again = to_euler(attitude)
    assert again[0] == 0.0
    assert again[1] == pytest.approx(pitch, abs=1e-10)
    assert abs(np.dot(from_euler(again), attitude)) == pytest.approx(1.0, abs=1e-14)


@given(quaternions)
def test_any_attitude_is_the_same_after_a_way_over_its_angles(attitude):
    # straight up or down the angles themselves are only known to the root of the rounding
    assert abs(np.dot(from_euler(to_euler(attitude)), attitude)) == pytest.approx(1.0, abs=1e-10)


def test_signs_are_those_of_vehicles():
    """Yawed to the east, pitched up, rolled to the right."""
    east = from_euler((0.0, 0.0, pi / 2))
    assert rotate(east, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-15)
    up = from_euler((0.0, pi / 6, 0.0))
    assert rotate(up, (1.0, 0.0, 0.0)) == pytest.approx((cos(pi / 6), 0.0, -0.5), abs=1e-15)
    right = from_euler((pi / 6, 0.0, 0.0))
    assert rotate(right, (0.0, 1.0, 0.0)) == pytest.approx((0.0, cos(pi / 6), 0.5), abs=1e-15)


@given(vectors, vectors)
def test_the_cross_product_is_numpys(one, other):
    np.testing.assert_allclose(cross(one, other), np.cross(one, other), atol=1e-12)


def test_what_has_no_length_is_no_attitude():
    with pytest.raises(ValueError, match="attitude"):
        normalised((0.0, 0.0, 0.0, 0.0))

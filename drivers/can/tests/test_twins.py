"""Thrusters with one number are refused, and all that are at once."""

import pytest

from drivers.can.twins import refuse_twins, twins


def test_numbers_that_differ_are_no_problem():
    assert twins("thruster", [3, 1, 2]) == []
    refuse_twins(thruster=[1, 2], esc_index=[0, 1])


def test_each_number_that_several_have_is_told_once():
    assert twins("thruster", [7, 2, 7, 2, 7, 1]) == [
        "thruster must differ from thruster to thruster, got 2 more than once",
        "thruster must differ from thruster to thruster, got 7 more than once",
    ]


def test_all_settings_are_looked_at():
    with pytest.raises(ValueError, match=r"^thruster must .* got 1 .*; controller_id must .* got 5 more than once$"):
        refuse_twins(thruster=[1, 1], controller_id=[5, 5])

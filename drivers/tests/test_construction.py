"""Made the quick way or the usual one: the same."""

import copy
import pickle
from dataclasses import FrozenInstanceError, dataclass, fields
from typing import get_args

import pytest

from drivers.construction import constructor
from drivers.readings import Attitude, Reading, ThrusterCommand

READINGS = get_args(Reading)


@pytest.mark.parametrize("kind", READINGS)
def test_a_reading_made_the_quick_way_is_a_reading_like_any_other(kind):
    values = tuple(range(len(fields(kind))))
    quick, usual = constructor(kind)(*values), kind(*values)
    assert type(quick) is kind
    assert quick == usual
    assert hash(quick) == hash(usual)
    assert repr(quick) == repr(usual)
    assert pickle.loads(pickle.dumps(quick)) == copy.copy(quick) == usual  # noqa: S301  our own bytes
    with pytest.raises(FrozenInstanceError):
        quick.time_s = 1.0


def test_no_field_is_left_out():
    with pytest.raises(TypeError):
        constructor(ThrusterCommand)(1.0, 2)
    with pytest.raises(TypeError):
        constructor(Attitude)(*[0.0] * 7)


def test_classes_that_check_their_values_are_refused():
    @dataclass(frozen=True, slots=True)
    class Checked:
        speed_rpm: float

        def __post_init__(self):
            assert self.speed_rpm >= 0.0

    @dataclass(frozen=True)
    class WithDict:
        speed_rpm: float

    for kind in (Checked, WithDict, int):
        with pytest.raises(ValueError, match=kind.__name__):
            constructor(kind)


def test_who_has_checked_the_values_may_do_without_their_check():
    @dataclass(frozen=True, slots=True)
    class Checked:
        speed_rpm: float

        def __post_init__(self):
            raise AssertionError

    made = constructor(Checked, checked=True)(900.0)
    assert type(made) is Checked
    assert made.speed_rpm == 900.0

"""Readings put together quickly are the readings that their classes make."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, fields

import pytest

from drivers.quick_readings import thruster_command, thruster_report
from drivers.readings import ThrusterCommand, ThrusterReport

MADE = [
    (thruster_command, ThrusterCommand, (1.5, 3, -0.25)),
    (thruster_report, ThrusterReport, (1.5, 3, 900.0, 16.0, None, 300.0, 7)),
]


@pytest.mark.parametrize(("quick", "kind", "values"), MADE)
def test_quick_readings_are_no_others(quick, kind, values):
    made = quick(*values)
    assert len(fields(kind)) == len(values)  # a field that is added is to be set here, too
    assert made == kind(*values) and hash(made) == hash(kind(*values)) and repr(made) == repr(kind(*values))
    assert pickle.loads(pickle.dumps(made)) == made  # noqa: S301
    with pytest.raises(FrozenInstanceError):
        made.time_s = 2.0

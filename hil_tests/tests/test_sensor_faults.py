"""Faults of sensors: each shape is what it says, and whole recordings get the same as sample by sample."""

from __future__ import annotations

import pickle
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from detectors.navigation import FaultKind, Sensor
from hil_tests.sensor_faults import SIZED, Injector, Kind, SensorFault, beam_directions

TIME_S = np.arange(0.0, 40.0, 0.25)
TRUE = np.column_stack([1.0 + 0.1 * TIME_S, np.sin(TIME_S), 0.2 * np.cos(0.3 * TIME_S)])
ONSET_S, END_S = 10.1, 30.1
BEFORE, DURING, AFTER = TIME_S < ONSET_S, (TIME_S >= ONSET_S) & (TIME_S < END_S), TIME_S >= END_S
SINCE_S = TIME_S[DURING] - ONSET_S
FORWARD = np.array([1.0, 0.0, 0.0])


def fault(kind, sensor=Sensor.DVL, size=0.0, **keys):
    return SensorFault(sensor=sensor, kind=kind, onset_s=ONSET_S, end_s=END_S, size=size, **keys)


def during(kind, **keys):
    """What is said while the fault lasts, beside what is true; before and after it, the two are the same."""
    said = fault(kind, **keys).apply(TIME_S, TRUE)
    assert_array_equal(said[~DURING], TRUE[~DURING])
    return said[DURING], TRUE[DURING]


@pytest.mark.parametrize(
    ("kind", "size", "error"),
    [("step", 1.0, np.ones_like(SINCE_S)), ("drift", 0.04, 0.04 * SINCE_S), ("quadratic", -0.01, -0.01 * SINCE_S**2)],
)
def test_an_offset_comes_at_once_or_grows_along_its_axis(kind, size, error):
    said, true = during(kind, size=size, axis=0)
    assert_allclose(said - true, error[:, np.newaxis] * FORWARD, atol=1e-12)


def test_an_offset_without_an_axis_is_one_of_all_components():
    said, true = during("step", size=0.5)
    assert_allclose(said - true, 0.5)


def test_a_scale_is_in_proportion_to_what_is_true():
    said, true = during("scale", size=-0.2)
    assert_allclose(said, 0.8 * true)


def test_a_sensor_is_stuck_at_zero_or_at_its_last_value():
    assert_array_equal(during("zero")[0], 0.0)
    assert_array_equal(during("stuck")[0], np.tile(TRUE[BEFORE][-1], (DURING.sum(), 1)))
    only_right = during("stuck", axis=1)
    assert_array_equal(only_right[0][:, [0, 2]], only_right[1][:, [0, 2]])
    assert np.ptp(only_right[0][:, 1]) == 0.0


def test_one_that_is_stuck_from_the_start_repeats_its_first_value():
    said = SensorFault(sensor=Sensor.DVL, kind="stuck", onset_s=-1.0).apply(TIME_S, TRUE)
    assert_array_equal(said, np.tile(TRUE[0], (len(TIME_S), 1)))


@pytest.mark.parametrize(("kind", "gone"), [("intermittent", 0.0), ("dropping", np.nan)])
def test_an_intermittent_sensor_is_gone_every_other_second(kind, gone):
    said, true = during(kind)
    is_gone = SINCE_S % 2.0 < 1.0
    assert_array_equal(said[is_gone], np.full((is_gone.sum(), 3), gone))
    assert_array_equal(said[~is_gone], true[~is_gone])
    assert 0.4 < is_gone.mean() < 0.6


def test_one_that_stops_says_nothing():
    assert np.isnan(during("stop")[0]).all()


@pytest.mark.parametrize("kind", ["dropping", "stop"])
def test_a_sample_comes_as_a_whole_or_not(kind):
    said, _ = during(kind, axis=2)
    assert_array_equal(np.isnan(said).any(axis=1), np.isnan(said).all(axis=1))


def test_noise_has_its_standard_deviation_and_its_seed():
    time_s = np.arange(0.0, 4000.0)
    still = np.zeros((len(time_s), 3))
    noisy = SensorFault(sensor=Sensor.DVL, kind="noise", onset_s=0.0, size=0.3)
    said = noisy.apply(time_s, still)
    assert_allclose(said.std(axis=0), 0.3, rtol=0.05)
    assert_allclose(said.mean(axis=0), 0.0, atol=0.02)
    assert_array_equal(said, noisy.apply(time_s, still))
    other = SensorFault(sensor=Sensor.DVL, kind="noise", onset_s=0.0, size=0.3, seed=1)
    assert (said != other.apply(time_s, still)).all()


@pytest.mark.parametrize("beam", range(4))
def test_a_wrong_beam_is_off_by_its_size_and_the_three_others_say_so(beam):
    said, true = during("beam", size=0.3, axis=beam)
    directions = beam_directions()
    assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    off = said[0] - true[0]
    measured = directions @ true[0]
    measured[beam] += 0.3
    assert_allclose(np.linalg.lstsq(directions, measured)[0], said[0])
    others = np.delete(np.arange(4), beam)
    three = np.linalg.solve(directions[others], measured[others])
    assert_allclose(np.cross(three - said[0], off), 0.0, atol=1e-12)  # along the same axis
    assert_allclose(three, true[0])


def test_a_depth_is_one_number_and_other_sensors_have_three():
    depth = fault("drift", sensor=Sensor.DEPTH, size=0.1).apply(TIME_S, TRUE[:, 0])
    assert depth.shape == TIME_S.shape
    assert_allclose(depth[DURING] - TRUE[DURING, 0], 0.1 * SINCE_S)
    with pytest.raises(ValueError, match=r"shape \(160, 3\).*\(160,\)"):
        fault("drift", sensor=Sensor.DEPTH, size=0.1).apply(TIME_S, TRUE)
    with pytest.raises(ValueError, match="gyroscope"):
        fault("drift", sensor=Sensor.GYROSCOPE, size=0.1).apply(TIME_S, TRUE[:, 0])


KINDS = st.sampled_from(get_args(Kind))


@st.composite
def faults(draw):
    kind = draw(KINDS)
    sensor = Sensor.DVL if kind == "beam" else draw(st.sampled_from(Sensor))
    axes = st.none() if sensor is Sensor.DEPTH else st.none() | st.integers(0, 2)
    onset_s = draw(st.floats(-5.0, 45.0))
    return SensorFault(
        sensor=sensor, kind=kind, onset_s=onset_s, end_s=onset_s + draw(st.floats(0.1, 60.0)),
        axis=draw(st.integers(0, 3)) if kind == "beam" else draw(axes),
        size=draw(st.floats(0.01, 2.0)) if kind in SIZED else 0.0, seed=draw(st.integers(0, 9)),
    )  # fmt: skip


@given(fault=faults(), pickled_at=st.integers(0, len(TIME_S)))
def test_sample_by_sample_is_the_same_as_all_at_once_through_a_pickle_too(fault, pickled_at):
    values = TRUE[:, :1] if fault.sensor is Sensor.DEPTH else TRUE
    whole = fault.apply(TIME_S, values[:, 0] if fault.sensor is Sensor.DEPTH else values)
    injector = Injector(fault)
    for number, (time_s, value) in enumerate(zip(TIME_S.tolist(), values.tolist(), strict=True)):
        if number == pickled_at:
            injector = pickle.loads(pickle.dumps(injector))  # noqa: S301
        said = injector.sample(time_s, tuple(value))
        expected = np.atleast_1d(whole[number])
        assert said == (None if np.isnan(expected).any() else tuple(expected.tolist()))


@given(fault=faults())
def test_nothing_is_changed_outside_the_fault_nor_in_what_was_given(fault):
    values = TRUE[:, 0].copy() if fault.sensor is Sensor.DEPTH else TRUE.copy()
    given_values = values.copy()
    said = fault.apply(TIME_S, values)
    assert_array_equal(values, given_values)
    outside = ~fault.active(TIME_S)
    assert_array_equal(said[outside], values[outside])


@pytest.mark.parametrize(
    ("keys", "named"),
    [
        ({"kind": "step"}, "size = 0.0"),
        ({"kind": "stuck", "size": 1.0}, "size = 1.0"),
        ({"kind": "noise", "size": -1.0}, "size = -1.0"),
        ({"kind": "wobble"}, "kind = 'wobble'"),
        ({"kind": "zero", "end_s": 5.0}, "end_s = 5.0"),
        ({"kind": "zero", "onset_s": np.nan}, "onset_s = nan"),
        ({"kind": "zero", "axis": 3}, "axis = 3"),
        ({"kind": "zero", "axis": 2, "sensor": Sensor.DEPTH}, "axis = 2"),
        ({"kind": "beam", "size": 0.1}, "axis = None"),
        ({"kind": "beam", "size": 0.1, "axis": 1, "sensor": Sensor.GYROSCOPE}, "sensor"),
    ],
)
def test_a_fault_that_makes_no_sense_says_what_would(keys, named):
    with pytest.raises(ValueError, match=named):
        SensorFault(**{"sensor": Sensor.DVL, "onset_s": 10.0, **keys})


def test_a_detector_has_a_word_for_each():
    assert {fault(kind, size=0.1 if kind in SIZED else 0.0, axis=0).called for kind in get_args(Kind)} == set(
        FaultKind
    )

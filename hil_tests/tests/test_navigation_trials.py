"""Faults go into the right columns of a dive, and what a detector says of it is kept."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from detectors.navigation import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FaultKind,
    FixSample,
    ImuSample,
    NavigationVerdict,
    Sensor,
    SensorVerdict,
)
from detectors.verdict import Level
from hil_tests.dives import random_dive
from hil_tests.navigation_aids import acoustic_fixes, compass_attitudes, guessed
from hil_tests.navigation_trials import (
    SENSORS,
    faulty,
    play,
    position_errors_m,
    samples,
    track_m,
    turning,
)
from hil_tests.sensor_faults import SensorFault

ONSET_S, END_S = 20.0, 30.0


@pytest.fixture(scope="module")
def dive():
    return random_dive(0, duration_s=60.0)


class Scripted:
    """Says that the DVL is faulty in a span of time, and where the vehicle really is but for metres to the north."""

    def __init__(self, dive, begin_s=ONSET_S, end_s=END_S, off_m=0.0, names=True):
        self._dive, self._span, self._off_rad = dive, (begin_s, end_s), off_m / 6_371_000.0
        self._names = names
        self.seen = []

    def update(self, sample):
        self.seen.append(sample)
        latitude_rad, longitude_rad, depth_m = self._dive.motion.position(sample.time_s).tolist()
        state = replace(
            self._dive.initial, time_s=sample.time_s, latitude_rad=latitude_rad + self._off_rad,
            longitude_rad=longitude_rad, depth_m=depth_m,
        )  # fmt: skip
        broken = self._span[0] <= sample.time_s < self._span[1]
        level = Level.FAULT if broken else Level.NORMAL
        said = level if self._names else Level.UNKNOWN
        sensors = (SensorVerdict(Sensor.DVL, said, kind=FaultKind.STEP if broken else None),)
        return NavigationVerdict(
            time_s=sample.time_s, level=level, score=0.0, state=state, sensors=sensors,
            statistics={"one": sample.time_s} if isinstance(sample, DvlSample) else {},
            isolated=("dvl",) if broken else (), reason="off" if broken else "",
        )  # fmt: skip


@pytest.mark.parametrize(
    ("sensor", "array", "columns"),
    [(Sensor.DVL, "dvl", [1, 2, 3]), (Sensor.DEPTH, "depth", [1]), (Sensor.ACCELEROMETER, "imu", [1, 2, 3]),
     (Sensor.GYROSCOPE, "imu", [4, 5, 6])],
)  # fmt: skip
def test_a_fault_changes_its_sensor_and_no_other(dive, sensor, array, columns):
    broken = faulty(dive, [SensorFault(sensor=sensor, kind="step", size=0.5, onset_s=ONSET_S, end_s=END_S)])
    for name in ("imu", "dvl", "depth"):
        off = getattr(broken, name) - getattr(dive, name)
        expected = np.zeros_like(off)
        if name == array:
            time_s = getattr(dive, name)[:, 0]
            expected[np.ix_((time_s >= ONSET_S) & (time_s < END_S), columns)] = 0.5
        assert_allclose(off, expected, atol=1e-12)
    assert broken.reference is dive.reference


def test_faults_add_up_and_what_is_not_said_is_left_out(dive):
    stop = SensorFault(sensor=Sensor.DVL, kind="stop", onset_s=ONSET_S, end_s=END_S)
    gyro = SensorFault(sensor=Sensor.GYROSCOPE, kind="dropping", onset_s=40.0)
    broken = faulty(dive, [stop, gyro])
    gone = (dive.dvl[:, 0] >= ONSET_S) & (dive.dvl[:, 0] < END_S)
    assert_array_equal(broken.dvl, dive.dvl[~gone])
    left = broken.imu[broken.imu[:, 0] >= 40.0]
    assert len(left) == pytest.approx(1000, abs=2)  # the accelerometer's values go with the gyroscope's
    assert np.isfinite(left).all()


def test_samples_are_in_order_and_of_the_span_with_fixes_among_them(dive):
    fixes = acoustic_fixes(dive, seed=1, period_s=5.0)
    seen = list(samples(dive, fixes, begin_s=10.0, end_s=40.0))
    assert all(one.time_s <= other.time_s for one, other in pairwise(seen))
    counts = {
        kind: sum(isinstance(one, kind) for one in seen) for kind in (ImuSample, DvlSample, DepthSample, FixSample)
    }
    assert counts[ImuSample] == pytest.approx(3000, abs=1)
    assert counts[FixSample] == 6
    told = compass_attitudes(dive, seed=1, period_s=1.0)
    with_attitudes = list(samples(dive, None, told, begin_s=10.0, end_s=40.0))
    assert sum(isinstance(one, AttitudeSample) for one in with_attitudes) == 30
    assert [one for one in with_attitudes if not isinstance(one, AttitudeSample)] == list(
        samples(dive, begin_s=10.0, end_s=40.0)
    )
    assert counts[DvlSample] == pytest.approx(30 * dive.sensors.dvl_rate_hz, abs=1)
    assert seen[0].time_s >= 10.0
    assert seen[-1].time_s < 40.0


def test_fixes_have_their_noise_and_their_seed():
    dive = random_dive(1, duration_s=600.0, imu_hz=10.0)
    fixes = acoustic_fixes(dive, seed=3, noise_m=4.0, period_s=2.0)
    assert_allclose(np.diff(fixes[:, 0]), 2.0)
    true = dive.motion.position(fixes[:, 0])
    off_m = track_m(dive, fixes[:, 1:]) - track_m(dive, true[:, :2])
    assert_allclose(off_m.std(axis=0), 4.0, rtol=0.15)
    assert_allclose(off_m.mean(axis=0), 0.0, atol=0.8)
    assert_array_equal(fixes, acoustic_fixes(dive, seed=3, noise_m=4.0, period_s=2.0))


def test_a_compass_is_off_by_a_constant_and_by_noise():
    dive = random_dive(1, duration_s=200.0, imu_hz=10.0)
    off_deg = []
    for seed in range(20):
        told = compass_attitudes(dive, seed)
        true_rad = dive.motion.attitude_rad(told[:, 0])
        off_deg.append(np.rad2deg((told[:390, 1:] - true_rad[:390] + np.pi) % (2.0 * np.pi) - np.pi))
    assert_allclose(np.std(off_deg, axis=1).mean(axis=0), [0.5, 0.5, 1.0], rtol=0.1)
    lasting = np.mean(off_deg, axis=1)
    assert np.abs(lasting[:, :2]).max() < 0.2
    assert 0.25 < lasting[:, 2].std() < 0.8


def test_a_guess_is_near_the_truth_and_never_the_same(dive):
    guesses = [guessed(dive.initial, seed) for seed in range(200)]
    off_deg = np.rad2deg([np.subtract(one.attitude_rad, dive.initial.attitude_rad) for one in guesses])
    assert_allclose(off_deg.std(axis=0), [0.5, 0.5, 2.0], rtol=0.2)
    assert guesses[0] == guessed(dive.initial, 0) != guesses[1]
    assert guesses[0].depth_m == dive.initial.depth_m


def test_a_record_has_a_row_for_each_dvl_and_depth_sample(dive):
    record = play(Scripted(dive), samples(dive))
    assert_array_equal(record.time_s, np.sort(np.concatenate([dive.dvl[:, 0], dive.depth[:, 0]])))
    inside = (record.time_s >= ONSET_S) & (record.time_s < END_S)
    assert_array_equal(record.fault, inside)
    assert_array_equal(record.isolated[:, SENSORS.index(Sensor.DVL)], inside)
    assert (record.levels[:, SENSORS.index(Sensor.GYROSCOPE)] == Level.UNKNOWN).all()
    is_dvl = np.isin(record.time_s, dive.dvl[:, 0])
    assert_array_equal(record.statistics["one"][is_dvl], record.time_s[is_dvl])
    assert np.isnan(record.statistics["one"][~is_dvl]).all()
    assert {reason for reason, fault in zip(record.reasons, record.fault, strict=True) if fault} == {"off"}


def test_an_event_is_a_fault_that_begins_at_whatever_sample(dive):
    (event,) = play(Scripted(dive), samples(dive)).events
    assert (event.sensor, event.kind) == (Sensor.DVL, FaultKind.STEP)
    assert event.time_s == pytest.approx(ONSET_S, abs=0.011)  # an IMU's
    assert play(Scripted(dive, 70.0, 80.0), samples(dive)).events == ()
    (unnamed,) = play(Scripted(dive, names=False), samples(dive)).events
    assert (unnamed.time_s, unnamed.sensor, unnamed.kind) == (event.time_s, None, None)


def test_playing_can_go_on(dive):
    whole, parts = Scripted(dive), Scripted(dive)
    every = play(whole, samples(dive))
    halves = [
        play(parts, samples(dive, begin_s=begin_s, end_s=end_s)) for begin_s, end_s in ((0.0, 25.0), (25.0, 99.0))
    ]
    assert whole.seen == parts.seen
    assert_array_equal(np.concatenate([half.time_s for half in halves]), every.time_s)


def test_position_errors_are_distances_from_the_reference(dive):
    right, off = (play(Scripted(dive, off_m=off_m), samples(dive)) for off_m in (0.0, 7.0))
    known = right.time_s <= dive.reference[-1, 0]
    assert_allclose(position_errors_m(right, dive)[known], 0.0, atol=0.05)
    assert_allclose(position_errors_m(off, dive)[known], 7.0, atol=0.05)
    assert np.isnan(position_errors_m(right, dive)[~known]).all()
    blind = replace(dive, reference=None)
    with pytest.raises(ValueError, match="no reference"):
        position_errors_m(play(Scripted(dive), samples(dive)), blind)


def test_turns_are_seen_by_the_gyroscope():
    dive = random_dive(2)
    time_s, turns = turning(dive)
    rates = np.abs(dive.motion.turning_radps(time_s)[:, 2])
    assert turns[rates > 0.08].all()
    assert 0.05 < turns.mean() < 0.8
    quiet = np.convolve(rates > 0.02, np.ones(9), mode="same") == 0.0
    assert not turns[quiet].any()

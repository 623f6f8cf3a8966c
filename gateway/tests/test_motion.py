"""Readings of navigation sensors in, samples in the order of their times out."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.navigation import AttitudeSample, DepthSample, DvlSample, FixSample, ImuSample
from drivers.readings import (
    Attitude,
    AutopilotClock,
    BodyVelocity,
    GlobalPosition,
    Inertial,
    PositionFix,
    WaterPressure,
)
from gateway.config_sections import Navigation
from gateway.motion import HOLD_S, MotionAligner
from gateway.source_choice import CHOICE_S, SILENT_S, SourceChoice

START_S = 1.7e9
GRAVITY = (0.0, 0.0, -9.8)
AIR_PA = 101_325.0


def imu(time_s, boot_s=None, source="RAW_IMU"):
    return Inertial(START_S + time_s, time_s if boot_s is None else boot_s, source, GRAVITY, (0.0, 0.0, 0.0))


def dvl(time_s, boot_s=None, source="VISION_POSITION_DELTA 255.0", ahead=1.0):
    return BodyVelocity(START_S + time_s, boot_s, (ahead, 0.0, 0.0), source)


def pressure(time_s, pascals=AIR_PA, instance=2):
    return WaterPressure(START_S + time_s, time_s, instance, pascals, None)


def aligner(**keys):
    return MotionAligner(Navigation(**{"imu": "raw_imu", **keys}))


def given_out(aligner, readings):
    """All samples of readings in the order of arrival, with the inertial unit going on afterwards."""
    last_s = max(one.time_s for one in readings) - START_S
    tail = [imu(last_s + n / 50) for n in range(1, 10)]
    return [sample for reading in [*readings, *tail] for sample in taken(aligner, reading)]


def taken(aligner, reading):
    match reading:
        case Inertial():
            return aligner.inertial(reading)
        case BodyVelocity():
            aligner.velocity(reading)
        case WaterPressure():
            aligner.pressure(reading)
        case GlobalPosition():
            aligner.position(reading)
        case PositionFix():
            aligner.fix(reading)
        case Attitude():
            aligner.attitude(reading)
    return []


def of(kind, samples):
    return [one for one in samples if isinstance(one, kind)]


def even(seconds=3.0, rate_hz=50, **keys):
    return [imu(n / rate_hz, **keys) for n in range(round(seconds * rate_hz))]


def test_each_sample_falls_into_its_place_by_its_time():
    ours = aligner(dvl="vision_position_delta", depth="scaled_pressure2")
    readings = sorted([*even(), dvl(0.11), dvl(1.03), pressure(1.0), pressure(1.015)], key=lambda one: one.time_s)
    samples = given_out(ours, readings)
    times = [one.time_s for one in samples]
    assert times == sorted(times)
    assert [one.time_s - START_S for one in of(DvlSample, samples)] == pytest.approx([0.11, 1.03], abs=1e-6)
    equal = [(a, b) for a, b in pairwise(samples) if a.time_s == b.time_s]
    assert [(type(a), type(b)) for a, b in equal] == [(ImuSample, DepthSample)]
    assert ours.drops == {}


def test_what_comes_over_a_slower_way_is_waited_for():
    ours = aligner(dvl="odometry", depth="none")
    mine = "ODOMETRY 1.197"
    readings = [imu(n / 50) for n in range(50)]
    readings[10:10] = [dvl(0.18, boot_s=7.18, source=mine)]  # a first, quick one; the next is held up by 90 ms
    readings.append(dvl(0.985 + 0.09, boot_s=7.985, source=mine))
    readings.append(dvl(0.985 + 0.3, boot_s=8.0 - 0.3, source=mine))  # older than what was given out
    samples = given_out(ours, readings)
    assert [one.time_s - START_S for one in of(DvlSample, samples)] == pytest.approx([0.18, 0.985], abs=0.02)
    assert ours.drops == {"DVL late": 1}


@given(st.lists(st.tuples(st.integers(0, 3), st.floats(0, 0.4)), max_size=80))
def test_order_holds_whatever_the_delays(delays):
    ours, readings = aligner(dvl="vision_position_delta", depth="scaled_pressure2"), []
    for n, (kind, late_s) in enumerate(delays):
        make = (imu, imu, pressure, dvl)[kind]
        reading = make(n / 50 + late_s)
        readings.append(replace(reading, boot_s=n / 50) if kind < 3 else reading)
    readings.sort(key=lambda one: one.time_s)
    samples = given_out(ours, readings) if readings else []
    times = [one.time_s for one in samples]
    assert times == sorted(times)
    inertial = [one.time_s for one in of(ImuSample, samples)]
    assert all(earlier < later for earlier, later in pairwise(inertial))


def test_jitter_of_the_link_does_not_reach_the_inertial_samples():
    delays = np.random.default_rng(3).uniform(0.0, 0.05, 1000)
    received = np.maximum.accumulate(np.arange(1000) / 50 + delays)
    ours = aligner()
    readings = [imu(time_s, boot_s=n / 50) for n, time_s in enumerate(received.tolist())]
    times = [one.time_s for one in given_out(ours, readings)][500:1000]
    steps = np.diff(times)
    assert np.std(np.diff(received)) > 0.01
    assert np.abs(steps - 0.02).max() < 0.001


def test_an_answer_to_timesync_is_a_stamp_of_the_autopilots_clock():
    ours, late_s = aligner(), 0.3
    for n in range(50):
        ours.inertial(imu(n / 50 + late_s, boot_s=n / 50))
    ours.clock(AutopilotClock(START_S + 1.001, 1.0, 1, START_S, 0.002))
    samples = [one for n in range(51, 120) for one in ours.inertial(imu(n / 50 + late_s, boot_s=n / 50))]
    wrong = [one.time_s - START_S - 0.001 for one in samples[-10:]]
    assert np.allclose(50.0 * np.array(wrong), np.round(50.0 * np.array(wrong)), atol=1e-3)
    assert samples[-1].time_s == pytest.approx(START_S + (119 - HOLD_S * 50) / 50 + 0.001, abs=0.021)
    assert ours.drops["IMU time ran backwards"] <= 50 * late_s  # what was placed too late is not undone


def test_a_sample_is_given_out_as_soon_as_the_inertial_clock_is_past_it():
    ours = aligner()
    for n in range(40):
        samples = ours.inertial(imu(n / 50))
        assert all(n / 50 - (one.time_s - START_S) == pytest.approx(HOLD_S, abs=0.001) for one in samples)


def test_depth_by_density_and_air():
    ours = aligner(depth="scaled_pressure3", water_density_kgm3=998.0, surface_pressure_pa=100_000.0)
    ten_metres = 100_000.0 + 998.0 * 9.80665 * 10.0
    samples = given_out(ours, [*even(0.5), pressure(0.5, ten_metres, 3), pressure(0.5, 2e5, 2)])
    assert [one.depth_m for one in of(DepthSample, samples)] == pytest.approx([10.0])


def test_depth_of_the_autopilot_where_no_barometer_is_in_the_water():
    ours = aligner()
    places = [GlobalPosition(START_S + n / 10, 0.8, 0.2, 5.0 + n, (0.0, 0.0, 0.0), n / 10) for n in range(40)]
    air = [pressure(n / 10, 1.0e5, 1) for n in range(40)]
    readings = sorted([*even(4.0), *places, *air], key=lambda one: one.time_s)
    depths = [one.depth_m for one in of(DepthSample, given_out(ours, readings))]
    assert depths == [5.0 + n for n in range(round(10 * CHOICE_S), 40)]
    assert ours.depth.chosen == "GLOBAL_POSITION_INT"


def test_attitudes_are_thinned_out():
    ours = aligner()
    angles = [Attitude(START_S + n / 50, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, n / 50) for n in range(100)]
    readings = sorted([*even(2.0), *angles], key=lambda one: one.time_s)
    samples = of(AttitudeSample, given_out(ours, readings))
    assert len(samples) == 2
    assert samples[0].attitude_rad == (0.1, 0.2, 0.3)


def fix(time_s, latitude=0.8, source="GPS_INPUT 220.0"):
    return PositionFix(START_S + time_s, latitude, 0.2, None, 1.0, source)


def test_fixes_of_the_positioning_system_and_no_echo_of_them():
    ours = aligner()
    told = [fix(0.1), fix(0.2), fix(0.3, 0.81), fix(0.4, 0.8, "GPS_RAW_INT"), fix(0.5, 0.82)]
    place = GlobalPosition(START_S + 0.5, 0.9, 0.2, 5.0, (0.0, 0.0, 0.0), 0.5)
    readings = sorted([*even(0.6), *told, place], key=lambda one: one.time_s)
    samples = of(FixSample, given_out(ours, readings))
    assert [one.latitude_rad for one in samples] == [0.8, 0.81, 0.82]
    assert ours.drops == {"fix repeated": 1}


def test_the_autopilots_own_position_as_fix_once_a_second():
    ours = aligner(fix="global_position", depth="none")
    places = [GlobalPosition(START_S + n / 10, 0.8 + n / 1e6, 0.2, 5.0, (0, 0, 0), n / 10) for n in range(30)]
    samples = given_out(ours, sorted([*even(3.0), *places, fix(2.9)], key=lambda one: one.time_s))
    assert len(of(FixSample, samples)) == 3 and of(DepthSample, samples) == []


def test_without_inertial_samples_nothing_is_kept_for_long():
    ours = aligner(dvl="vision_position_delta")
    for n in range(500):
        ours.velocity(dvl(n / 10))
    assert ours.drops["without IMU"] == 479
    assert len(of(DvlSample, given_out(ours, even(60.0)))) == 21


def test_after_a_restart_of_the_autopilot_its_clock_begins_anew():
    ours = aligner()
    before = [sample for reading in even(3.0) for sample in ours.inertial(reading)]
    ours.restart()
    again = [sample for n in range(100) for sample in ours.inertial(imu(5.0 + n / 50, boot_s=2.0 + n / 50))]
    assert again[-1].time_s - START_S == pytest.approx(6.98 - HOLD_S, abs=0.01)
    assert len(before) + len(again) == 240


def test_times_that_run_backwards_are_refused():
    ours = aligner()
    ours.inertial(imu(1.0))
    ours.inertial(imu(1.0))
    ours.inertial(imu(1.01, boot_s=0.9))
    assert ours.drops == {"IMU time ran backwards": 2}


# Choice of a source ---------------------------------------------------------------------------------


def test_the_better_source_is_waited_for_and_kept():
    choice = SourceChoice(("RAW_IMU", "SCALED_IMU"))
    assert not choice.hears("SCALED_IMU", 0.0)
    assert not choice.hears("RAW_IMU", 0.5)
    assert not choice.hears("SCALED_IMU", CHOICE_S)
    assert choice.hears("RAW_IMU", CHOICE_S)
    assert not choice.hears("HIGHRES_IMU", CHOICE_S)


def test_a_source_is_left_only_when_it_is_silent():
    choice = SourceChoice(("RAW_IMU", "SCALED_IMU"))
    choice.hears("SCALED_IMU", 0.0)
    assert choice.hears("SCALED_IMU", CHOICE_S)
    assert not choice.hears("RAW_IMU", CHOICE_S + 1.0)
    assert not choice.hears("RAW_IMU", CHOICE_S + SILENT_S)
    assert choice.hears("RAW_IMU", CHOICE_S + SILENT_S + 0.1)


def test_a_named_source_is_listened_to_at_once_and_one_of_two_senders():
    choice = SourceChoice(("VISION_POSITION_DELTA",))
    assert choice.hears("VISION_POSITION_DELTA 255.0", 0.0)
    assert not choice.hears("VISION_POSITION_DELTA 1.197", 0.1)
    assert choice.hears("VISION_POSITION_DELTA 255.0", 0.2)


def test_nothing_is_listened_to_where_nothing_is_wanted():
    assert not SourceChoice(()).hears("ODOMETRY 1.197", 0.0)

"""The navigation watch's part: the mounting and noises that a made-up vehicle has, or what is missing."""

from dataclasses import replace
from math import degrees

import numpy as np
import pytest

from detectors.navigation import DvlSample, ImuSample, NavigationConfig
from detectors.navigation.tests.dives import Dive, Mounting, manoeuvring
from gateway.commissioning.navigation import commission_navigation
from gateway.commissioning.navigation_course import Innovations, NavigationCourse, navigation_course
from gateway.commissioning.navigation_learnt import LOWERED_HOURS, threshold_of
from gateway.commissioning.navigation_watch import Watched, scaled
from gateway.commissioning.sensor_noise import sensor_noise
from gateway.commissioning.tests.made_dives import fault, navigation_config, navigation_dive
from gateway.config_sections import Navigation

MOUNTED = Mounting(lever_arm_m=(0.4, -0.2, 0.3), rotation_rad=(0.0, 0.02, -0.03), dvl_delay_s=0.3)
DRIVEN = Dive(duration_s=190.0, imu_hz=25.0, attitude_hz=1.0, mounting=MOUNTED)


def learnt(*dives, config=None, vouched=False, findings=()):
    made = [navigation_dive(one, findings=findings) for one in dives]
    return commission_navigation(config or navigation_config(), made, 0.1, vouched)


def value(part, key):
    return next(one.value for one in part.settings if one.key == key)


@pytest.fixture(scope="module")
def part():
    return learnt(DRIVEN.samples(), replace(DRIVEN, seed=1).samples())


def test_the_mounting_goes_into_the_file(part):
    assert value(part, "navigation.dvl_lever_arm_m") == pytest.approx(MOUNTED.lever_arm_m, abs=0.1)
    assert value(part, "navigation.dvl_delay_s") == pytest.approx(0.3, abs=0.05)
    wanted = [degrees(one) for one in MOUNTED.rotation_rad]
    assert value(part, "navigation.dvl_mounting_deg") == pytest.approx(wanted, abs=0.5)


def test_so_do_the_noises_but_not_those_that_motion_hides(part):
    keys = [one.key for one in part.settings]
    assert "detector.navigation.accelerometer_noise_mps2" not in keys
    assert any(one.sureness == "at most: the vehicle never held still" for one in part.quantities)
    assert 0.2 < value(part, "detector.navigation.dvl_noise_mps") / DRIVEN.dvl_noise_mps < 2.0
    assert 0.5 < value(part, "detector.navigation.depth_noise_m") / DRIVEN.depth_noise_m < 2.0


def test_it_says_how_sure_it_is_and_shows_what_it_saw(part):
    sure = {one.name: one.sureness for one in part.quantities}
    assert sure["DVL delay when a dive begins"].endswith("of 2 dives")
    assert "with the settings of the other dives" in sure["exceeded in healthy dives"]
    assert not part.missing
    names = [one.name for one in part.figures]
    assert names == ["navigation-mounting", "navigation-innovations", "navigation-allan", "navigation-reached"]


def test_with_what_was_learnt_the_dvl_is_foreseen_from_the_start(part):
    samples = replace(DRIVEN, seed=2, duration_s=80.0).samples()
    config = navigation_config()
    taught = NavigationConfig(
        dvl_lever_arm_m=tuple(value(part, "navigation.dvl_lever_arm_m")),
        dvl_mounting_rad=tuple(np.radians(value(part, "navigation.dvl_mounting_deg")).tolist()),
        dvl_delay_s=value(part, "navigation.dvl_delay_s"),
    )
    before, after = (
        np.sqrt(np.mean(navigation_course(samples, config.navigation, one).dvl.values ** 2))
        for one in (NavigationConfig(), taught)
    )
    assert after < 0.8 * before


def resting(time_s):
    return 0.0 * manoeuvring(time_s) + np.array([[0.0], [0.02], [0.3], [0.0], [0.0], [0.0]])


def test_without_turns_the_manoeuvre_is_named():
    part = learnt(replace(DRIVEN, motion=resting, imu_hz=10.0, dvl_hz=1.0).samples())
    assert not part.settings
    assert "hardly turned" in part.missing[0] and "figure of eight" in part.missing[0]


def test_too_short_is_refused():
    (line,) = learnt(replace(DRIVEN, duration_s=60.0).samples()).missing
    assert "want 180 s" in line and "figure of eight" in line


@pytest.mark.parametrize(
    ("left_out", "words"), [(ImuSample, "the inertial unit was never heard"), (DvlSample, "the DVL was never heard")]
)
def test_a_sensor_that_is_missing_is_named(left_out, words):
    samples = [one for one in replace(DRIVEN, duration_s=30.0).samples() if not isinstance(one, left_out)]
    assert learnt(samples).missing[0].startswith(words)


def test_a_dvl_that_is_turned_in_the_vehicle_is_told():
    def turned(sample):
        if not isinstance(sample, DvlSample):
            return sample
        ahead, right, down = sample.velocity_mps
        return replace(sample, velocity_mps=(right, -ahead, down))

    (line,) = learnt([turned(one) for one in replace(DRIVEN, duration_s=60.0).samples()]).missing
    assert line.startswith("the DVL sees the vehicle go 88 degrees to the left of its bow nearly all the time")


def test_a_slow_inertial_unit_is_refused():
    (line,) = learnt(replace(DRIVEN, duration_s=60.0, imu_hz=5.0).samples()).missing
    assert line.startswith("the inertial unit came at 5.0 Hz: want 8 Hz at least")


def test_a_vehicle_without_a_dvl_needs_no_turns():
    samples = replace(DRIVEN, motion=resting, dvl_hz=0.0, duration_s=40.0).samples()
    part = learnt(samples, config=navigation_config(Navigation(dvl="none")))
    assert not part.missing
    assert not any(one.key.startswith("navigation.dvl") for one in part.settings)


def test_a_dive_with_a_fault_is_no_healthy_one():
    samples = replace(DRIVEN, duration_s=30.0).samples()
    (line,) = learnt(samples, findings=[fault("navigation", "dvl", "DVL frozen")]).missing
    assert line.startswith("dive is not healthy: 0:01:05 DVL frozen. Leave it out")


def watched(hours, peak=0.3, seed=0):
    time_s = np.arange(0.0, 3600.0 * hours)
    return Watched(time_s, peak * np.random.default_rng(seed).exponential(0.1, len(time_s)))


def test_a_threshold_is_not_lowered_by_a_few_minutes():
    short, long = (threshold_of([watched(hours)], 0.1, held_out=False) for hours in (0.2, 2.0 * LOWERED_HOURS))
    assert short.share == 1.0
    assert long.share < 1.0


def test_a_restless_vehicle_gets_a_higher_one():
    threshold = threshold_of([watched(1.0, peak=3.0)], 0.1, held_out=True)
    assert threshold.share > 1.2
    assert threshold.events <= 1


def test_the_thresholds_setting_is_the_methods():
    assert scaled(NavigationConfig(method="chi_square"), 1.5) == pytest.approx(27.0)
    assert scaled(NavigationConfig(), 1.0) == pytest.approx(0.1)
    assert scaled(NavigationConfig(), 0.8) > 0.1


def test_noise_is_that_of_straight_legs():
    rng = np.random.default_rng(0)
    time_s = np.arange(0.0, 400.0)
    turning = time_s > 200.0
    values = 0.01 * rng.normal(size=(400, 3)) + (turning * 0.2 * np.sin(time_s))[:, None]
    imu = np.column_stack((time_s, np.zeros((400, 5)), 0.3 * turning))
    dvl = Innovations(time_s, values, np.ones((400, 3)))
    depth = Innovations(time_s, values[:, :1], np.ones((400, 1)))
    known = np.zeros((400, 10))
    course = NavigationCourse(imu, imu[:, :4], dvl, depth, known, known, turning, (1.0, 1.0, 1.0))
    assert sensor_noise([course]).dvl_mps == pytest.approx(0.01, rel=0.25)


def test_a_wish_that_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match="false_alarms_per_hour"):
        commission_navigation(navigation_config(), [], -1.0)

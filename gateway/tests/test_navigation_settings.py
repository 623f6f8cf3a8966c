"""`[navigation]` and `[detector.navigation]`: what reaches the detector, and what is said of what is wrong."""

from math import radians
from pathlib import Path

import pytest

from detectors.navigation import NavigationConfig
from gateway.config import parse
from gateway.problems import ConfigError
from gateway.streams import streams
from gateway.tests.conftest import TWO_THRUSTERS

WATCH = "\n[navigation]\n"
NO_AUTOPILOT = """
[vehicle]
name = "x"
[[can]]
name = "can0"
channel = "can0"
protocol = "dronecan"
[[thruster]]
number = 1
command = { link = "can0", esc_index = 0 }
rpm = { link = "can0", esc_index = 0 }
"""


def problems(text: str, folder: Path = Path("/nowhere")) -> dict[str, str]:
    with pytest.raises(ConfigError) as caught:
        parse(text, folder)
    return {problem.key: str(problem) for problem in caught.value.problems}


def test_no_navigation_watch_unless_it_is_asked_for(config, tmp_path):
    assert config.navigation is None and config.detector.navigation is None
    assert config.watched() == "thrusters 1, 2"
    watching = parse(TWO_THRUSTERS + WATCH, tmp_path)
    assert watching.detector.navigation == NavigationConfig()
    assert watching.watched() == "thrusters 1, 2 and navigation"
    assert parse(TWO_THRUSTERS + WATCH + "[speed]", tmp_path).watched() == "thrusters 1, 2, speed and navigation"


def test_settings_reach_the_detector(tmp_path):
    text = """
[navigation]
dvl_lever_arm_m = [-1.85, 0, 0.1]
dvl_mounting_deg = [0, 0, 15]
dvl_delay_s = -0.5
lstm_model = "mine.npz"
[detector.navigation]
method = "cusum"
dvl_noise_mps = 0.01
isolate = false
"""
    (tmp_path / "mine.npz").touch()
    wanted = NavigationConfig(
        method="cusum",
        dvl_noise_mps=0.01,
        isolate=False,
        dvl_lever_arm_m=(-1.85, 0.0, 0.1),
        dvl_mounting_rad=(0.0, 0.0, radians(15.0)),
        dvl_delay_s=-0.5,
        lstm_model=tmp_path / "mine.npz",
    )
    assert parse(TWO_THRUSTERS + text, tmp_path).detector.navigation == wanted


WRONG = {
    "imu": ('imu = "rawimu"', "navigation.imu", "raw_imu"),
    "key": ("densty = 998", "navigation.densty", "unknown key"),
    "density in g": ("water_density_kgm3 = 1.025", "navigation.water_density_kgm3", "kg/m3?"),
    "pressure in hPa": ("surface_pressure_pa = 1013.25", "navigation.surface_pressure_pa", "Pa?"),
    "two of three": ("dvl_lever_arm_m = [1, 2]", "navigation.dvl_lever_arm_m", "[forward, right, down]"),
    "turned too far for a small rotation": ("dvl_mounting_deg = [0, 0, 45]", "navigation.dvl_mounting_deg.2", "20"),
    "ms": ("dvl_delay_s = 500", "navigation.dvl_delay_s", "2"),
    "no model": ('lstm_model = "lost.npz"', "navigation.lstm_model", "no such file"),
    "nothing": ('dvl = "none"\ndepth = "none"', "navigation.dvl", "leaves nothing to watch"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_told_once(name):
    line, key, said = WRONG[name]
    found = problems(TWO_THRUSTERS + WATCH + line)
    assert [key in found_key for found_key in found] == [True], found
    assert said in " ".join(found.values())


DETECTOR_WRONG = {
    'method = "chi-square"': ("detector.navigation.method", "chi_square"),
    "healthy_s = 0": ("detector.navigation.healthy_s", "above 0"),
    "dvl_delay_s = 0.1": ("detector.navigation.dvl_delay_s", "unknown key"),
}


@pytest.mark.parametrize("line", DETECTOR_WRONG)
def test_what_is_wrong_with_the_detectors_own_settings(line):
    key, said = DETECTOR_WRONG[line]
    found = problems(TWO_THRUSTERS + WATCH + "[detector.navigation]\n" + line)
    assert set(found) == {key} and said in found[key]


def test_settings_without_a_watch_mean_nothing():
    text = TWO_THRUSTERS + '[detector.navigation]\nmethod = "ratio"\n[failsafe]\nnavigation_fault = "hold"'
    found = problems(text)
    assert set(found) == {"detector.navigation", "failsafe.navigation_fault"}
    assert all("means nothing without a table [navigation]" in said for said in found.values())


ARDUPILOT, PX4 = 3, 12
RAW, SCALED_2, HIGHRES, PRESSURE_2, PRESSURE_3, ATTITUDE, GLOBAL = 27, 116, 105, 137, 143, 30, 33
ASKED = {
    (ARDUPILOT, ""): {RAW: 50.0, PRESSURE_2: 10.0, PRESSURE_3: 10.0, ATTITUDE: 20.0, GLOBAL: 10.0},
    (PX4, ""): {HIGHRES: 50.0, PRESSURE_2: 10.0, PRESSURE_3: 10.0, ATTITUDE: 20.0, GLOBAL: 10.0},
    (PX4, 'imu = "scaled_imu2"\ndepth = "global_position"'): {SCALED_2: 50.0, ATTITUDE: 20.0, GLOBAL: 10.0},
    (ARDUPILOT, 'depth = "scaled_pressure3"'): {RAW: 50.0, PRESSURE_3: 10.0, ATTITUDE: 20.0},
    (ARDUPILOT, 'depth = "none"\nfix = "global_position"'): {RAW: 50.0, ATTITUDE: 20.0, GLOBAL: 10.0},
}


@pytest.mark.parametrize(("autopilot", "keys"), ASKED)
def test_the_autopilot_is_asked_for_what_the_watch_needs(autopilot, keys, tmp_path):
    without = {one.message_id: one.rate_hz for one in streams(parse(TWO_THRUSTERS, tmp_path), autopilot)}
    asked = {one.message_id: one.rate_hz for one in streams(parse(TWO_THRUSTERS + WATCH + keys, tmp_path), autopilot)}
    assert asked == without | ASKED[autopilot, keys]


def test_the_watch_needs_the_autopilot():
    found = problems(NO_AUTOPILOT + WATCH + '[failsafe]\nnavigation_fault = "hold"')
    assert set(found) == {"navigation", "failsafe.navigation_fault"}
    assert found["navigation"].startswith("navigation: needs a [mavlink] table")

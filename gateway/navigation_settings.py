"""The navigation watch's settings out of `[navigation]` and `[detector.navigation]`, and their contradictions."""

from __future__ import annotations

from collections.abc import Iterator
from math import radians

from detectors.navigation import NavigationConfig
from gateway.config_sections import Navigation
from gateway.detector_settings import DetectorSettings, Setting
from gateway.problems import Problem, is_file


def navigation_settings(navigation: Navigation, table: object) -> tuple[NavigationConfig | None, list[Problem]]:
    """What the detector is given, or everything that is wrong with it by itself.

    Args:
        navigation: `[navigation]`.
        table: `[detector.navigation]`, as it is in the file.
    """
    roll_deg, pitch_deg, yaw_deg = navigation.dvl_mounting_deg
    elsewhere = {
        "dvl_lever_arm_m": Setting("navigation.dvl_lever_arm_m", navigation.dvl_lever_arm_m),
        "dvl_mounting_rad": Setting(
            "navigation.dvl_mounting_deg", (radians(roll_deg), radians(pitch_deg), radians(yaw_deg))
        ),
        "dvl_delay_s": Setting("navigation.dvl_delay_s", navigation.dvl_delay_s),
        "lstm_model": Setting("navigation.lstm_model", navigation.lstm_model),
    }
    return DetectorSettings(NavigationConfig, "detector.navigation", elsewhere).read(table)


def contradictions(navigation: Navigation) -> Iterator[Problem]:
    """Keys of `[navigation]` that exclude each other, or point to nothing."""
    if navigation.dvl == navigation.depth == "none":
        yield Problem(
            "navigation.dvl", "none", "leaves nothing to watch: want a DVL, or a depth that is not none, too"
        )
    model = navigation.lstm_model
    if model is not None and not is_file(model):
        wanted = "no such file (a relative path starts at the configuration's folder)"
        yield Problem("navigation.lstm_model", model, wanted)

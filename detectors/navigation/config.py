"""Settings of the navigation detector."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Literal, get_args

from detectors.navigation.sample import Vector

MethodName = Literal["chi_square", "cusum", "lstm", "ratio"]


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationConfig:
    """Settings of the navigation detector. The defaults suit a tactical MEMS IMU (VN-100) and a DVL of an AUV.

    Attributes:
        method: which statistic judges: "ratio": generalised likelihood ratio, "chi_square", "cusum" and "lstm": those
            of paper 003.
        false_alarms_per_hour: wanted rate that the thresholds of "ratio" are set for.
        isolate: a faulty sensor's measurements are not used.
        compare: the statistics of all methods are computed, whichever judges.
        accelerometer_noise_mps2: standard deviation of a sample's white noise, per square root of Hz.
        gyroscope_noise_radps: the same.
        accelerometer_bias_mps2, gyroscope_bias_radps: standard deviation of the offsets at the start.
        dvl_noise_mps: standard deviation of a component of the DVL's velocity while driving straight on; a first
            guess, from a quarter to three times of which it is learnt.
        depth_noise_m: of a depth.
        fix_noise_m: of each horizontal component of a fix.
        heading_noise_rad: of another system's heading.
        attitude_error_rad: standard deviation of the initial state's roll and pitch.
        heading_error_rad: of its heading.
        velocity_error_mps: of each component of its velocity.
        position_error_m: of each component of its position.
        dvl_lever_arm_m: (3,) from the IMU to the DVL, forward, right, down.
        dvl_mounting_rad: (3,) roll, pitch, yaw of the DVL in the frame of the body.
        dvl_delay_s: how much later than the IMU's the DVL's samples are stamped; may be negative.
        estimate_installation: the three and the DVL's scale are only first guesses, and learnt while driving.
        healthy_s: seconds after which an isolated sensor that agrees again is used again.
        chi_square_threshold: paper 003, section 5.1.
        cusum_gain: paper 003, section 5.1, the amplification lambda.
        cusum_threshold_mps: paper 003, section 5.1, T.
        cusum_bias_mps: paper 003, equation 12, beta; None: learnt from the healthy beginning.
        lstm_threshold: paper 003, section 5.2.
        lstm_model: file of a trained model; None: the one that comes along, trained on AUV Snapir.

    Raises:
        ValueError: a setting out of its range.
    """

    method: MethodName = "ratio"
    false_alarms_per_hour: float = 0.1
    isolate: bool = True
    compare: bool = False
    accelerometer_noise_mps2: float = 1.5e-3
    gyroscope_noise_radps: float = 1e-4
    accelerometer_bias_mps2: float = 0.05
    gyroscope_bias_radps: float = 2e-3
    dvl_noise_mps: float = 0.01
    depth_noise_m: float = 0.08
    fix_noise_m: float = 3.0
    heading_noise_rad: float = 0.05
    attitude_error_rad: float = 0.05
    heading_error_rad: float = 0.1
    velocity_error_mps: float = 0.2
    position_error_m: float = 3.0
    dvl_lever_arm_m: Vector = (0.0, 0.0, 0.0)
    dvl_mounting_rad: Vector = (0.0, 0.0, 0.0)
    dvl_delay_s: float = 0.0
    estimate_installation: bool = True
    healthy_s: float = 20.0
    chi_square_threshold: float = 18.0
    cusum_gain: float = 0.3
    cusum_threshold_mps: float = 0.2
    cusum_bias_mps: float | None = None
    lstm_threshold: float = 10.0
    lstm_model: Path | None = None

    def __post_init__(self) -> None:
        names = get_args(MethodName)
        _want("method", self.method, self.method in names, f"one of {', '.join(names)}")
        for name in _ABOVE_ZERO:
            value = getattr(self, name)
            _want(name, value, isfinite(value) and value > 0, "a finite number above 0")
        _want(
            "cusum_bias_mps", self.cusum_bias_mps, self.cusum_bias_mps is None or self.cusum_bias_mps > 0, "above 0"
        )
        for name in ("dvl_lever_arm_m", "dvl_mounting_rad"):
            value = getattr(self, name)
            _want(name, value, len(value) == 3 and all(map(isfinite, value)), "three finite numbers")
        _want("dvl_delay_s", self.dvl_delay_s, abs(self.dvl_delay_s) <= 2.0, "-2 to 2")


_ABOVE_ZERO = (
    "false_alarms_per_hour",
    "accelerometer_noise_mps2",
    "gyroscope_noise_radps",
    "accelerometer_bias_mps2",
    "gyroscope_bias_radps",
    "dvl_noise_mps",
    "depth_noise_m",
    "fix_noise_m",
    "heading_noise_rad",
    "attitude_error_rad",
    "heading_error_rad",
    "velocity_error_mps",
    "position_error_m",
    "healthy_s",
    "chi_square_threshold",
    "cusum_gain",
    "cusum_threshold_mps",
    "lstm_threshold",
)


def _want(name: str, value: object, fulfilled: bool, wanted: str) -> None:
    if not fulfilled:
        raise ValueError(f"{name} = {value!r}: want {wanted}")

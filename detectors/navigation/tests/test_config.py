from dataclasses import FrozenInstanceError
from math import inf, nan

import pytest

from detectors.navigation.config import NavigationConfig

POSITIVE = [
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
]


def test_the_published_settings_are_the_paper_s():
    config = NavigationConfig()
    assert (config.chi_square_threshold, config.cusum_gain, config.cusum_threshold_mps) == (18.0, 0.3, 0.2)
    assert config.lstm_threshold == 10.0


@pytest.mark.parametrize("value", [0.0, -1.0, nan, inf])
@pytest.mark.parametrize("name", POSITIVE)
def test_what_has_to_be_above_zero_is(name, value):
    with pytest.raises(ValueError, match=rf"^{name} = {value}: want a finite number above 0"):
        NavigationConfig(**{name: value})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "cosum"}, "method = 'cosum': want one of chi_square, cusum, lstm, ratio"),
        ({"cusum_bias_mps": 0.0}, "cusum_bias_mps = 0.0: want"),
        ({"cusum_bias_mps": nan}, "cusum_bias_mps = nan: want"),
        ({"dvl_lever_arm_m": (1.0, 2.0)}, r"dvl_lever_arm_m = \(1.0, 2.0\): want three finite numbers"),
        ({"dvl_mounting_rad": (0.0, nan, 0.0)}, "dvl_mounting_rad = .*: want three finite numbers"),
        ({"dvl_delay_s": 2.1}, "dvl_delay_s = 2.1: want -2 to 2"),
        ({"dvl_delay_s": nan}, "dvl_delay_s = nan: want -2 to 2"),
    ],
)
def test_a_setting_out_of_its_range_is_refused_by_name(settings, message):
    with pytest.raises(ValueError, match=message):
        NavigationConfig(**settings)


@pytest.mark.parametrize("delay_s", [-2.0, 2.0])
def test_the_ends_of_a_range_are_in_it(delay_s):
    assert NavigationConfig(dvl_delay_s=delay_s).dvl_delay_s == delay_s


def test_settings_stay_what_they_are():
    with pytest.raises(FrozenInstanceError):
        NavigationConfig().healthy_s = 1.0

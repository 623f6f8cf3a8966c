"""Settings are checked where they are made, and the message says what would be right."""

from math import inf, nan

import pytest

from detectors.thruster import ThrusterConfig


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"threshold_rpm": 0.0}, r"threshold_rpm = 0\.0: want above 0"),
        ({"threshold_rpm": -80.0}, r"threshold_rpm = -80\.0"),
        ({"threshold_rpm": nan}, "threshold_rpm = nan"),
        ({"threshold_rpm": inf}, "threshold_rpm = inf"),
        ({"order_max": 0}, "order_max = 0: want 1 to 9"),
        ({"order_max": 10}, "order_max = 10"),
        ({"delay_max": -1}, "delay_max = -1: want 0 to 200"),
        ({"delay_max": 201}, "delay_max = 201"),
        ({"lag_max": 0.0}, r"lag_max = 0\.0: want above 0"),
        ({"lag_max": nan}, "lag_max = nan"),
        ({"window_min": 10}, "window_min = 10: want above 10"),
        ({"window_min": 3000}, "window_max = 2500: want at least window_min = 3000"),
        ({"window_max": 299}, "window_max = 299"),
        ({"warmup": 311}, r"warmup = 311: want at least window_min \+ delay_max = 312"),
        ({"search": "grid"}, "search = 'grid': want 'exact' or 'swarm'"),
        ({"wear_suspect": 0.0}, r"wear_suspect = 0\.0: want between 0 and 1"),
        ({"wear_suspect": 0.25}, r"wear_max = 0\.2: want between wear_suspect = 0\.25 and 1"),
        ({"wear_max": 1.0}, r"wear_max = 1\.0"),
        ({"wear_max": nan}, "wear_max = nan"),
    ],
)
def test_a_bad_setting_is_named_with_its_value_and_what_would_be_right(settings, named):
    with pytest.raises(ValueError, match=named):
        ThrusterConfig(**settings)


def test_the_papers_method_has_the_papers_settings():
    paper = ThrusterConfig(dynamics=False, search="swarm", threshold_rpm=80)
    assert (paper.window_min, paper.window_max, paper.warmup) == (50, 500, 500)
    assert ThrusterConfig(dynamics=False, window_max=400).window_max == 400


def test_what_is_given_is_kept():
    config = ThrusterConfig(window_min=40, window_max=600, warmup=90, delay_max=20, order_max=3, seed=7)
    assert config.spans == (40, 600, 90)
    assert config == ThrusterConfig(window_min=40, window_max=600, warmup=90, delay_max=20, order_max=3, seed=7)
    assert ThrusterConfig(dynamics=True).spans != ThrusterConfig(dynamics=False).spans

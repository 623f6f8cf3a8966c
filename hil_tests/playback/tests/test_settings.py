"""The gateway's configuration for a play: the user's own, however it is, with the play's bus and link in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.problems import ConfigError
from hil_tests.playback.settings import KEY, in_memory, write_config
from hil_tests.profiles import load_profile
from hil_tests.scenario.document import Scenario

TEXT = load_profile("bluerov2_heavy").gateway_toml()
SECOND_BUS = '\n[[can]]\nname = "can1"\nchannel = "can1"\nprotocol = "dronecan"\n'


def scenario(settings: dict[str, Any], signed: bool = False) -> Scenario:
    return Scenario(duration_s=9, gateway={"settings": settings, "signed": signed})


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"can": 7}, "can"),
        ({"can": [3]}, "can"),
        ({"can": [{"name": "can0", "channel": "can0", "protocol": "dbc", "database": 5}]}, "can[name=can0].database"),
        ({"mavlink": 5}, "mavlink"),
        ({"speed": {"flow": 3}}, "speed.flow"),
        ({"detector": {"thruster": {"window_max": [None]}}}, "gateway.settings"),
    ],
    ids=lambda value: str(value)[:40],
)
@pytest.mark.parametrize("signed", [False, True])
def test_settings_that_make_no_configuration_are_told(
    tmp_path: Path, settings: dict[str, Any], key: str, signed: bool
) -> None:
    with pytest.raises(ConfigError) as caught:
        write_config(scenario(settings, signed), TEXT, tmp_path, in_memory(), tmp_path)
    assert key in [problem.key for problem in caught.value.problems]


def test_a_play_has_one_bus(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"can0, can1.*: a play has one CAN bus"):
        write_config(scenario({}), TEXT + SECOND_BUS, tmp_path, in_memory(), tmp_path)


def test_settings_stay_as_they_were(tmp_path: Path) -> None:
    bus = {"name": "can0", "interface": "slcan", "channel": "/dev/ttyACM0", "protocol": "dronecan"}
    changed = scenario({"can": [bus]})
    config, _ = write_config(changed, TEXT, tmp_path, in_memory(), tmp_path)
    assert config.can[0].interface == "virtual"
    assert changed.gateway.settings == {"can": [bus]}


def test_what_the_user_s_own_configuration_names_lies_where_it_lay(tmp_path: Path) -> None:
    folder, own = tmp_path / "play", tmp_path / "own"
    folder.mkdir()
    own.mkdir()
    (own / "lstm.npz").touch()
    settings = {"mavlink": {"signing_key": "own.key"}, "navigation": {"lstm_model": "lstm.npz"}}
    meeting = replace(in_memory(), real_autopilot=True)
    config, key = write_config(scenario(settings), TEXT, folder, meeting, own)
    assert config.mavlink is not None and config.mavlink.signing_key == own / "own.key"
    assert config.navigation is not None and config.navigation.lstm_model == own / "lstm.npz"
    assert key is None  # of a real autopilot nobody here knows it


def test_a_simulated_autopilot_signs_where_the_configuration_does(tmp_path: Path) -> None:
    config, key = write_config(
        scenario({"mavlink": {"signing_key": "own.key"}}), TEXT, tmp_path, in_memory(), tmp_path / "elsewhere"
    )
    assert config.mavlink is not None and config.mavlink.signing_key == tmp_path / KEY
    assert key == (tmp_path / KEY).read_bytes()

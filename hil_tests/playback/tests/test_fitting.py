"""Scenarios and their vehicles: what the one speaks of, the other has."""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.problems import ConfigError
from hil_tests.playback.fitting import gateway_config, load_fitting, misfits
from hil_tests.profiles import load_profile
from hil_tests.scenario.document import Scenario

SHORT = "duration_s: 60\n"


def problems(folder: Path, text: str) -> list[str]:
    """What is wrong with a scenario and its vehicle."""
    path = folder / "dive.yaml"
    path.write_text(SHORT + text)
    with pytest.raises(ConfigError) as caught:
        load_fitting(path)
    return [str(problem).removeprefix(str(folder)) for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("vehicle: blue", "/dive.yaml:2: vehicle = \"blue\": no such vehicle and no such file"),
        ("faults: [{at_s: 1, subject: thruster 9, failure: off}]", "2: faults[0].subject = \"thruster 9\": BlueROV2"),
        ("faults:\n- at_s: 1\n  failure: off\n  subject:\n  - thruster 1\n  - thruster 9", "7: faults[0].subject[1]"),
        ("faults: [{at_s: 1, subject: can1, failure: bus_off}]", "no bus of BlueROV2 Heavy: want can0"),
        ("expect: [{finding: {subject: thruster 12}}]", "finding.subject = \"thruster 12\": BlueROV2"),
        ("never: [{finding: {subject: Thruster 9*}}]", "never[0].finding.subject"),
        ("mission: {mode: SURFACE_NOW}", "mission.mode = \"SURFACE_NOW\": no mode of ardusub"),
        ("mission: {mode: AUTO}", "no mode of ardusub that it can be in here"),
        ("mission: {steps: [{at_s: 3, mode: ALTCTL}]}", "mission.steps[0].mode = \"ALTCTL\""),
        ("expect: [{mode: [MANUAL, POSCTL]}]", "expect[0].mode = \"POSCTL\""),
    ],
)  # fmt: skip
def test_what_the_vehicle_does_not_have(tmp_path: Path, text: str, wanted: str) -> None:
    (problem,) = problems(tmp_path, text)
    assert wanted in problem


def test_what_it_has_fits(tmp_path: Path) -> None:
    path = tmp_path / "dive.yaml"
    path.write_text(
        f"{SHORT}faults: [{{at_s: 1, subject: [thruster 8, thruster 1 rpm], failure: off}}]\n"
        "mission: {mode: POSHOLD, steps: [{at_s: 3, mode: SURFACE}]}\n"
        "expect: [{mode: ALT_HOLD}, {finding: {subject: thruster *}}]\n"
    )
    scenario, profile = load_fitting(path)
    assert scenario.name == "dive" and len(profile.thrusters) == 8


def test_one_s_own_vehicle_lies_beside_the_scenario(tmp_path: Path) -> None:
    own = load_profile("bluerov2_heavy").folder / "bluerov2_heavy.yaml"
    (tmp_path / "mine.yaml").write_text(own.read_text().replace("name: BlueROV2 Heavy", "name: Mine"))
    (tmp_path / "dive.yaml").write_text(f"{SHORT}vehicle: mine.yaml\n")
    assert load_fitting(tmp_path / "dive.yaml")[1].name == "Mine"


def test_of_a_recording_buses_and_modes_are_not_known_beforehand() -> None:
    faults = [{"at_s": 1, "subject": "port_can1", "failure": "bus_off"}]
    scenario = Scenario(duration_s=9, recording={"logs": ["a.log"]}, faults=faults, expect=[{"mode": "GUIDED_NOGPS"}])
    assert list(misfits(scenario, load_profile("bluerov2_heavy"))) == []


def test_places_of_faults_written_in_python() -> None:
    faults = [{"at_s": 1, "subject": ["thruster 1", "thruster 9"], "failure": "off"}]
    ((place, name, _),) = misfits(Scenario(duration_s=9, faults=faults), load_profile("bluerov2_heavy"))
    assert (place, name) == (("faults", 1, "subject"), "thruster 9")


def test_the_gateway_is_configured_as_it_will_be_played(tmp_path: Path) -> None:
    scenario = Scenario(duration_s=9, gateway={"settings": {"failsafe": {"delay_s": 9.0}}})
    config = gateway_config(scenario, tmp_path / "dive.yaml", load_profile("bluerov2_heavy"))
    assert config.failsafe.delay_s == 9.0
    assert [thruster.number for thruster in config.thruster] == list(range(1, 9))

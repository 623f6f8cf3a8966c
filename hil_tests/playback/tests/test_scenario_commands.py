"""`gateway hil new`, `check`, `list`, `schema`: what they say, and how they end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli import main
from hil_tests.playback.command import COMMANDS
from hil_tests.playback.fitting import load_fitting
from hil_tests.profiles import profile_names
from hil_tests.scenario.failures import TABLE, FailureKind
from hil_tests.scenario.shelf import scenario_files
from hil_tests.scenario.tests.test_faults import NAMES

SHORT = "duration_s: 60\n"


def called(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and all that was said."""
    result = CliRunner().invoke(main, ["hil", *map(str, arguments)])
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.output


@pytest.fixture
def written(tmp_path: Path) -> Path:
    path = tmp_path / "dive.yaml"
    path.write_text(SHORT)
    return path


def test_help_tells_of_all_commands() -> None:
    code, text = called("--help")
    assert code == 0
    assert all(f"  {name} " in text for name in COMMANDS)
    assert called("plya")[0] == 2


def test_new_writes_what_can_be_played(tmp_path: Path) -> None:
    path = tmp_path / "weeds.yaml"
    code, text = called("new", path, "--fault", "thruster 3 entangled", "--fault", "can0 bus off")
    assert code == 0, text
    assert text == f"{path} is written. Play it:  gateway hil play {path}\n"
    scenario, _ = load_fitting(path)
    assert [fault.words for fault in scenario.faults] == ["thruster 3 entangled", "can0 bus off"]
    assert scenario.expect[0].finding is not None and scenario.expect[0].finding.subject == "thruster 3"
    assert scenario.never[0].before_s == "fault"
    assert called("check", path) == (0, f"{path}: all well\n")


def test_new_without_a_fault_is_a_healthy_dive(tmp_path: Path) -> None:
    assert called("new", tmp_path / "calm")[0] == 0
    scenario, _ = load_fitting(tmp_path / "calm.yaml")
    assert scenario.faults == () and scenario.never[0].before_s is None


def test_new_takes_quantities_and_times(tmp_path: Path) -> None:
    text = "dvl bias bias_mps=0.4 axis=right at_s=100 ramp_s=3"
    assert called("new", tmp_path / "v1.2", "--fault", text)[0] == 0
    scenario, _ = load_fitting(tmp_path / "v1.2.yaml")
    (fault,) = scenario.faults
    assert (fault.at_s, fault.ramp_s, fault.axis, fault.values["bias_mps"]) == (100.0, 3.0, 1, 0.4)
    assert scenario.duration_s == 130.0


def test_new_never_overwrites(written: Path) -> None:
    code, text = called("new", written)
    assert (code, text) == (2, f"Error: {written} is there already: give another name\n")
    assert written.read_text() == SHORT


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        (["--fault", "thruster3 entangled"], 'no such subject, want "thruster 3"'),
        (["--fault", "dvl frozen"], "no failure of a dvl, did you mean stuck?"),
        (["--fault", "weeds"], "want a subject and what befalls it"),
        (["--fault", "thruster 3"], "say what befalls it as well: entangled, blocked"),
        (["--fault", "thruster 3 rpm scale fcator=0.9"], "unknown key, did you mean factor?"),
        (["--fault", "thruster 3 entangled share=lots"], "should be a valid number"),
        (["--fault", "thruster 9 entangled"], "has thrusters 1 to 8"),
        (["--vehicle", "bluerov2_heavie"], "no such vehicle and no such file, did you mean bluerov2_heavy"),
    ],
)
def test_new_says_what_it_cannot_write(tmp_path: Path, options: list[str], wanted: str) -> None:
    code, text = called("new", tmp_path / "x.yaml", *options)
    assert code == 2
    assert wanted in text and "Traceback" not in text
    assert not (tmp_path / "x.yaml").exists()


def test_new_where_nothing_can_be_written(tmp_path: Path) -> None:
    code, text = called("new", tmp_path / "none" / "x.yaml")
    assert code == 2
    assert "cannot be written" in text and "want a folder that is there" in text


@pytest.mark.parametrize("row", TABLE[:: len(TABLE) // 12], ids=lambda row: f"{row.target}-{row.failure}")
def test_new_knows_faults_of_every_kind(tmp_path: Path, row: FailureKind) -> None:
    name = NAMES[row.target].replace("12", "2")
    code, text = called("new", tmp_path / "x.yaml", "--fault", f"{name} {row.failure}")
    assert code == 0, text


def test_check_tells_all_problems_of_all_files(tmp_path: Path, written: Path) -> None:
    (tmp_path / "a.yaml").write_text("duration: 60\n")
    (tmp_path / "b.yaml").write_text(f"{SHORT}faults: [{{at_s: 3, subject: dlv, failure: off}}]\n")
    code, text = called("check", tmp_path)
    assert code == 2
    assert f"{tmp_path}/a.yaml:1: duration = 60: unknown key, did you mean duration_s?" in text
    assert f'{tmp_path}/b.yaml:2: faults[0].subject = "dlv": no such subject, did you mean dvl?' in text
    assert "3 scenarios, not all of them well" in text


def test_check_of_the_gateway_s_configuration(written: Path) -> None:
    written.write_text(f"{SHORT}gateway: {{settings: {{failsafe: {{thruster_fautl: hold}}}}}}\n")
    code, text = called("check", written)
    assert code == 2
    assert f"{written}: the gateway's configuration: 1 problem" in text
    assert "did you mean thruster_fault?" in text
    written.write_text(f"{SHORT}gateway: {{config: none.toml}}\n")
    code, text = called("check", written)
    assert code == 2 and "gateway.config = none.toml: cannot be read" in text


@pytest.mark.parametrize(
    ("log", "wanted"),
    [("none.log", "cannot be read: {folder}/none.log: No such file"), ("can7=is.log", "want one of the links")],
)
def test_check_of_a_recording(written: Path, log: str, wanted: str) -> None:
    (written.parent / "is.log").touch()
    written.write_text(f"{SHORT}recording: {{logs: [{log}]}}\n")
    code, text = called("check", written)
    assert code == 2 and wanted.format(folder=written.parent) in text
    written.write_text(f"{SHORT}recording: {{logs: [is.log, can0=is.log]}}\n")
    assert called("check", written)[0] == 0


def test_check_of_two_with_one_name(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.yaml").write_text(f"{SHORT}name: dive\n")
    code, text = called("check", tmp_path)
    assert code == 2
    assert f"{tmp_path}/b.yaml: name = dive: also that of {tmp_path}/a.yaml, want another" in text


def test_scenarios_that_ship_are_well() -> None:
    code, text = called("check")
    assert code == 0, text
    assert text == f"{len(scenario_files())} scenarios, all well\n"


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("weeds_in_thruster_4", "no scenario that ships, did you mean weeds_in_thruster_3?"),
        ("zzz", "gateway hil list shows those that ship"),
        ("none/dive.yaml", "no such file or folder"),
    ],
)
def test_what_is_no_scenario(name: str, wanted: str) -> None:
    for command in ("check", "list"):
        code, text = called(command, name)
        assert code == 2 and wanted in text


def test_one_that_ships_goes_by_its_name() -> None:
    code, text = called("check", "weeds_in_thruster_3")
    assert code == 0 and text.endswith("weeds_in_thruster_3.yaml: all well\n")


def test_list_of_scenarios(tmp_path: Path) -> None:
    path = tmp_path / "dive.yaml"
    path.write_text(
        f"{SHORT}about: A dive. Long.\ntags: [x]\nfaults: [{{at_s: 3.5, subject: dvl, failure: stuck}}]\n"
    )
    code, text = called("list", path)
    assert code == 0
    header, row = text.splitlines()
    assert header.split() == ["scenario", "vehicle", "s", "faults", "tags", "about"]
    assert row.split() == ["dive", "bluerov2_heavy", "60", "dvl", "stuck", "at", "3.5", "x", "A", "dive"]
    path.write_text("duration: 3")
    assert called("list", path)[0] == 2


def test_list_of_failures_has_each_row_with_its_quantities() -> None:
    code, text = called("list", "--failures")
    assert code == 0
    assert all(row.failure in text and row.text in text for row in TABLE)
    assert all(f"{one.name}: {one.text}" in text for row in TABLE for one in row.quantities)
    assert "share: of the full-throttle speed lost; above 0, at most 0.95; 0.25 if left out" in text


def test_list_of_vehicles() -> None:
    code, text = called("list", "--profiles")
    assert code == 0
    *table, hint = text.splitlines()
    assert [line.split()[0] for line in table[1:] if line[:1].strip()] == profile_names()
    assert hint.startswith("For your own, copy one of ")


def test_schema_is_json() -> None:
    code, text = called("schema")
    assert code == 0 and json.loads(text)["title"] == "HIL scenario"

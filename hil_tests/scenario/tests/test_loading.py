"""Scenario files: what they say is what is loaded, and each thing that is wrong is told with its place."""

from __future__ import annotations

from math import inf
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from hil_tests.scenario.document import Scenario
from hil_tests.scenario.fault import Fault, subject_named
from hil_tests.scenario.loading import dump_scenario, find_scenarios, load_scenario, parse_scenario
from hil_tests.scenario.shelf import scenario_files
from hil_tests.yaml_document import DocumentError

HERE = Path("/nowhere")
SHORT = "duration_s: 60\n"


def problems(text: str) -> list[str]:
    """What is wrong with the text of a scenario, one a line."""
    with pytest.raises(DocumentError) as caught:
        parse_scenario(text, HERE, "dive.yaml")
    return [str(problem) for problem in caught.value.problems]


def fault_problems(entry: str) -> list[str]:
    """What is wrong with one fault, on line 3."""
    return problems(f"{SHORT}faults:\n  - {entry}\n")


def test_what_is_left_out_has_its_default() -> None:
    scenario = parse_scenario(SHORT, HERE, "folder/gentle.yaml")
    assert scenario == Scenario(name="gentle", duration_s=60.0)
    assert scenario.vehicle == "bluerov2_heavy" and scenario.mission.style == "surveying"


def test_a_key_with_nothing_behind_it_is_left_out() -> None:
    assert parse_scenario(f"{SHORT}faults:\nmission:\n", HERE) == parse_scenario(SHORT, HERE)


def test_settings_can_take_something_of_the_configuration_away() -> None:
    scenario = parse_scenario("duration_s: 60\ngateway: {settings: {speed: null, failsafe: {command_s: ~}}}", HERE)
    assert scenario.gateway.settings == {"speed": None, "failsafe": {"command_s": None}}
    assert parse_scenario(dump_scenario(scenario), HERE) == scenario


def test_words_that_older_yaml_takes_for_booleans_are_words() -> None:
    scenario = parse_scenario(f"{SHORT}faults: [{{at_s: 1, subject: dvl, failure: off}}]\ntags: [no, on]", HERE)
    assert scenario.faults[0].failure == "off"
    assert scenario.tags == ("no", "on")


def test_faults_are_flat_in_the_file() -> None:
    text = "{at_s: 25, subject: thruster 3, failure: entangled, share: 0.3, ramp_s: 1, duration_s: 10}"
    (fault,) = parse_scenario(f"{SHORT}faults: [{text}]", HERE).faults
    assert fault == Fault(
        subject=subject_named("thruster 3"),
        failure="entangled",
        at_s=25.0,
        until_s=35.0,
        ramp_s=1.0,
        values={"share": 0.3},
    )
    assert fault.words == "thruster 3 entangled"


def test_an_entry_can_befall_several() -> None:
    text = "{at_s: 1, subject: [thruster 1, dvl], failure: delayed, delay_s: 0.2}"
    faults = parse_scenario(f"{SHORT}faults: [{text}]", HERE).faults
    assert [fault.subject.name for fault in faults] == ["thruster 1", "dvl"]
    assert all(fault.values == {"delay_s": 0.2} for fault in faults)


def test_axes_have_names() -> None:
    text = f"{SHORT}faults:\n"
    text += "- {at_s: 1, subject: dvl, failure: bias, bias_mps: 0.3, axis: right}\n"
    text += "- {at_s: 1, subject: position, failure: bias, bias_m: 3, axis: east}\n"
    text += "- {at_s: 1, subject: dvl, failure: bias, bias_mps: 0.3}\n"
    assert [fault.axis for fault in parse_scenario(text, HERE).faults] == [1, 1, None]


def test_faults_keep_the_order_of_the_file() -> None:
    text = "faults: [{at_s: 30, subject: dvl, failure: stuck}, {at_s: 10, subject: can0, failure: bus_off}]"
    scenario = parse_scenario(SHORT + text, HERE)
    assert [fault.at_s for fault in scenario.faults] == [30.0, 10.0]
    assert scenario.first_fault_s == 10.0


def test_scenarios_are_written_in_python_as_in_a_file() -> None:
    entry = {"at_s": 25, "subject": "thruster 3", "failure": "entangled"}
    fault = Fault(subject=subject_named("thruster 3"), failure="entangled", at_s=25.0)
    assert Scenario(duration_s=60, faults=[entry, fault]).faults == (fault, fault)
    with pytest.raises(ValidationError, match="did you mean entangled"):
        Scenario(duration_s=60, faults=[entry | {"failure": "entangledd"}])


def test_dumped_it_loads_to_the_same() -> None:
    scenario = parse_scenario(
        f"""{SHORT}about: "a: b # c"
name: "12"
gateway: {{config: vehicle.toml, settings: {{failsafe: {{thruster_fault: [surface, hold]}}}}}}
recording: {{logs: [dive.BIN], from_s: 3}}
faults: [{{at_s: 0.1, subject: [dvl, depth], failure: intermittent, duration_s: 0.2}}]
expect: [{{mode: [MANUAL, ALT_HOLD]}}, {{statustext: "^T3: \\\\d", severity: ERROR, within_s: 3}}]
never: [{{command: "*", before_s: fault}}]
""",
        HERE,
    )
    assert parse_scenario(dump_scenario(scenario), HERE) == scenario
    driven = Scenario(name="off", duration_s=60, mission={"steps": [{"at_s": 4, "sticks": {"forward": 0.5}}]})
    assert parse_scenario(dump_scenario(driven), HERE) == driven


@pytest.mark.parametrize(
    ("entry", "wanted"),
    [
        ("{at_s: 1, subject: dlv, failure: off}", 'faults[0].subject = "dlv": no such subject, did you mean dvl?'),
        ("{at_s: 1, subject: thruster3, failure: off}", 'no such subject, want "thruster 3", or that with "rpm"'),
        ("{at_s: 1, subject: T4, failure: off}", 'want "thruster 4"'),
        ("{at_s: 1, subject: sonar, failure: off}", "known here: thruster 3, thruster 3 rpm"),
        (
            "{at_s: 1, subject: dvl, failure: frozen}",
            'faults[0].failure = "frozen": no failure of a dvl, did you mean stuck?',
        ),
        ("{at_s: 1, subject: dvl, failure: explodes}", "known here: off, slow, delayed"),
        ("{at_s: 1, subject: dvl, failure: bias}", "faults[0].bias_mps: missing (what is added)"),
        ("{at_s: 1, subject: dvl, failure: bias, bias_mp: 1, bias_mps: 1}", "unknown key, did you mean bias_mps?"),
        (
            "{at_s: 1, subject: thruster 3, failure: entangled, severity: 0.3}",
            "faults[0].severity = 0.3: unknown key",
        ),
        (
            "{at_s: 1, subject: thruster 3, failure: entangled, share: 2}",
            "share = 2: should be less than or equal to 0.95",
        ),
        ("{at_s: 1, subject: thruster 3, failure: entangled, share: 0}", "should be greater than 0"),
        ("{at_s: 1, subject: thruster 3, failure: entangled, share: .nan}", "should be a finite number"),
        ("{at_s: 1, subject: thruster 3, failure: entangled, share: half}", "should be a valid number"),
        ("{at_s: 1, subject: dvl, failure: stuck, axis: up}", "should be 'forward', 'right' or 'down'"),
        ("{at_s: 1, subject: dvl, failure: off, axis: right}", 'axis = "right": unknown key'),
        ("{at_s: -1, subject: dvl, failure: stuck}", "faults[0].at_s = -1: should be greater than or equal to 0"),
        ("{at_s: 1, subject: dvl, failure: stuck, duration_s: 0}", "should be greater than 0"),
        ("{subject: dvl, failure: stuck}", "faults[0].at_s: missing (onset)"),
        ("{at_s: 1, failure: stuck}", "faults[0].subject: missing"),
        ("{at_s: 1, subject: dvl}", "faults[0].failure: missing"),
        ("{at_s: 1, subject: [], failure: stuck}", "at least 1 item"),
        ("{at_s: 1, subject: [dvl, dlv], failure: stuck}", 'faults[0].subject[1] = "dlv"'),
        ("{at_s: 60, subject: dvl, failure: stuck}", "faults[0].at_s = 60.0: comes after the end"),
        ("dvl stuck", "should be a table with at_s, subject and failure"),
    ],
)
def test_what_is_wrong_with_a_fault(entry: str, wanted: str) -> None:
    (problem,) = fault_problems(entry)
    assert problem.startswith("dive.yaml:3: faults[0]")
    assert wanted in problem


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("duration: 60", "dive.yaml:1: duration = 60: unknown key, did you mean duration_s?"),
        ("duration_s: 0", "dive.yaml:1: duration_s = 0: should be greater than 0 (of the play)"),
        (f"{SHORT}seed: 1.5", "dive.yaml:2: seed = 1.5: should be a valid integer"),
        (f"{SHORT}mission:\n  style: fast", "dive.yaml:3: mission.style = \"fast\": should be 'still', 'surveying'"),
        (f"{SHORT}mission:\n  armed: yes", "dive.yaml:3: mission.armed = \"yes\": should be true or false"),
        (f"{SHORT}mission: fast", "dive.yaml:2: mission = \"fast\": should be a table of keys"),
        (f"{SHORT}mission: {{steps: [{{at_s: 3}}]}}", "mission.steps[0] = {\"at_s\": 3}: does nothing: want sticks"),
        (f"{SHORT}mission: {{steps: [{{at_s: 3, mode: A}}, {{at_s: 2, mode: B}}]}}", "want steps in order"),
        (f"{SHORT}mission: {{steps: [{{at_s: 70, mode: A}}]}}", "steps[0].at_s = 70.0: comes after the end"),
        (f"{SHORT}mission: {{course: {{headings_deg: [], leg_s: 3}}}}", "at least 1 item"),
        (f"{SHORT}water: {{currents: [{{speed_mps: 1, at_s: 61}}]}}", "currents[0].at_s = 61.0: comes after"),
        (f"{SHORT}tags: safe", "tags = \"safe\": should be a list"),
        (f"{SHORT}faults: {{at_s: 3}}", "faults = {\"at_s\": 3}: should be a list of faults"),
        (f"{SHORT}expect:\n  - within_s: 3", "dive.yaml:3: expect[0] = {\"within_s\": 3}: want exactly one"),
        (f"{SHORT}expect: [{{command: hold, mode: MANUAL}}]", "got command and mode"),
        (f"{SHORT}expect: [{{command: jump}}]", "no action of the failsafe, want one of manual, hold"),
        (f"{SHORT}expect: [{{command: warn}}]", "no action of the failsafe"),
        (f"{SHORT}expect: [{{statustext: '(('}}]", "expect[0].statustext = \"((\": no regular expression"),
        (f"{SHORT}expect: [{{mode: MANUAL, severity: ERROR}}]", "severity goes with statustext"),
        (f"{SHORT}expect: [{{mode: 3}}]", "expect[0].mode = 3: should be a valid string, or should be a list"),
        (f"{SHORT}expect: [{{command: hold, within_s: 2, not_before_s: 2}}]", "can never come"),
        (f"{SHORT}expect: [{{command: hold, within_s: 61}}]", "ends after the play: want at most 60"),
        (f"{SHORT}expect: [{{command: hold, after_s: 60}}]", "after_s = 60.0: is after the end"),
        (f"{SHORT}expect: [{{finding: {{subject: trhuster 3}}}}]", "subject, did you mean thruster 3?"),
        (f"{SHORT}expect: [{{finding: {{subject: depth}}}}]", "subject, did you mean depth sensor?"),
        (f"{SHORT}expect: [{{finding: {{subject: sonar}}}}]", "known: thruster 3, vehicle, vehicle heading"),
        (f"{SHORT}expect: [{{finding: {{besides: vessel}}}}]", "expect[0].finding.besides"),
        (f"{SHORT}expect: [{{finding: {{subject: 'thruster ?'}}}}]", "should match pattern"),
        (f"{SHORT}expect: [{{finding: {{level: FAULT, at_least: FAULT}}}}]", "exclude each other"),
        (f"{SHORT}never: [{{command: '*', from_s: 60}}]", "from_s = 60.0: is after the end"),
        (f"{SHORT}never: [{{command: '*', from_s: 8, before_s: 7}}]", "forbids nothing"),
        (f"{SHORT}never: [{{command: '*', before_s: fault}}]", "there is no fault"),
        (f"{SHORT}never: [{{command: '*', before_s: dawn}}]", "should be a valid number, or should be 'fault'"),
        (f"{SHORT}never: [{{mode: MANUAL}}]", "never[0].mode = \"MANUAL\": unknown key"),
        (f"{SHORT}recording: {{logs: []}}", "at least 1 item"),
        (f"{SHORT}recording: {{logs: [a.BIN], from_s: 3, to_s: 3}}", "nothing is played"),
        (f"{SHORT}recording: {{logs: [a.BIN]}}\nmission: {{depth_m: 3}}", ":3: mission: a recorded dive has its own"),
    ],
)  # fmt: skip
def test_what_is_wrong_elsewhere(text: str, wanted: str) -> None:
    found = [problem for problem in problems(text) if "duration_s: missing" not in problem]
    assert len(found) == 1
    assert wanted in found[0]


def test_what_cannot_befall_a_recording() -> None:
    text = f"{SHORT}recording: {{logs: [a.BIN]}}\nfaults:\n- at_s: 3\n  subject: [thruster 2, thruster 3]\n"
    text += "  failure: reverse\n- {at_s: 3, subject: thruster 2 rpm, failure: reverse}\n"
    found = problems(text)
    assert [problem.split(" = ")[0] for problem in found] == [
        "dive.yaml:5: faults[0].subject[0]",
        "dive.yaml:5: faults[0].subject[1]",
    ]


def test_forbidden_before_a_fault_that_comes_earlier() -> None:
    text = f"{SHORT}faults: [{{at_s: 5, subject: dvl, failure: off}}]\n"
    text += "never: [{command: hold, from_s: 5, before_s: fault}]"
    assert "the first fault is at 5: nothing is forbidden" in problems(text)[0]


def test_all_problems_are_told_at_once_in_the_order_of_the_file() -> None:
    found = problems(
        "seed: -1\nfaults:\n- {at_s: 1, subject: dvl}\n- {at_s: x, subject: dvl, failure: stuck, axes: 1}\nname: 3\n"
    )
    places = [problem.split(" = ")[0].split(": missing")[0] for problem in found]
    assert sorted(places[:2]) == ["dive.yaml:1: duration_s", "dive.yaml:1: seed"]
    assert places[2] == "dive.yaml:3: faults[0].failure"
    assert sorted(places[3:5]) == ["dive.yaml:4: faults[1].at_s", "dive.yaml:4: faults[1].axes"]
    assert places[5:] == ["dive.yaml:5: name"]


def test_files_are_found_in_folders_each_once(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    for name in ("b.yaml", "a.yml", "deep/c.yaml", "notes.txt"):
        (tmp_path / name).write_text(SHORT)
    found = find_scenarios([tmp_path, tmp_path / "b.yaml"])
    assert [str(path.relative_to(tmp_path)) for path in found] == ["a.yml", "b.yaml", "deep/c.yaml"]
    assert load_scenario(found[0]).name == "a"
    with pytest.raises(ValueError, match="no such file or folder"):
        find_scenarios([tmp_path / "none"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="no scenario in this folder"):
        find_scenarios([tmp_path / "empty"])


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="cannot be read"):
        load_scenario(tmp_path / "none.yaml")
    (tmp_path / "latin.yaml").write_bytes(b"about: \xe9")
    with pytest.raises(DocumentError, match="cannot be read"):
        load_scenario(tmp_path / "latin.yaml")


def test_a_fault_without_an_end_lasts() -> None:
    (fault,) = parse_scenario(f"{SHORT}faults: [{{at_s: 3, subject: dvl, failure: stuck}}]", HERE).faults
    assert fault.until_s == inf and fault.active(1e6)


TOKENS = [
    "",
    "0",
    "-1",
    "1e999",
    ".nan",
    "off",
    "{",
    "}",
    "[",
    "]",
    ": ",
    "\n",
    "- ",
    "*",
    "&a ",
    "thruster 3",
    "'",
    "\t",
    "\x85",
    "!!int ",
]


@settings(max_examples=40)
@given(st.sampled_from(scenario_files()), st.data())
def test_damaged_files_are_refused_with_problems_or_are_well(path: Path, data: st.DataObject) -> None:
    text = path.read_text(encoding="utf-8")
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 30)))
    damaged = text[:start] + data.draw(st.sampled_from(TOKENS)) + text[end:]
    try:
        scenario = parse_scenario(damaged, path.parent, str(path))
    except DocumentError as error:
        assert all(problem.wanted for problem in error.problems)
    else:
        assert parse_scenario(dump_scenario(scenario), path.parent) == scenario

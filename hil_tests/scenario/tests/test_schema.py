"""The JSON Schema says of a file what the loader says of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from hil_tests.scenario.failures import TABLE, FailureKind
from hil_tests.scenario.loading import parse_scenario
from hil_tests.scenario.schema import SCHEMA_FILE, scenario_schema, schema_text
from hil_tests.scenario.shelf import SHELF, scenario_files
from hil_tests.scenario.tests.test_faults import NAMES, needed
from hil_tests.yaml_document import DocumentError, read_file, read_text

VALIDATOR = Draft7Validator(scenario_schema())
FAULT = VALIDATOR.evolve(schema=VALIDATOR.schema["properties"]["faults"])


def allowed(text: str) -> bool:
    """Whether the schema finds nothing wrong with it."""
    return VALIDATOR.is_valid(read_text(text, "dive.yaml").data)


def loads(text: str) -> bool:
    """Whether the loader finds nothing wrong with it."""
    try:
        parse_scenario(text, Path("/nowhere"))
    except DocumentError:
        return False
    return True


def test_it_is_a_schema() -> None:
    Draft7Validator.check_schema(scenario_schema())


def test_what_ships_is_what_the_model_says() -> None:
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(), f"gateway hil schema > {SCHEMA_FILE}"


@pytest.mark.parametrize("path", scenario_files(), ids=lambda path: path.stem)
def test_scenarios_that_ship_fit_and_say_where_it_is(path: Path) -> None:
    assert list(VALIDATOR.iter_errors(read_file(path).data)) == []
    first = path.read_text(encoding="utf-8").splitlines()[0]
    beginning, _, place = first.partition("=")
    assert beginning == "# yaml-language-server: $schema"
    assert (path.parent / place).resolve() == SCHEMA_FILE


def test_the_shelf_is_there() -> None:
    assert SHELF.is_dir()


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row.target}-{row.failure}")
def test_it_knows_each_row_and_what_it_needs(row: FailureKind) -> None:
    entry = {"at_s": 1, "subject": NAMES[row.target], "failure": row.failure}
    assert FAULT.is_valid([entry | needed(row)])
    assert not FAULT.is_valid([entry | needed(row) | {"size": 3}])
    for name in needed(row):
        assert not FAULT.is_valid([entry | {key: size for key, size in needed(row).items() if key != name}])


@pytest.mark.parametrize(
    "text",
    [
        "duration_s: 0",
        "duration: 9",
        "duration_s: '9'",
        "duration_s: 9\nmission: {style: fast}",
        "duration_s: 9\nmission: {armed: yes}",
        "duration_s: 9\nfaults: [{at_s: 1, subject: dlv, failure: stuck}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: thruster3, failure: off}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: dvl, failure: frozen}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: [dvl, thruster 1], failure: stuck}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: thruster 3, failure: entangled, share: 0}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: dvl, failure: stuck, axis: up}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: dvl, failure: stuck, duration_s: 0}]",
        "duration_s: 9\nexpect: [{within_s: 3}]",
        "duration_s: 9\nexpect: [{command: jump}]",
        "duration_s: 9\nexpect: [{command: hold, mode: MANUAL}]",
        "duration_s: 9\nnever: [{mode: MANUAL}]",
        "duration_s: 9\nnever: [{command: hold, before_s: dawn}]",
    ],
)
def test_it_refuses_what_the_loader_refuses(text: str) -> None:
    assert not allowed(text)
    assert not loads(text)


@pytest.mark.parametrize(
    "text",
    [
        "duration_s: 9",
        "duration_s: 9\nfaults: [{at_s: 1, subject: [thruster 1, thruster 2 rpm], failure: off}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: vcan0, failure: bus_off, ramp_s: 2, duration_s: 3}]",
        "duration_s: 9\nfaults: [{at_s: 1, subject: position, failure: drift, drift_mps: 1, axis: east}]",
        "duration_s: 9\nexpect: [{mode: [MANUAL, ALT_HOLD]}, {command: hold, within_s: 3}]",
        "duration_s: 9\nnever: [{command: '*', before_s: 3}]",
        "duration_s: 9\nrecording: {logs: [a.BIN], to_s: 9}",
        "duration_s: 9\ngateway: {config: a.toml, signed: true, settings: {failsafe: {thruster_fault: hold}}}",
    ],
)
def test_it_allows_what_the_loader_allows(text: str) -> None:
    assert allowed(text)
    assert loads(text)

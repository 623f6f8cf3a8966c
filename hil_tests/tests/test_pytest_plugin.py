"""The fixtures for tests of one's own, as pytest has them: in a process of its own, where nothing is imported yet."""

from __future__ import annotations

import subprocess
import sys

pytest_plugins = ["pytester"]

HEAVY = ("numpy", "pydantic", "gateway", "hil_tests.playback.play")
TESTS = """
import pytest

@pytest.mark.scenario("dive.yaml", seed=7)
def test_named(gateway_rig, scenario):
    assert (scenario.about, scenario.seed, scenario.name) == ("mine", 7, "dive")
    gateway_rig.require(gateway_rig.play(scenario))

def test_file(gateway_rig):
    first, second = (gateway_rig.play("dive.yaml", seed=seed) for seed in (1, 2))
    assert second.scenario.seed == 2
    assert first.folder != second.folder

def test_built(gateway_rig):
    expected = [{"finding": {"subject": "vehicle", "level": "FAULT"}, "after_s": 0, "within_s": 0.1}]
    gateway_rig.require(gateway_rig.play(vehicle="bench_rov", duration_s=0.2, expect=expected))

def test_unmarked(scenario):
    pass

@pytest.mark.scenario("weeds_in_thruster_4")
def test_unknown(scenario):
    pass

@pytest.mark.scenario("wrong.yaml")
def test_with_problems(scenario):
    pass
"""


def pytest_in(pytester, tests, *arguments):
    pytester.makeini(
        "[pytest]\nasyncio_default_fixture_loop_scope = function\naddopts = --strict-markers --tb=short\n"
    )
    pytester.makepyfile(tests)
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *arguments)


def test_tests_play_what_they_name_or_build_and_what_is_wrong_is_said_in_words(pytester):
    pytester.makefile(".yaml", dive="vehicle: bench_rov\nduration_s: 0.2\nabout: mine\n")
    pytester.makefile(".yaml", wrong="vehicle: [1]\nduration_s: 1\n")
    result = pytest_in(pytester, TESTS)
    result.assert_outcomes(passed=2, failed=1, errors=3)
    for said in (
        "*AssertionError: scenario*",
        "E*FAULT of vehicle within 0.1 s*",
        "the fixture `scenario` wants @pytest.mark.scenario(name, [*][*]changes)*",
        "weeds_in_thruster_4: no file*did you mean weeds_in_thruster_3*",
        "*wrong.yaml:1: vehicle*",
    ):
        result.stdout.fnmatch_lines([said])


def test_a_bus_that_is_not_there_is_named(pytester):
    tests = 'def test_one(gateway_rig):\n    gateway_rig.play(vehicle="bench_rov", duration_s=1)\n'
    result = pytest_in(pytester, tests, "--hil-can", "nocan7")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["--hil-can nocan7: *"])
    result.stdout.no_fnmatch_line("*pytest_plugin.py*")


def test_who_does_not_use_it_does_not_wait_for_it():
    loaded = f"import sys, hil_tests.pytest_plugin; print([name for name in {HEAVY} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True).stdout == "[]\n"

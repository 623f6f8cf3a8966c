"""The words of scenario files are those of the gateway and of the rig."""

from __future__ import annotations

from typing import get_args

import pytest

from gateway import navigation_channel, silence, speed_channel, thruster_channel
from gateway.operator import ALL
from gateway.sensor_observations import SUBJECTS as SENSORS
from gateway.severity import Severity
from gateway.supervision.actions import Action
from hil_tests.playback.fitting import FLYABLE, MODES
from hil_tests.profiles import Profile
from hil_tests.report.commands import MODES as ASKED
from hil_tests.scenario.document import Expectation, FindingPattern
from hil_tests.scenario.expectations import COMMANDS
from hil_tests.scenario.finding_subjects import FIXED, OF_THRUSTER, finding_subjects, subject_matches

GATEWAY = {
    *(navigation_channel.SUBJECT, navigation_channel.IMU, navigation_channel.DVL, navigation_channel.DEPTH),
    *(speed_channel.SUBJECT, speed_channel.HEADING, speed_channel.POSITION),
    *(silence.AUTOPILOT, thruster_channel.COMMANDS, ALL, "gateway"),
    *SENSORS.values(),
}


def test_subjects_of_findings_are_the_gateway_s() -> None:
    assert set(FIXED) == GATEWAY
    assert {f" {signal}" for signal in thruster_channel.SIGNALS} < set(OF_THRUSTER)


@pytest.mark.parametrize(
    "subject", [*sorted(GATEWAY), "thruster 3 esc index", "link can0 node 12 rate", "Thruster *", "*"]
)
def test_patterns_that_can_be_found(subject: str) -> None:
    pattern = FindingPattern(subject=subject).subject
    assert subject.startswith("link") or any(subject_matches(pattern, one) for one in finding_subjects())


@pytest.mark.parametrize(
    ("pattern", "subject", "matches"),
    [
        ("thruster 3", "thruster 3", True),
        ("thruster 3", "thruster 31", False),
        ("thruster 3*", "thruster 31 esc", True),
        ("THRUSTER *", "thruster 3", True),
        ("*", "dvl", True),
        ("link * rate", "link can0 node 3 rate", True),
        ("dvl", "dvl signal", False),
    ],
)
def test_what_a_pattern_matches(pattern: str, subject: str, matches: bool) -> None:
    assert subject_matches(pattern, subject) is matches


def test_severities_are_those_of_texts() -> None:
    (words, _) = get_args(Expectation.model_fields["severity"].annotation)
    assert set(get_args(words)) == {one.name for one in Severity if one is not Severity.DEBUG}


def test_commands_are_what_the_failsafe_asks() -> None:
    assert {*COMMANDS} == {*Action} - {Action.NONE, Action.WARN}
    assert {*ASKED.values()} <= {*COMMANDS}


def test_modes_of_every_autopilot_that_a_profile_can_have() -> None:
    autopilots = set(get_args(Profile.model_fields["autopilot"].annotation))
    assert set(MODES) == set(FLYABLE) == autopilots
    assert all(set(FLYABLE[one]) < set(MODES[one]) for one in autopilots)

"""What scenarios expect and forbid, held against outcomes made by hand."""

from __future__ import annotations

import pytest

from detectors.verdict import Level
from gateway.severity import Severity
from hil_tests.report.check import Check
from hil_tests.report.expectations import checks, found_after_s, passed
from hil_tests.report.outcome import Outcome
from hil_tests.report.tests.plays import command, finding, mode, mode_command, play, text
from hil_tests.rig.ardusub import Mode
from hil_tests.rig.commands import Command, Result
from hil_tests.rig.px4 import MainMode

FAULT_IN_2_S = {"finding": {"subject": "thruster 3", "level": "FAULT"}, "within_s": 2.0}
TEXT_IN_2_S = {"statustext": r"T3 (entangled|blocked)\?", "severity": "CRITICAL", "within_s": 2.0}
HOLD_IN_2_S = {"command": "hold", "within_s": 2.0}


def only(outcome: Outcome) -> Check:
    (check,) = checks(outcome)
    assert passed(outcome) is check.passed
    return check


@pytest.mark.parametrize(
    ("since_s", "right"),
    [
        (24.999999, False),
        (25.0, True),
        (25.31, True),
        (27.0, True),
        (27.000001, False),
        (59.0, False),
    ],
)
def test_a_window_begins_with_the_fault_and_ends_to_the_microsecond(since_s: float, right: bool) -> None:
    assert only(play(expect=(FAULT_IN_2_S,), findings=[finding(since_s)])).passed is right


def test_words_of_what_came() -> None:
    check = only(
        play(expect=(FAULT_IN_2_S,), findings=[finding(25.31, text="T3 entangled? 1486 rpm, want 1619 (-8%)")])
    )
    assert check == Check(
        "FAULT of thruster 3 within 2 s of 0:25",
        True,
        "after 0.31 s: FAULT of thruster 3: T3 entangled? 1486 rpm, want 1619 (-8%)",
        25.31,
    )


def test_a_window_of_its_own() -> None:
    wanted = FAULT_IN_2_S | {"after_s": 40.0}
    assert only(play(expect=(wanted,), findings=[finding(25.31), finding(41.0)])).time_s == 41.0
    early = only(play(expect=(wanted,), findings=[finding(25.31)]))
    assert not early.passed
    assert early.seen.startswith("not then: last at 0:25.31, 14.69 s before: FAULT of thruster 3")


def test_without_a_fault_it_counts_from_the_start() -> None:
    check = only(play(faults=(), expect=(FAULT_IN_2_S,), findings=[finding(1.5)]))
    assert check.passed
    assert check.expected == "FAULT of thruster 3 within 2 s of 0:00"


@pytest.mark.parametrize(("since_s", "right"), [(25.4, False), (25.5, True), (27.0, True), (27.5, False)])
def test_too_early_is_wrong_as_well(since_s: float, right: bool) -> None:
    check = only(play(expect=(FAULT_IN_2_S | {"not_before_s": 0.5},), findings=[finding(since_s)]))
    assert check.passed is right
    assert check.expected == "FAULT of thruster 3 0.5 to 2 s after 0:25"
    assert ("too early" in check.seen) is (since_s < 25.5)


def test_the_first_decides_though_a_later_one_would_be_in_time() -> None:
    wanted = FAULT_IN_2_S | {"not_before_s": 0.5}
    assert not only(play(expect=(wanted,), findings=[finding(25.1), finding(26.0)])).passed


def test_findings_are_taken_by_their_own_time_whatever_their_order() -> None:
    check = only(play(expect=(FAULT_IN_2_S,), findings=[finding(28.0), finding(26.0)]))
    assert (check.passed, check.time_s) == (True, 26.0)


@pytest.mark.parametrize(
    ("pattern", "right"),
    [
        ({"subject": "thruster 3"}, True),
        ({"subject": "Thruster *"}, True),
        ({"subject": "*"}, True),
        ({"subject": "thruster 4"}, False),
        ({"subject": "thruster *", "besides": "thruster 3*"}, False),
        ({"subject": "thruster *", "besides": "thruster 4"}, True),
        ({"subject": "thruster 3 esc"}, False),
        ({"level": "SUSPECT"}, True),
        ({"level": "FAULT"}, False),
        ({"at_least": "SUSPECT"}, True),
        ({"at_least": "FAULT"}, False),
        ({"text": r"entangled\?"}, True),
        ({"text": "^entangled"}, False),
    ],
)
def test_patterns_of_findings(pattern: dict[str, str], right: bool) -> None:
    suspect = finding(26.0, Level.SUSPECT, text="T3 entangled? 1486 rpm")
    assert only(play(expect=({"finding": pattern},), findings=[suspect])).passed is right


def test_all_besides_one() -> None:
    wanted = {"finding": {"subject": "thruster *", "besides": "thruster 3*", "at_least": "SUSPECT"}}
    esc = finding(26.0, subject="thruster 3 esc")
    assert only(play(never=(wanted,), findings=[finding(25.0), esc])).passed
    check = only(play(never=(wanted,), findings=[finding(25.0), finding(27.0, subject="thruster 1")]))
    assert check.expected == "no SUSPECT or FAULT of thruster * besides thruster 3* at all"
    assert check.time_s == 27.0


def test_a_note_of_the_failsafe_is_no_level_of_the_vehicle() -> None:
    note = finding(26.0, Level.SUSPECT, "vehicle", "Hold asked for T3", detector="failsafe")
    levelled = {"finding": {"subject": "vehicle", "at_least": "SUSPECT"}}
    assert not only(play(expect=(levelled,), findings=[note])).passed
    assert only(play(never=(levelled,), findings=[note])).passed
    assert only(play(expect=({"finding": {"subject": "vehicle", "text": "Hold asked"}},), findings=[note])).passed


@pytest.mark.parametrize(
    ("findings", "seen"),
    [
        ([], "never: nothing of thruster 3 was found"),
        ([finding(30.0)], "after 5 s, 3 s too late: FAULT of thruster 3: thruster 3 FAULT"),
        ([finding(26.0, Level.SUSPECT)], "never: at most SUSPECT of thruster 3: thruster 3 SUSPECT"),
        (
            [finding(26.0, subject="thruster 4"), finding(27.0, Level.NORMAL, "dvl")],
            "never: nothing of thruster 3 was found, but FAULT of thruster 4: thruster 4 FAULT",
        ),
    ],
)
def test_what_came_closest_to_a_finding(findings: list[object], seen: str) -> None:
    check = only(play(expect=(FAULT_IN_2_S,), findings=findings))
    assert (check.passed, check.seen) == (False, seen)


def test_a_finding_in_other_words() -> None:
    wanted = {"finding": {"subject": "thruster 3", "at_least": "SUSPECT", "text": "propeller"}}
    check = only(play(expect=(wanted,), findings=[finding(26.0, text="T3 entangled?")]))
    assert check.expected == 'SUSPECT or FAULT of thruster 3 that says "propeller" after 0:25'
    assert check.seen == "never: but in other words: FAULT of thruster 3: T3 entangled?"


@pytest.mark.parametrize(
    ("texts", "right", "seen"),
    [
        ([text(25.4, "T3 blocked? 0 rpm")], True, 'after 0.4 s: CRITICAL "T3 blocked? 0 rpm"'),
        ([text(25.4, "T3 blocked? 0 rpm", Severity.EMERGENCY)], True, 'after 0.4 s: EMERGENCY "T3 blocked? 0 rpm"'),
        ([text(25.4, "T3 blocked?", Severity.WARNING)], False, 'never: but only as WARNING "T3 blocked?"'),
        ([text(25.4, "T4 entangled? 900 rpm")], False, 'never: closest: CRITICAL "T4 entangled? 900 rpm"'),
        ([text(25.4, "DVL: zzz")], False, 'never: none of the 1 texts is like it, the first: CRITICAL "DVL: zzz"'),
        ([], False, "never: no text came"),
    ],
)
def test_texts(texts: list[object], right: bool, seen: str) -> None:
    check = only(play(expect=(TEXT_IN_2_S,), texts=texts))
    assert (check.passed, check.seen) == (right, seen)


@pytest.mark.parametrize(
    ("word", "received"),
    [
        ("hold", mode_command(26.0, Mode.ALT_HOLD)),
        ("hold", mode_command(26.0, Mode.POSHOLD)),
        ("hold", mode_command(26.0, MainMode.ALTCTL)),
        ("hold", mode_command(26.0, MainMode.POSCTL)),
        ("hold", command(26.0, Command.NAV_LOITER_UNLIM)),
        ("surface", mode_command(26.0, Mode.SURFACE)),
        ("manual", mode_command(26.0, Mode.MANUAL)),
        ("manual", mode_command(26.0, MainMode.MANUAL)),
        ("return", command(26.0, Command.NAV_RETURN_TO_LAUNCH)),
        ("land", command(26.0, Command.NAV_LAND)),
        ("disarm", command(26.0, Command.COMPONENT_ARM_DISARM, 0.0)),
        ("disarm", command(26.0, Command.COMPONENT_ARM_DISARM, 0.0, 21196.0)),
        ("terminate", command(26.0, Command.DO_FLIGHTTERMINATION, 1.0)),
    ],
)
def test_words_of_commands(word: str, received: object) -> None:
    wanted = {"command": word, "within_s": 2.0}
    assert only(play(expect=(wanted,), commands=[received])).passed
    others = [
        mode_command(26.0, Mode.STABILIZE),
        command(26.0, Command.COMPONENT_ARM_DISARM, 1.0),
        command(26.0, 511),
    ]
    assert not only(play(expect=(wanted,), commands=others)).passed
    assert not only(play(never=({"command": "*"},), commands=[received])).passed


def test_a_request_for_messages_does_not_act_on_the_vehicle() -> None:
    assert only(play(never=({"command": "*"},), commands=[command(1.0, 511), command(1.0, 512)])).passed


def test_a_command_and_its_answer() -> None:
    refused = mode_command(26.0, Mode.ALT_HOLD, Result.FAILED)
    check = only(play(expect=(HOLD_IN_2_S,), commands=[refused]))
    assert check.seen == "after 1 s: hold (DO_SET_MODE 2), answered FAILED"
    instead = only(play(expect=(HOLD_IN_2_S,), commands=[mode_command(26.0, Mode.SURFACE, None)]))
    assert (instead.passed, instead.seen) == (False, "never: but surface (DO_SET_MODE 9), not answered")
    assert only(play(expect=(HOLD_IN_2_S,))).seen == "never: no command came"


@pytest.mark.parametrize(
    ("wanted", "right", "seen"),
    [
        ({"mode": "ALT_HOLD"}, True, "ALT_HOLD since 0:26"),
        ({"mode": ("POSHOLD", "alt hold")}, True, "ALT_HOLD since 0:26"),
        ({"mode": "armed"}, True, "ALT_HOLD since 0:00"),
        ({"mode": "MANUAL"}, False, "ALT_HOLD since 0:26"),
        ({"mode": "DISARMED"}, False, "ALT_HOLD since 0:26"),
        ({"mode": "ALT_HOLD", "not_before_s": 3.0}, False, "ALT_HOLD since 0:26, too early"),
        ({"mode": "ALT_HOLD", "within_s": 2.0}, True, "after 1 s: ALT_HOLD"),
        ({"mode": "ALT_HOLD", "within_s": 0.5}, False, "after 1 s, 0.5 s too late: ALT_HOLD"),
        ({"mode": "MANUAL", "within_s": 0.5}, True, "already: MANUAL"),
        ({"mode": "SURFACE", "within_s": 0.5}, False, "never: MANUAL > ALT_HOLD"),
        ({"mode": "SURFACE", "within_s": 0.5, "after_s": 30.0}, False, "never: ALT_HOLD"),
    ],
)
def test_modes(wanted: dict[str, object], right: bool, seen: str) -> None:
    check = only(play(expect=(wanted,), modes=[mode(0.0, "MANUAL"), mode(26.0, "ALT_HOLD")]))
    assert (check.passed, check.seen) == (right, seen)


def test_ends_disarmed() -> None:
    modes = [mode(0.0, "MANUAL"), mode(30.0, "MANUAL", armed=False)]
    check = only(play(expect=({"mode": "DISARMED"},), modes=modes))
    assert (check.passed, check.seen, check.time_s) == (True, "MANUAL, disarmed since 0:30", 30.0)


def test_a_mode_that_was_never_heard() -> None:
    check = only(play(expect=({"mode": "MANUAL"},)))
    assert (check.passed, check.seen) == (False, "the autopilot's mode was never heard")


@pytest.mark.parametrize(
    ("window", "since_s", "right"),
    [
        ({}, 0.0, False),
        ({}, 60.0, False),
        ({"before_s": "fault"}, 24.999999, False),
        ({"before_s": "fault"}, 25.0, True),
        ({"before_s": 10.0}, 10.0, True),
        ({"from_s": 30.0}, 29.9, True),
        ({"from_s": 30.0}, 30.0, False),
        ({"from_s": 30.0, "before_s": 40.0}, 40.0, True),
        ({"from_s": 30.0, "before_s": 40.0}, 39.0, False),
    ],
)
def test_prohibitions(window: dict[str, object], since_s: float, right: bool) -> None:
    wanted = {"finding": {"at_least": "SUSPECT"}} | window
    check = only(play(never=(wanted,), findings=[finding(since_s, Level.SUSPECT)]))
    assert check.passed is right
    assert check.time_s == (None if right else since_s)


def test_before_a_fault_that_never_comes_is_to_the_end() -> None:
    wanted = {"statustext": "entangled", "before_s": "fault"}
    check = only(play(faults=(), never=(wanted,), texts=[text(59.0, "T1 entangled?"), text(59.5, "T1 entangled?")]))
    assert not check.passed
    assert check.expected == 'no STATUSTEXT "entangled" at all'
    assert check.seen == 'at 0:59: CRITICAL "T1 entangled?", and 1 more'


def test_a_play_that_broke_off_has_failed_whatever_came() -> None:
    outcome = play(expect=(FAULT_IN_2_S,), findings=[finding(26.0)], broken="the gateway stopped: no such bus")
    assert not passed(outcome)
    first, second = checks(outcome)
    assert first == Check("the play comes to its end", False, "the gateway stopped: no such bus")
    assert second.passed


def test_all_must_pass() -> None:
    expect, came = (FAULT_IN_2_S, TEXT_IN_2_S), {"findings": [finding(26.0)]}
    assert not passed(play(expect=expect, **came))
    assert passed(play(expect=expect, texts=[text(26.1, "T3 entangled?")], **came))


def test_found_after() -> None:
    came = {"findings": [finding(25.31)], "texts": [text(25.4, "T3 entangled?")]}
    assert found_after_s(play(expect=(TEXT_IN_2_S, FAULT_IN_2_S), **came)) == pytest.approx(0.31)
    assert found_after_s(play(expect=(TEXT_IN_2_S,), **came)) == pytest.approx(0.4)
    assert found_after_s(play(expect=(HOLD_IN_2_S,), **came)) is None
    assert found_after_s(play(expect=(FAULT_IN_2_S,), findings=[finding(30.0)])) is None

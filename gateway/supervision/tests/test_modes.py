"""Whose mode it is: the pilot's, that of before, ours, or one that comes late."""

import pytest

from gateway.supervision.actions import Action
from gateway.supervision.autopilots import REQUESTS, AutopilotKind
from gateway.supervision.modes import FOREIGN_HEARTBEATS, Modes
from gateway.supervision.tests.scene import ACRO, ALT_HOLD, MANUAL, POSHOLD, STABILIZE, SURFACE, heartbeat

HOLD, SURFACING, DISARM = (
    REQUESTS[AutopilotKind.ARDUSUB, action] for action in (Action.HOLD, Action.SURFACE, Action.DISARM)
)
ALL = {STABILIZE, ACRO, ALT_HOLD, SURFACE, POSHOLD, MANUAL}


def overriding(modes: Modes) -> set[int]:
    return {mode for mode in ALL if modes.overridden(mode, stands=False)}


def test_of_nothing_that_was_announced_nothing_is_an_override():
    assert overriding(Modes()) == set()


def test_in_a_countdown_any_other_mode_is_an_override():
    modes = Modes()
    modes.announced(STABILIZE, None)
    assert overriding(modes) == ALL - {STABILIZE}
    assert not modes.acted


def test_what_was_asked_may_come_about():
    modes = Modes()
    modes.announced(STABILIZE, None)
    modes.asked(HOLD)
    assert overriding(modes) == ALL - {STABILIZE, ALT_HOLD, POSHOLD}
    assert modes.acted


def test_what_was_asked_before_may_come_late():
    modes = Modes()
    modes.announced(STABILIZE, None)
    modes.asked(HOLD)
    modes.announced(STABILIZE, None)
    assert overriding(modes) == ALL - {STABILIZE, ALT_HOLD, POSHOLD}


@pytest.mark.parametrize("trusted", [True, False])
def test_what_stands_has_to_be_left_for_a_while(trusted):
    modes = Modes()
    modes.announced(STABILIZE, None)
    modes.asked(HOLD)
    modes.came_about(HOLD, trusted)
    ours = {ALT_HOLD, POSHOLD} if trusted else {ALT_HOLD}
    for mode in ALL:
        for count in range(FOREIGN_HEARTBEATS):
            assert not modes.overridden(mode, stands=True), count
            modes.heartbeat(mode)
        assert modes.overridden(mode, stands=True) == (mode not in ours)
        modes.heartbeat(ALT_HOLD)


def test_surfacing_goes_on_into_a_depth_hold():
    modes = Modes()
    modes.came_about(SURFACING, position_trusted=True)
    for _ in range(5):
        modes.heartbeat(ALT_HOLD)
    assert not modes.overridden(ALT_HOLD, stands=True)
    modes.announced(SURFACE, SURFACING)
    assert overriding(modes) == ALL - {SURFACE, ALT_HOLD}


def test_who_has_left_what_stood_is_seen_at_once_when_more_is_announced():
    modes = Modes()
    modes.came_about(HOLD, position_trusted=True)
    modes.announced(MANUAL, HOLD)
    assert modes.overridden(MANUAL, stands=False)


def test_what_has_no_mode_of_its_own_is_never_overridden():
    modes = Modes()
    modes.asked(DISARM)
    modes.came_about(DISARM, position_trusted=True)
    for _ in range(5):
        modes.heartbeat(ACRO)
    assert not modes.overridden(ACRO, stands=True)
    assert DISARM.ended(heartbeat(0.0, armed=False))
    assert not DISARM.ended(heartbeat(0.0, status=8))

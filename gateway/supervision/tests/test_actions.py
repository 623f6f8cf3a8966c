"""PX4's order and words, what each action needs, and how each autopilot is asked for it."""

import itertools

import pytest

from drivers.mavlink.messages import CommandLong
from gateway.supervision.actions import NEEDS, ONE_EVIDENCE_MAX, RANK, Action, Need, Plan, possible, sends
from gateway.supervision.autopilots import LOST_AFTER_S, REQUESTS, ArmedEdge, AutopilotKind, AutopilotWatch, kind_of
from gateway.supervision.tests.scene import heartbeat

ORDER = ("none", "warn", "manual", "hold", "return", "land", "disarm", "terminate")


def test_px4s_order():
    ranks = [RANK[Action(word)] for word in ORDER]
    assert ranks == sorted(set(ranks))
    assert RANK[Action.SURFACE] == RANK[Action.RETURN]
    assert set(RANK) == set(Action)
    assert [action for action in Action if not sends(action)] == [Action.NONE, Action.WARN]


def test_above_hold_two_kinds_of_evidence_are_needed_and_only_there():
    for action in Action:
        assert (Need.EVIDENCE in NEEDS[action]) == (RANK[action] > ONE_EVIDENCE_MAX)


def test_what_holds_or_changes_the_depth_needs_vertical_thrust_and_the_depth():
    for action in (Action.HOLD, Action.RETURN, Action.SURFACE, Action.LAND):
        assert {Need.VERTICAL_THRUST, Need.DEPTH} <= NEEDS[action]
    for action in (Action.MANUAL, Action.DISARM, Action.TERMINATE):
        assert not {Need.VERTICAL_THRUST, Need.DEPTH} & NEEDS[action]


@pytest.mark.parametrize("missing", [set(some) for n in range(3) for some in itertools.combinations(Need, n)])
def test_what_is_possible_is_what_needs_nothing_that_is_missing(missing):
    ladder = tuple(Action)
    useful, why = possible(ladder, missing)
    assert useful == tuple(action for action in ladder if sends(action) and not NEEDS[action] & missing)
    left_out = [action for action in ladder if NEEDS[action] & missing]
    assert why.startswith(left_out[0].capitalize() if left_out else "")
    assert bool(why) == bool(left_out)


def test_why_an_action_is_left_out_is_said_of_the_first():
    assert possible((Action.SURFACE, Action.HOLD), {Need.DEPTH}) == ((), "Surface not asked: depth not known")


def test_rank_of_a_plan_is_that_of_its_first_action():
    assert Plan("T3", (Action.HOLD, Action.MANUAL)).rank == RANK[Action.HOLD]


# How each autopilot is asked ------------------------------------------------------------------------


def test_requests_are_those_that_are_known_to_be_accepted():
    asked = {
        key: (request.command, request.parameters, set(request.modes), set(request.after), set(request.as_good))
        for key, request in REQUESTS.items()
    }
    sub, px4 = AutopilotKind.ARDUSUB, AutopilotKind.PX4
    assert asked == {
        (sub, Action.MANUAL): (176, (1.0, 19.0), {19}, set(), set()),
        (sub, Action.HOLD): (176, (1.0, 2.0), {2}, set(), {16}),
        (sub, Action.SURFACE): (176, (1.0, 9.0), {9}, {2}, set()),
        (sub, Action.LAND): (21, (), {9}, {2}, set()),
        (sub, Action.DISARM): (400, (0.0, 0.0), set(), set(), set()),
        (sub, Action.TERMINATE): (185, (1.0,), set(), set(), set()),
        (px4, Action.MANUAL): (176, (1.0, 1.0), {1 << 16}, set(), set()),
        (px4, Action.HOLD): (176, (1.0, 2.0), {2 << 16}, set(), {3 << 16}),
        (px4, Action.DISARM): (400, (0.0, 21196.0), set(), set(), set()),
        (px4, Action.TERMINATE): (185, (1.0,), set(), set(), set()),
    }


def test_a_request_goes_to_the_autopilot_that_was_heard():
    message = REQUESTS[AutopilotKind.ARDUSUB, Action.HOLD].message(heartbeat(0.0))
    assert message == CommandLong(176, (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1, 1, 0)


def test_nothing_ever_arms():
    for request in REQUESTS.values():
        assert request.command != 400 or request.parameters[0] == 0.0
        assert 2989.0 not in request.parameters


@pytest.mark.parametrize(
    ("autopilot", "vehicle", "kind"),
    [
        (3, 12, AutopilotKind.ARDUSUB),
        (12, 12, AutopilotKind.PX4),
        (3, 2, AutopilotKind.OTHER),  # a multicopter's modes have other numbers
        (0, 12, AutopilotKind.OTHER),
    ],
)
def test_autopilot_is_known_by_its_heartbeat(autopilot, vehicle, kind):
    assert kind_of(heartbeat(0.0, autopilot=autopilot, vehicle=vehicle)) is kind


def test_the_watch_knows_edges_and_what_is_too_old():
    watch = AutopilotWatch()
    assert (watch.armed, watch.present(0.0)) == (None, None)
    assert watch.heartbeat(heartbeat(0.0, armed=True)) is ArmedEdge.NONE  # nobody knows what was before
    assert watch.heartbeat(heartbeat(1.0, armed=False)) is ArmedEdge.DISARMED
    assert watch.heartbeat(heartbeat(2.0, armed=False)) is ArmedEdge.NONE
    assert watch.heartbeat(heartbeat(3.0, armed=True)) is ArmedEdge.ARMED
    assert watch.present(3.0 + LOST_AFTER_S) == heartbeat(3.0)
    assert watch.present(3.1 + LOST_AFTER_S) is None
    watch.ambiguous = True
    assert (watch.armed, watch.present(3.0)) == (True, None)

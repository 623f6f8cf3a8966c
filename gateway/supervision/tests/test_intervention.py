"""How a fault leads to a request: each cell of the table reached from outside, and what could make it unsafe."""

from __future__ import annotations

import itertools
import math
import pickle
import re

import pytest

from drivers.mavlink.messages import CommandLong
from gateway.severity import Severity
from gateway.supervision.actions import Action, Plan
from gateway.supervision.autopilots import MAV_AUTOPILOT_PX4 as PX4
from gateway.supervision.autopilots import AutopilotWatch
from gateway.supervision.intervention import CONFIRM_S, Intervention
from gateway.supervision.intervention_table import TABLE, Effect, Happening, State, diagram
from gateway.supervision.tests.scene import (
    ACCEPTED,
    ACRO,
    ACTIVE,
    ALT_HOLD,
    DELAY_S,
    DENIED,
    IN_PROGRESS,
    INTERVAL_S,
    MANUAL,
    OWN_FAILSAFE,
    POSHOLD,
    STABILIZE,
    SURFACE,
    TEMPORARILY_REJECTED,
    Scene,
)

# Each cell of the table ----------------------------------------------------------------------------


def bring_about(happening: Happening, scene: Scene) -> None:
    """Lets something happen, whatever the state is."""
    match happening:
        case Happening.SHOWN:
            scene.beat(mode=ALT_HOLD)
        case Happening.DISARMED:
            scene.beat(armed=False)
        case Happening.TAKEN_OVER:
            scene.beat(mode=ACRO)
            scene.beat()
        case Happening.ALL_WELL:
            scene.want_nothing(all_well=True)
        case Happening.UNWANTED:
            scene.want_nothing()
        case Happening.BLOCKED if scene.state is State.IDLE:
            scene.status = OWN_FAILSAFE
            scene.beat()
            scene.want(Action.HOLD)
        case Happening.BLOCKED if scene.state is State.CONFIRMING:
            scene.silence(6.0)
        case Happening.BLOCKED:
            scene.beat(status=OWN_FAILSAFE)
        case Happening.WORSE:
            scene.want(Action.SURFACE, Action.HOLD)
        case Happening.USELESS:
            scene.want(Action.MANUAL)
        case Happening.OTHER:
            scene.want(Action.MANUAL, Action.HOLD)
        case Happening.ALREADY:
            scene.beat(mode=ALT_HOLD, status=ACTIVE)
            if scene.state is State.IDLE:
                scene.want(Action.HOLD)
        case Happening.HARSHER:
            scene.plan = scene.plan and Plan("T3", (Action.HOLD, Action.SURFACE))
            _fail(scene, exhausted=False)
        case Happening.EXHAUSTED | Happening.FAILED:
            _fail(scene, exhausted=happening is Happening.EXHAUSTED)
        case Happening.ACCEPTED:
            scene.answer(ACCEPTED)
        case Happening.DUE:
            scene.wait(DELAY_S)
        case Happening.WANTED:
            _want_again(scene)


def _fail(scene: Scene, exhausted: bool) -> None:
    if exhausted and scene.plan is not None:
        scene.plan = Plan("T3", (Action.HOLD,))
    if scene.state is State.CONFIRMING:
        scene.wait(CONFIRM_S)
    else:
        scene.answer(DENIED)


def _want_again(scene: Scene) -> None:
    """What was asked just now is asked again when its interval is over, at the earliest."""
    if scene.state is State.REFRAINED:
        scene.time_s += INTERVAL_S
        scene.beat(status=4)
    elif scene.state is State.IDLE:
        scene.want(Action.HOLD)
    else:
        scene.update()


# What else is so when that happens
ALSO = {
    Happening.ALL_WELL: (Happening.UNWANTED,),
    Happening.WORSE: (Happening.OTHER, Happening.WANTED),
    Happening.USELESS: (Happening.OTHER, Happening.WANTED),
    Happening.OTHER: (Happening.WANTED,),
    Happening.ALREADY: (Happening.SHOWN,),
    Happening.EXHAUSTED: (Happening.FAILED,),
    Happening.HARSHER: (Happening.FAILED,),
}


def expected(state: State, happening: Happening) -> tuple[State, Effect]:
    """By the table, of which this knows no more than the order of happenings."""
    holds = {happening, *ALSO.get(happening, ())}
    if state is State.REFRAINED and happening is not Happening.WANTED:
        holds.discard(Happening.WANTED)  # the obstacle is still there
    if (state, happening) == (State.CONFIRMING, Happening.DUE):
        holds.add(Happening.FAILED)  # nothing was shown in that time
    for one in Happening:
        if one in holds and (state, one) in TABLE:
            return TABLE[state, one].state, TABLE[state, one].effect
    return state, Effect.NOTHING


TEXT_OF = {
    Effect.ANNOUNCE: r"(Hold|Surface|Manual) in 5 s for T3, change mode to stop",
    Effect.CHANGE: r"Manual in 5 s for T3, change mode to stop",
    Effect.REFRAIN: r"Hold not asked: autopilot in its own failsafe",
    Effect.CANCEL: r"Hold (cancelled: vehicle disarmed|for T3 cancelled)",
    Effect.RECALL: r"Hold not needed now, may still come \(T3\)",
    Effect.FALL_BACK: r"Hold (denied|did not come), asking manual for T3",
    Effect.POSTPONE: r"Hold (denied|did not come), surface in 5 s for T3",
    Effect.ADOPT: r"Hold is on already, good for T3",
    Effect.GIVE_UP: r"Hold (denied|did not come): yours to act on T3",
    Effect.DONE: r"Hold (done for T3|is on already, good for T3)",
    Effect.YIELD: r"Mode changed: gateway keeps out until all is well",
}


@pytest.mark.parametrize(("state", "happening"), list(itertools.product(State, Happening)))
def test_each_cell(state, happening):
    scene = Scene().reach(state)
    to, effect = expected(state, happening)
    bring_about(happening, scene)
    assert scene.state is to
    assert len(scene.commands) == (effect in (Effect.ASK, Effect.FALL_BACK)) + (
        state is State.ASKED and happening is Happening.DUE  # a second without an answer
    )
    if (state, happening) == (State.CONFIRMING, Happening.BLOCKED):
        assert scene.texts == []  # who could read it?
    elif effect in TEXT_OF:
        assert re.fullmatch(TEXT_OF[effect], scene.said)
    else:
        assert scene.texts == []


@pytest.mark.parametrize("state", State)
def test_each_state_is_reached_and_left(state):
    assert state is State.IDLE or any(step.state is state for step in TABLE.values())
    assert any(at is state and step.state is not state for (at, _), step in TABLE.items())


@pytest.mark.parametrize("state", State)
def test_disarming_ends_each_state(state):
    scene = Scene().reach(state)
    scene.beat(armed=False)
    assert scene.state is State.IDLE
    scene.wait(INTERVAL_S)
    assert scene.commands == []


AFTER_A_CUT = {
    State.COUNTDOWN: State.COUNTDOWN,  # announced anew
    State.ASKED: State.REFRAINED,  # asked just now
    State.CONFIRMING: State.REFRAINED,
}


@pytest.mark.parametrize("state", State)
def test_a_link_that_is_cut_in_each_state(state):
    scene = Scene().reach(state)
    for _ in range(20):
        scene.silence(1.0)
    scene.beat(status=ACTIVE)
    assert scene.state is AFTER_A_CUT.get(state, state)
    assert scene.modes_asked == ([2.0, 2.0] if state is State.ASKED else [])  # again, and nothing else into the dark
    assert (scene.said == "Hold in 5 s for T3, change mode to stop") == (state is State.COUNTDOWN)


@pytest.mark.parametrize("state", State)
def test_an_autopilot_that_restarts_in_each_state(state):
    scene = Scene().reach(state)
    scene.silence(8.0)
    scene.beat(mode=MANUAL, armed=False, status=3)
    assert scene.state is State.IDLE
    scene.want_nothing(all_well=True)  # disarming has cleared or settled the faults
    scene.beat(mode=MANUAL, armed=True, status=ACTIVE)
    assert (scene.state, scene.commands) == (State.IDLE, [])


@pytest.mark.parametrize("state", State)
def test_two_autopilots_in_each_state(state):
    scene = Scene().reach(state)
    scene.two()
    for _ in range(10):
        scene.silence(1.0)
    assert scene.commands == []
    assert scene.state not in (State.COUNTDOWN, State.ASKED, State.CONFIRMING)


@pytest.mark.parametrize("state", State)
def test_each_state_survives_a_pickle(state):
    scene = Scene().reach(state)
    copy = pickle.loads(pickle.dumps(scene))  # noqa: S301  our own bytes
    for one in (scene, copy):
        one.wait(1.0)
        one.answer(ACCEPTED)
        one.beat(mode=ACRO)
        one.silence(20.0)
        one.wait(INTERVAL_S)
    assert copy.outcomes == scene.outcomes
    assert copy.state is scene.state


def test_diagram_has_every_step():
    lines = diagram().splitlines()
    assert len(lines) == 2 + len(TABLE)
    assert "    COUNTDOWN --> ASKED: delay is over, mode as before" in lines


# Announced, and prevented --------------------------------------------------------------------------


def test_it_is_announced_asked_when_the_delay_is_over_and_believed_when_it_is_shown():
    scene = Scene(Action.HOLD)
    assert scene.texts[-1].severity == Severity.ERROR  # red in ground stations, and not the fault's own CRITICAL
    scene.wait(DELAY_S - 0.1)
    assert scene.commands == []
    scene.wait(0.1)
    (command,) = scene.commands
    assert command == CommandLong(176, (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1, 1, 0)
    scene.answer(ACCEPTED)
    assert scene.said.startswith("Hold in")
    scene.beat(mode=ALT_HOLD)
    assert (scene.texts[-1].severity, scene.said) == (Severity.CRITICAL, "Hold done for T3")


def test_it_is_not_asked_on_a_heartbeat_from_within_the_delay():
    scene = Scene(Action.HOLD)
    scene.wait(DELAY_S - 0.5)
    scene.silence(1.0)  # the pilot may have changed the mode in that second
    assert scene.commands == []
    scene.beat(mode=MANUAL)
    assert scene.state is State.YIELDED
    assert scene.commands == []


def test_without_a_delay_it_is_asked_at_once():
    scene = Scene(Action.HOLD, delay_s=0.0)
    assert scene.modes_asked == [2.0]
    assert scene.texts == []


def test_what_is_worse_begins_the_delay_anew_and_what_is_not_does_not():
    scene = Scene(Action.HOLD)
    scene.wait(3.0)
    scene.want(Action.SURFACE, Action.HOLD)
    assert scene.said == "Surface in 5 s for T3, change mode to stop"
    scene.wait(4.0)
    assert scene.commands == []
    scene.want(Action.MANUAL)
    assert scene.said == "Manual in 1 s for T3, change mode to stop"
    scene.wait(1.0)
    assert scene.modes_asked == [float(MANUAL)]


def test_acknowledging_in_the_delay_is_no_claim_that_the_thruster_is_well():
    scene = Scene(Action.HOLD)
    scene.want_nothing()
    assert scene.said == "Hold for T3 cancelled"


# Asked and not answered, or not as it should --------------------------------------------------------


def test_a_command_without_an_answer_goes_out_three_times_and_then_the_next_of_the_plan():
    scene = Scene(Action.HOLD, Action.MANUAL, delay_s=0.0)
    for _ in range(3):
        scene.wait(1.0)
    assert [command.confirmation for command in scene.commands] == [0, 1, 2, 0]
    assert scene.modes_asked == [2.0, 2.0, 2.0, 19.0]
    assert (scene.texts[-1].severity, scene.said) == (Severity.ERROR, "Hold not answered, asking manual for T3")


def test_a_retry_is_not_sent_on_the_heartbeat_that_shows_the_pilots_override():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.time_s += 1.0
    scene.beat(mode=ACRO)
    assert scene.state is State.YIELDED
    assert len(scene.commands) == 1


def test_a_retry_is_not_sent_when_it_has_come_about():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.time_s += 1.0
    scene.beat(mode=ALT_HOLD)
    assert scene.state is State.STANDING
    assert len(scene.commands) == 1


@pytest.mark.parametrize(
    "stop",
    [
        lambda scene: scene.want_nothing(),
        lambda scene: scene.want(left_out="Hold not asked: depth not known"),
        lambda scene: scene.want(Action.MANUAL),
        lambda scene: scene.beat(status=OWN_FAILSAFE),
        lambda scene: scene.beat(armed=False),
        lambda scene: scene.silence(5.1),
        lambda scene: (scene.two(), scene.update()),
    ],
    ids=["over", "pointless", "other", "own failsafe", "disarmed", "not heard", "two autopilots"],
)
def test_retries_end_when_what_was_asked_is_not_wanted_any_more(stop):
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.intervention._delay_s = DELAY_S  # of what comes then
    stop(scene)
    for _ in range(4):
        scene.silence(1.0)
    assert scene.modes_asked == [2.0]


def test_not_known_to_this_autopilot_any_more():
    scene = Scene(Action.HOLD, delay_s=0.0, autopilot=PX4)
    scene.want(Action.SURFACE)
    assert scene.state is State.REFRAINED
    assert scene.said == "Surface not asked: PX4 has none"


def test_in_progress_is_waited_for_and_temporarily_rejected_is_tried_again():
    scene = Scene(Action.HOLD, delay_s=0.0)
    for _ in range(5):
        scene.wait(0.9)
        scene.answer(IN_PROGRESS)
    assert len(scene.commands) == 1
    scene.answer(TEMPORARILY_REJECTED)
    for _ in range(3):
        scene.wait(1.0)
    assert [command.confirmation for command in scene.commands] == [0, 1, 2]
    assert scene.said == "Hold rejected for now: yours to act on T3"


def test_accepted_and_not_shown_is_not_believed():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.answer(ACCEPTED)
    scene.wait(CONFIRM_S - 0.1)
    assert scene.state is State.CONFIRMING
    scene.wait(0.1)
    assert scene.said == "Hold did not come: yours to act on T3"
    assert scene.state is State.SPENT


def test_answers_of_others_mean_nothing():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.answer(ACCEPTED, command=400)
    scene.answer(DENIED, component_id=191)
    assert scene.state is State.ASKED


# Never again, never against the pilot ---------------------------------------------------------------


def test_the_same_is_not_asked_again_within_the_interval_and_announced_again_after_it():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.answer(ACCEPTED)
    scene.beat(mode=ALT_HOLD)
    scene.want_nothing(all_well=True)
    scene.beat(mode=STABILIZE)  # the pilot's, after all was well
    scene.all_well = False
    scene.want(Action.HOLD)
    assert scene.state is State.REFRAINED
    scene.wait(INTERVAL_S - 1.0)
    assert len(scene.commands) == 1
    scene.wait(1.0)
    assert len(scene.commands) == 2


def test_a_pilot_who_leaves_the_mode_that_came_about_is_not_fought_until_all_is_well():
    scene = Scene().reach(State.STANDING)
    scene.beat(mode=MANUAL)
    assert scene.state is State.STANDING  # one HEARTBEAT may have been under way for long
    scene.wait(1.0)
    assert scene.state is State.YIELDED
    scene.want(Action.SURFACE, Action.HOLD)
    scene.wait(10 * INTERVAL_S)
    assert scene.commands == []
    scene.want_nothing(all_well=True)
    assert scene.state is State.IDLE


def test_a_pilot_who_left_the_mode_just_before_it_got_worse_is_not_fought():
    scene = Scene().reach(State.STANDING)
    scene.time_s += 1.0
    scene.beat(mode=MANUAL)
    scene.want(Action.SURFACE, Action.HOLD)
    scene.wait(DELAY_S)
    assert scene.state is State.YIELDED
    assert scene.commands == []


def test_a_link_that_was_cut_while_asking_does_not_hide_what_came_of_it():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.silence(6.0)
    assert scene.state is State.REFRAINED
    scene.beat(mode=ALT_HOLD)
    assert scene.state is State.STANDING
    scene.wait(1.0)
    scene.beat(mode=MANUAL)
    scene.wait(1.0)
    scene.wait(10 * INTERVAL_S)
    assert scene.state is State.YIELDED
    assert scene.modes_asked == [2.0]


def test_silence_is_no_sign_that_it_did_not_come_about():
    """Its answer and HEARTBEAT may be lost while the autopilot does as it was asked: the next must not undo that."""
    scene = Scene(Action.HOLD, Action.MANUAL, delay_s=0.0)
    for _ in range(4):
        scene.silence(1.0)
    assert scene.modes_asked == [2.0, 2.0, 2.0]
    scene.beat(mode=ALT_HOLD)
    assert scene.said == "Hold done for T3"


def test_silence_after_the_answer_is_no_sign_either():
    scene = Scene(Action.HOLD, Action.MANUAL, delay_s=0.0)
    scene.answer(ACCEPTED)
    for _ in range(20):
        scene.silence(1.0)
    scene.beat(mode=ALT_HOLD)
    assert scene.modes_asked == [2.0]
    assert scene.said == "Hold done for T3"


def test_a_link_that_was_cut_while_asking_does_not_hide_the_pilots_override():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.silence(6.0)
    scene.beat(mode=ACRO)
    assert scene.state is State.YIELDED


def test_a_mode_that_was_asked_before_and_comes_late_is_no_override():
    scene = Scene(Action.HOLD, delay_s=0.0)
    scene.intervention._delay_s = DELAY_S  # of what comes then
    scene.want(Action.MANUAL)
    assert scene.state is State.COUNTDOWN
    scene.wait(1.0)
    scene.beat(mode=ALT_HOLD)
    assert scene.state is State.COUNTDOWN
    scene.wait(DELAY_S)
    assert scene.modes_asked == [2.0, 19.0]


def test_a_pilots_mode_that_happened_to_be_good_is_his_and_so_is_the_next():
    scene = Scene()
    scene.beat(mode=ALT_HOLD)
    scene.want(Action.HOLD, Action.MANUAL)
    assert scene.state is State.STANDING
    scene.want(Action.MANUAL)
    scene.wait(1.0)
    scene.beat(mode=POSHOLD)
    assert scene.state is State.YIELDED


# What stands ----------------------------------------------------------------------------------------


def test_what_stands_is_left_when_it_relies_on_what_fails_later():
    scene = Scene().reach(State.STANDING)
    scene.want(Action.MANUAL)  # of "hold, manual" the first is of no use any more: the depth sensor failed
    assert scene.said == "Manual in 5 s for T3, change mode to stop"
    scene.wait(DELAY_S)
    assert scene.modes_asked == [19.0]


def test_a_position_that_is_held_is_left_for_a_depth_when_the_dvl_fails():
    scene = Scene()
    scene.beat(mode=POSHOLD)
    scene.want(Action.HOLD)
    assert (scene.state, scene.said) == (State.STANDING, "Hold is on already, good for T3")
    scene.want(Action.HOLD, position_trusted=False)
    scene.wait(DELAY_S)
    assert scene.modes_asked == [2.0]
    scene.answer(ACCEPTED)
    scene.beat(mode=ALT_HOLD)
    assert scene.said == "Hold done for T3"


def test_surface_hands_over_to_depth_hold_by_itself():
    scene = Scene(Action.SURFACE, delay_s=0.0)
    scene.answer(ACCEPTED)
    scene.wait(1.0)
    scene.beat(mode=SURFACE)
    assert scene.said == "Surface done for T3"
    for mode in (SURFACE, ALT_HOLD, ALT_HOLD, ALT_HOLD):
        scene.time_s += 1.0
        scene.beat(mode=mode)
    assert scene.state is State.STANDING


def test_surface_at_the_surface_is_never_seen_and_believed_all_the_same():
    scene = Scene(Action.SURFACE, delay_s=0.0)
    scene.beat(mode=ALT_HOLD)
    assert scene.state is State.ASKED  # before the answer it may as well be the pilot
    scene.answer(ACCEPTED)
    scene.wait(1.0)
    assert scene.said == "Surface done for T3"


@pytest.mark.parametrize(("autopilot", "status"), [(3, 4), (PX4, 4)])
def test_disarm_is_shown_by_a_vehicle_that_is_not_armed(autopilot, status):
    scene = Scene(Action.DISARM, delay_s=0.0, autopilot=autopilot)
    assert scene.commands[0].command == 400
    assert scene.commands[0].parameters[:2] == ((0.0, 0.0) if autopilot == 3 else (0.0, 21196.0))
    scene.answer(ACCEPTED, command=400)
    scene.wait(1.0)
    assert scene.state is State.CONFIRMING
    scene.beat(armed=False, status=status)
    assert scene.said == "Disarm done for T3"
    assert scene.state is State.IDLE


def test_px4_that_was_terminated_stays_armed_and_says_so():
    scene = Scene(Action.TERMINATE, delay_s=0.0, autopilot=PX4)
    scene.answer(ACCEPTED, command=185)
    scene.wait(1.0)
    scene.beat(status=8)
    assert (scene.state, scene.said) == (State.STANDING, "Terminate done for T3")


def test_an_autopilots_own_failsafe_does_not_show_that_a_disarm_came_about():
    scene = Scene(Action.DISARM, delay_s=0.0, autopilot=PX4)
    scene.answer(ACCEPTED, command=400)
    scene.beat(status=8)
    assert scene.state is State.CONFIRMING


# Over a restart of the program ---------------------------------------------------------------------


def resumed(old: Scene) -> Scene:
    new = Scene()
    new.time_s, new.mode, new.armed = old.time_s + 2.0, old.mode, old.armed
    new.intervention.resume(pickle.loads(pickle.dumps(old.intervention)))  # noqa: S301  our own bytes
    new.plan = old.plan
    new.beat(status=4)
    return new


@pytest.mark.parametrize(
    ("state", "after"),
    [
        (State.IDLE, State.IDLE),
        (State.COUNTDOWN, State.IDLE),
        (State.ASKED, State.SPENT),
        (State.CONFIRMING, State.SPENT),
        (State.REFRAINED, State.SPENT),  # it was asked before
        (State.STANDING, State.STANDING),
        (State.YIELDED, State.YIELDED),
        (State.SPENT, State.SPENT),
    ],
)
def test_what_was_asked_before_a_restart_is_not_asked_again(state, after):
    old = Scene().reach(state)
    new = Scene()
    new.intervention.resume(old.intervention)
    assert new.state is after


def test_what_was_only_announced_before_a_restart_is_announced_again():
    new = resumed(Scene().reach(State.COUNTDOWN))
    assert new.said == "Hold in 5 s for T3, change mode to stop"


def test_a_pilots_override_after_a_restart_is_one():
    new = resumed(Scene().reach(State.STANDING))
    new.beat(mode=MANUAL)
    new.wait(1.0)
    assert new.state is State.YIELDED


def test_the_interval_lasts_over_a_restart():
    new = resumed(Scene().reach(State.STANDING))
    new.want_nothing(all_well=True)
    new.beat(mode=STABILIZE)
    new.want(Action.HOLD)
    new.wait(DELAY_S)
    assert new.commands == []


@pytest.mark.parametrize("wrong", [{"delay_s": -1.0}, {"interval_s": math.nan}])
def test_negative_times_are_the_callers_mistake(wrong):
    with pytest.raises(ValueError, match="want 0 or more seconds"):
        Intervention(AutopilotWatch(), **wrong)


# What is graver than what was announced ------------------------------------------------------------


def test_what_is_harsher_than_announced_gets_its_own_delay():
    scene = Scene(Action.HOLD, Action.DISARM)
    scene.wait(DELAY_S)
    scene.answer(DENIED)
    assert scene.said == "Hold denied, disarm in 5 s for T3"
    scene.wait(DELAY_S - 1.0)
    assert [command.command for command in scene.commands] == [176]
    scene.wait(1.0)
    assert [command.command for command in scene.commands] == [176, 400]


def test_a_hold_that_comes_late_is_not_taken_for_the_end_of_a_surfacing_that_was_not_asked():
    scene = Scene(Action.HOLD, Action.SURFACE)
    scene.wait(DELAY_S)
    scene.answer(ACCEPTED)
    scene.wait(CONFIRM_S)
    assert scene.said == "Hold did not come, surface in 5 s for T3"
    scene.wait(1.0)
    scene.beat(mode=ALT_HOLD)
    assert scene.state is State.COUNTDOWN


def test_pilot_prevents_what_is_harsher():
    scene = Scene(Action.HOLD, Action.DISARM)
    scene.wait(DELAY_S)
    scene.answer(DENIED)
    scene.wait(1.0)
    scene.beat(mode=MANUAL)
    assert scene.state is State.YIELDED
    scene.wait(INTERVAL_S)
    assert [command.command for command in scene.commands] == [176]


@pytest.mark.parametrize("mode", [ALT_HOLD, POSHOLD])
def test_what_is_so_already_is_not_announced(mode):
    scene = Scene()
    scene.beat(mode=mode)
    scene.want(Action.HOLD)
    assert [text.text for text in scene.texts] == ["Hold is on already, good for T3"]
    assert scene.state is State.STANDING and not scene.commands
    scene.wait(1.0)
    scene.beat(mode=MANUAL)
    scene.wait(1.0)
    assert scene.state is State.YIELDED


def test_a_position_mode_is_not_good_enough_where_the_position_is_not_known():
    scene = Scene()
    scene.beat(mode=POSHOLD)
    scene.want(Action.HOLD, position_trusted=False)
    assert scene.state is State.COUNTDOWN


def test_a_fallback_that_is_so_already_is_not_asked_for():
    scene = Scene()
    scene.beat(mode=MANUAL)
    scene.want(Action.HOLD, Action.MANUAL)
    scene.wait(DELAY_S)
    scene.answer(DENIED)
    assert [text.text for text in scene.texts][-2:] == ["Hold denied", "Manual is on already, good for T3"]
    assert [command.parameters[1] for command in scene.commands] == [ALT_HOLD]
    assert scene.state is State.STANDING


def test_what_comes_about_after_all_is_told():
    scene = Scene(Action.HOLD)
    scene.wait(DELAY_S)
    scene.answer(DENIED)
    assert scene.state is State.SPENT
    scene.beat(mode=ALT_HOLD)
    assert scene.said == "Hold done for T3" and scene.state is State.STANDING


def test_a_short_delay_is_told_as_it_is():
    assert Scene(Action.HOLD, delay_s=0.4).said == "Hold in 0.4 s for T3, change mode to stop"

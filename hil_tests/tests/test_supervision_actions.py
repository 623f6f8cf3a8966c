"""A fault and what comes of it, with an ArduSub or a PX4 at the other end: asked, refused, prevented, told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.readings import OperatorAct
from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.commander import Commander, Estimates
from hil_tests.rig.commands import Command, Result
from hil_tests.rig.conduct import NOT_SHOWN, SILENCE, Reply
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.tests.scene import Scene, configuration
from hil_tests.tests.virtual_rig import PERIOD_S, VirtualRig

HEALTHY_S = 7.0  # the detectors' stand-ins learn for five
SOON_S = 35.0  # longer than between two repetitions
LONG_S = 70.0  # longer than between two requests
HOLD = 'thruster_fault = ["hold"]\n'
NO_DELAY = "delay_s = 0\n"


@dataclass(frozen=True, slots=True)
class Kind:
    """An autopilot, and its words for what is asked of it."""

    make: type[Commander]
    hold: object
    hold_number: float
    manual: object
    manual_number: float
    others: object  # a mode that only a pilot chooses


ARDUSUB = Kind(ArduSub, Mode.ALT_HOLD, 2.0, Mode.MANUAL, 19.0, Mode.STABILIZE)
PX4 = Kind(Px4, MainMode.ALTCTL, 2.0, MainMode.MANUAL, 1.0, MainMode.ACRO)


@pytest.fixture(params=[ARDUSUB, PX4], ids=["ardusub", "px4"])
def kind(request) -> Kind:
    return request.param


def rig_of(kind: Kind, folder: Path, failsafe: str = HOLD, speed: bool = False, **options) -> VirtualRig:
    """A rig whose vehicle has been healthy for a while."""
    rig = VirtualRig(configuration(folder, failsafe, speed=speed), kind.make(**options))
    rig.run(HEALTHY_S)
    assert not rig.asked
    assert [text.text for text in rig.texts if text.severity <= 4] == []
    return rig


def modes_asked(rig: VirtualRig) -> list[float]:
    return [one.parameters[1] for one in rig.asked if one.command == Command.DO_SET_MODE]


def test_by_default_it_only_advises(kind, tmp_path):
    rig = rig_of(kind, tmp_path, "")
    rig.scene.entangle(1, 2)
    rig.run(SOON_S)
    assert rig.asked == []
    assert {command.command for command in rig.autopilot.notes.commands} <= {511}
    assert sum(text.severity == 2 for text in rig.texts) == 2
    assert rig.autopilot.notes.heartbeats[-1].system_status == mavlink.MAV_STATE_CRITICAL


def test_hold_comes_after_the_delay_once_and_is_told(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.scene.entangle(1)
    began_s = rig.time_s
    assert rig.run(2.0, lambda: rig.said("Hold in 5 s for T1"))
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    assert rig.commander.mode is kind.hold
    rig.run(LONG_S)
    [command] = rig.asked
    assert command.time_s - began_s > 5.0
    assert (command.parameters[:2], command.result) == ((1.0, kind.hold_number), Result.ACCEPTED)
    assert rig.commander.armed


def test_a_pilot_who_changes_the_mode_in_the_delay_prevents_it(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.scene.entangle(1)
    assert rig.run(2.0, lambda: rig.said("Hold in 5 s for T1"))
    rig.run(1.0)
    rig.commander.mode = kind.others
    rig.run(LONG_S)
    assert rig.asked == []
    assert rig.commander.mode is kind.others
    assert rig.said("gateway keeps out")


def test_a_pilot_who_changes_the_mode_afterwards_is_not_fought(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + "interval_s = 10\n")
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    rig.commander.mode = kind.manual
    rig.run(10.0)
    rig.scene.entangle(2)  # not even for another one
    rig.run(SOON_S)
    assert len(rig.asked) == 1
    assert rig.commander.mode is kind.manual
    assert rig.said("gateway keeps out")


def test_a_pilot_who_changed_the_mode_is_not_fought_for_something_worse_either(kind, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["manual"]\nthrusters_fault = ["hold"]\n' + NO_DELAY)
    rig.commander.mode = kind.hold
    rig.run(2.0)
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Manual done for T1"))
    rig.commander.mode = kind.others
    rig.run(5.0)
    rig.scene.entangle(2)
    rig.run(SOON_S)
    assert modes_asked(rig) == [kind.manual_number]
    assert rig.commander.mode is kind.others


def test_after_all_was_well_the_next_fault_is_acted_on_again(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + "interval_s = 10\n")
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    rig.commander.mode = kind.manual
    rig.run(5.0)
    rig.scene.free()
    rig.run(30.0)
    rig.scene.entangle(2)
    assert rig.run(15.0, lambda: rig.said("Hold done for T2"))
    assert len(rig.asked) == 2


def test_the_same_is_not_asked_again_within_the_interval(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.scene.entangle(1)
    assert rig.run(5.0, lambda: rig.said("Hold done for T1"))
    rig.scene.free()
    assert rig.run(20.0, lambda: rig.said("T1 ok again"))
    rig.commander.mode = kind.manual
    rig.run(5.0)
    rig.scene.entangle(1)
    rig.run(LONG_S)
    first, second = (one.time_s for one in rig.asked)
    assert 60.0 <= second - first + PERIOD_S <= 62.0
    assert rig.commander.mode is kind.hold


def test_nothing_is_asked_of_an_autopilot_in_its_own_failsafe(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.commander.failsafe = True
    rig.run(2.0)
    rig.scene.entangle(1)
    rig.run(SOON_S)
    assert rig.asked == []
    assert rig.said("autopilot in its own failsafe")
    assert rig.said("T1 entangled")


def test_a_failsafe_of_its_own_in_the_delay_stops_ours(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.scene.entangle(1)
    assert rig.run(2.0, lambda: rig.said("Hold in 5 s for T1"))
    rig.commander.failsafe = True
    rig.run(30.0)
    assert rig.asked == []


def test_nothing_is_asked_of_a_disarmed_vehicle(kind, tmp_path):
    rig = rig_of(kind, tmp_path, armed=False)
    rig.scene.entangle(1)
    rig.run(SOON_S)
    assert rig.asked == []


def test_disarming_in_the_delay_cancels(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.scene.entangle(1)
    assert rig.run(2.0, lambda: rig.said("Hold in 5 s for T1"))
    rig.commander.armed = False
    rig.run(SOON_S)
    assert rig.asked == []
    assert rig.said("Hold cancelled")


@pytest.mark.parametrize("result", [Result.DENIED, Result.UNSUPPORTED, Result.FAILED])
def test_a_refused_action_is_followed_by_the_next_and_told(kind, tmp_path, result):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["hold", "manual"]\n' + NO_DELAY)
    rig.commander.mode = kind.others
    rig.run(2.0)
    rig.autopilot.conduct.always(Command.DO_SET_MODE, Reply(result), second=kind.hold_number)
    rig.scene.entangle(1)
    assert rig.run(20.0, lambda: rig.said("Manual done for T1"))
    assert rig.commander.mode is kind.manual
    assert rig.said(f"Hold {result.name.lower()}, asking manual for T1")
    assert [one.result for one in rig.asked] == [result, Result.ACCEPTED]


def test_with_nothing_left_it_is_the_pilots_to_act(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.autopilot.conduct.always(Command.DO_SET_MODE, Reply(Result.DENIED))
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold denied: yours to act on T1"))
    rig.run(LONG_S)
    assert len(rig.asked) == 1


def test_accepted_but_never_shown_is_not_believed(kind, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["hold", "manual"]\n' + NO_DELAY)
    rig.commander.mode = kind.others
    rig.run(2.0)
    rig.autopilot.conduct.always(Command.DO_SET_MODE, NOT_SHOWN, second=kind.hold_number)
    rig.scene.entangle(1)
    assert rig.run(20.0, lambda: rig.said("Manual done for T1"))
    assert rig.said("Hold did not come, asking manual for T1")
    assert not rig.said("Hold done")


def test_no_answer_is_asked_three_times_with_the_confirmation_raised(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.autopilot.conduct.always(Command.DO_SET_MODE, SILENCE)
    rig.scene.entangle(1)
    assert rig.run(20.0, lambda: rig.said("Hold not answered: yours to act on T1"))
    assert [one.confirmation for one in rig.asked] == [0, 1, 2]


def test_commands_for_the_ground_station_only_are_noticed(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.autopilot.conduct.ground_station_only = True
    rig.scene.entangle(1)
    assert rig.run(20.0, lambda: rig.said("Hold not answered: yours to act on T1"))


def test_an_answer_that_was_lost_is_asked_for_again_and_the_mode_is_believed(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.autopilot.conduct.then(Command.DO_SET_MODE, Reply(None, obeyed=True))
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    assert rig.commander.mode is kind.hold
    assert not rig.said("not answered")


def test_a_temporary_rejection_is_tried_again(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.autopilot.conduct.then(Command.DO_SET_MODE, *[Reply(Result.TEMPORARILY_REJECTED)] * 2)
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    assert [one.result for one in rig.asked] == [Result.TEMPORARILY_REJECTED] * 2 + [Result.ACCEPTED]


def test_in_progress_is_waited_for(kind, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["hold", "manual"]\n' + NO_DELAY)
    rig.autopilot.conduct.then(Command.DO_SET_MODE, Reply(Result.ACCEPTED, obeyed=True, after_s=0.8))
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    assert modes_asked(rig) == [kind.hold_number]


def test_a_mode_that_needs_what_the_autopilot_does_not_know_is_followed_by_the_next(kind, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["hold", "manual"]\n' + NO_DELAY, estimates=Estimates(depth=False))
    rig.commander.mode = kind.others
    rig.run(2.0)
    rig.scene.entangle(1)
    assert rig.run(20.0, lambda: rig.said("Manual done for T1"))
    assert rig.commander.mode is kind.manual


def test_with_both_verticals_dead_hold_is_not_asked_for(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.scene.entangle(3, 4)
    rig.run(SOON_S)
    assert rig.asked == []
    assert rig.said("no vertical thrust")


def test_one_dead_vertical_of_two_still_holds(kind, tmp_path):
    rig = rig_of(kind, tmp_path, HOLD + NO_DELAY)
    rig.scene.entangle(3)
    assert rig.run(10.0, lambda: rig.said("Hold done for T3"))


def test_two_thrusters_have_their_own_policy(kind, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["warn"]\nthrusters_fault = ["hold"]\n' + NO_DELAY)
    rig.scene.entangle(1)
    rig.run(20.0)
    assert rig.asked == []
    rig.scene.entangle(2)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1+T2"))


def test_an_operator_who_acknowledges_in_the_delay_prevents_it(kind, tmp_path):
    rig = rig_of(kind, tmp_path)
    rig.scene.entangle(1)
    assert rig.run(2.0, lambda: rig.said("Hold in 5 s for T1"))
    rig.operator(OperatorAct.ACKNOWLEDGE, 1.0)
    rig.run(SOON_S)
    assert rig.asked == []
    told = [text.text for text in rig.texts if text.severity <= 4 and "T1 entangled" in text.text]
    assert len(told) == 1  # once acknowledged, it is not repeated


def test_two_kinds_of_evidence_surface_the_vehicle(tmp_path):
    rig = rig_of(ARDUSUB, tmp_path, 'thruster_fault = ["surface", "hold"]\n', speed=True)
    rig.scene.entangle(1)
    rig.scene.speed_mps = 0.5
    assert rig.run(15.0, lambda: rig.said("Surface done"))
    assert modes_asked(rig)[-1] == 9.0
    assert rig.run(60.0, lambda: rig.commander.mode is Mode.ALT_HOLD)  # it is up
    rig.run(SOON_S)
    assert modes_asked(rig).count(9.0) == 1
    assert rig.scene.motion.down_m < 0.5
    assert not rig.said("gateway keeps out")


def test_one_kind_of_evidence_holds_and_does_not_surface(tmp_path):
    rig = rig_of(ARDUSUB, tmp_path, 'thruster_fault = ["surface", "hold"]\n' + NO_DELAY, speed=True)
    rig.scene.entangle(1)
    rig.run(SOON_S)
    assert modes_asked(rig) == [2.0]


def test_surface_at_the_surface_shows_as_alt_hold(tmp_path):
    rig = VirtualRig(
        configuration(tmp_path, 'thruster_fault = ["surface"]\n' + NO_DELAY, speed=True),
        ArduSub(),
        scene=Scene(depth_m=0.1),
    )
    rig.run(HEALTHY_S)
    rig.scene.entangle(1)
    rig.scene.speed_mps = 0.5
    assert rig.run(10.0, lambda: rig.said("Surface done"))
    assert rig.commander.mode is Mode.ALT_HOLD
    rig.run(30.0)
    assert len(rig.asked) == 1


def test_surface_is_nothing_that_px4_has(tmp_path):
    rig = rig_of(PX4, tmp_path, 'thruster_fault = ["surface", "hold"]\n' + NO_DELAY, speed=True)
    rig.scene.entangle(1)
    rig.scene.speed_mps = 0.5
    assert rig.run(15.0, lambda: rig.said("Hold done"))
    assert modes_asked(rig) == [2.0]


@pytest.mark.parametrize("kind", [ARDUSUB, PX4], ids=["ardusub", "px4"])
def test_disarming_is_for_two_kinds_of_evidence_and_an_opt_in(kind, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["disarm"]\n' + NO_DELAY, speed=True)
    rig.scene.entangle(1)
    rig.run(30.0)
    assert rig.asked == []
    rig.scene.speed_mps = 0.5
    assert rig.run(15.0, lambda: not rig.commander.armed)
    assert [one.command for one in rig.asked] == [Command.COMPONENT_ARM_DISARM]
    assert 2989.0 not in rig.asked[0].parameters


def test_landing_is_surfacing_on_ardusub(tmp_path):
    rig = rig_of(ARDUSUB, tmp_path, 'thruster_fault = ["land"]\n' + NO_DELAY, speed=True)
    rig.scene.entangle(1)
    rig.scene.speed_mps = 0.5
    assert rig.run(15.0, lambda: rig.said("Land done"))
    assert [one.command for one in rig.asked] == [Command.NAV_LAND]
    assert rig.commander.mode is Mode.SURFACE


@pytest.mark.parametrize(("kind", "armed"), [(ARDUSUB, False), (PX4, True)], ids=["ardusub", "px4"])
def test_termination_is_asked_once(kind, armed, tmp_path):
    rig = rig_of(kind, tmp_path, 'thruster_fault = ["terminate"]\n' + NO_DELAY, speed=True)
    rig.scene.entangle(1)
    rig.scene.speed_mps = 0.5
    assert rig.run(15.0, lambda: bool(rig.asked))
    rig.run(SOON_S)
    assert [(one.command, one.parameters[0]) for one in rig.asked] == [(Command.DO_FLIGHTTERMINATION, 1.0)]
    assert rig.commander.armed is armed  # PX4 stays armed, and is latched
    assert rig.said("Terminate done")


class Copter(ArduSub):
    """ArduPilot on something that flies: other modes have the same numbers."""

    vehicle_type = mavlink.MAV_TYPE_QUADROTOR


class Unknown(Px4):
    """An autopilot that nobody has told us of."""

    autopilot = mavlink.MAV_AUTOPILOT_GENERIC


@pytest.mark.parametrize("make", [Copter, Unknown])
def test_another_autopilot_gets_advice_only_and_is_told_so(make, tmp_path):
    rig = VirtualRig(configuration(tmp_path, HOLD + NO_DELAY), make())
    rig.run(HEALTHY_S)
    rig.scene.entangle(1)
    rig.run(SOON_S)
    assert rig.asked == []
    assert rig.said("T1 entangled")
    assert rig.said("autopilot not known")

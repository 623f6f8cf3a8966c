"""What is said and asked over links that lose, delay, reorder and double, that are cut, and that others share."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.mavlink.messages import CommandAck, NamedValue
from drivers.readings import OperatorAct
from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.commands import Command
from hil_tests.rig.esc_messages import ESC_STATUS_ID
from hil_tests.rig.link_conditions import IDEAL, LinkConditions
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.tests.scene import configuration
from hil_tests.tests.virtual_rig import VirtualRig

HEALTHY_S = 7.0
HOLD = 'thruster_fault = ["hold"]\n'
NO_DELAY = "delay_s = 0\n"
HELD = {ArduSub: Mode.ALT_HOLD, Px4: MainMode.ALTCTL}
LOSSY = LinkConditions(loss=0.2)
SLOW = LinkConditions(latency_s=0.5)
DISORDERLY = LinkConditions(latency_s=0.05, jitter_s=0.3, reordering=0.2, held_s=0.4, duplication=0.2)
WORST = LinkConditions(loss=0.2, latency_s=0.5, jitter_s=0.1, reordering=0.1, duplication=0.1)
RUNS = 30

both = pytest.mark.parametrize("make", [ArduSub, Px4], ids=["ardusub", "px4"])


def rig_of(make, folder: Path, failsafe: str = HOLD, conditions=IDEAL, seed: int = 0, **options) -> VirtualRig:
    rig = VirtualRig(configuration(folder, failsafe, **options), make(), conditions, seed)
    rig.run(HEALTHY_S)
    return rig


def wrong(rig: VirtualRig) -> list[str]:
    """What a pilot is told that should not be."""
    return [text.text for text in rig.texts if text.severity <= 4 and "T1" not in text.text]


@both
@pytest.mark.parametrize("conditions", [SLOW, DISORDERLY, WORST], ids=["slow", "disorderly", "worst"])
def test_hold_comes_about_over_a_bad_link(make, conditions, tmp_path):
    rig = rig_of(make, tmp_path, HOLD + NO_DELAY, conditions, seed=3)
    rig.scene.entangle(1)
    assert rig.run(25.0, lambda: rig.commander.mode is HELD[make])
    rig.run(20.0)
    assert rig.commander.mode is HELD[make]
    assert {one.parameters[1] for one in rig.asked} == {2.0}
    done = [one.text for one in rig.findings if one.detector == "failsafe"]
    assert done[-1] == "Hold done for T1"
    assert wrong(rig) == []


@both
def test_the_command_protocol_bears_a_loss_of_a_fifth(make, tmp_path):
    config = configuration(tmp_path, HOLD + NO_DELAY)
    ends: Counter[str] = Counter()
    for seed in range(RUNS):
        rig = VirtualRig(config, make(), LOSSY, seed)
        rig.run(HEALTHY_S)
        rig.scene.entangle(1)
        rig.run(15.0, lambda rig=rig: any("Hold done" in one.text for one in rig.findings))
        notes = [one.text for one in rig.findings if one.detector == "failsafe"]
        ends[notes[-1]] += 1
        assert len(rig.asked) <= 3
        assert rig.commander.mode is HELD[make] or notes[-1] != "Hold done for T1"  # what is believed is so
    print(make.__name__, dict(ends))
    # three tries of which each way passes four in five: 1 - 0.36^3 = 0.95 are answered; the HEARTBEAT shows more
    assert ends["Hold done for T1"] >= 0.9 * RUNS


@both
def test_a_link_cut_after_the_command_is_believed_when_it_is_back(make, tmp_path):
    rig = rig_of(make, tmp_path, HOLD + NO_DELAY)
    rig.scene.entangle(1)
    assert rig.run(5.0, lambda: bool(rig.asked))
    rig.up.cut(0.0)  # neither answer nor HEARTBEAT comes back
    rig.down.cut(rig.time_s)
    rig.run(3.0)
    rig.up.mend()
    rig.down.mend()
    rig.run(20.0)
    assert rig.commander.mode is HELD[make]
    assert len(rig.asked) <= 3
    assert [one.text for one in rig.findings if one.detector == "failsafe"][-1] == "Hold done for T1"


@both
def test_a_link_that_is_cut_for_long_in_the_middle_asks_nothing_twice(make, tmp_path):
    rig = rig_of(make, tmp_path, HOLD + NO_DELAY)
    rig.down.cut(rig.time_s)  # the command never arrives
    rig.scene.entangle(1)
    rig.run(2.0)
    rig.up.cut(rig.time_s)
    rig.run(20.0)
    assert rig.asked == []
    rig.up.mend()
    rig.down.mend()
    rig.run(70.0)
    assert len({one.time_s for one in rig.asked}) <= 1
    last = [one.text for one in rig.findings if one.detector == "failsafe"][-1]
    assert last in {"Hold done for T1", "Hold not answered: yours to act on T1"}


@both
def test_a_restart_in_the_delay_leaves_a_disarmed_vehicle_alone(make, tmp_path):
    rig = rig_of(make, tmp_path)
    rig.scene.entangle(1)
    assert rig.run(3.0, lambda: rig.said("Hold in 5 s for T1"))
    rig.autopilot.restart(rig.time_s, silent_s=2.0)
    rig.run(60.0)
    assert rig.asked == []
    assert not rig.commander.armed


@both
def test_a_restart_after_the_command_ends_it(make, tmp_path):
    rig = rig_of(make, tmp_path, HOLD + NO_DELAY)
    rig.scene.entangle(1)
    assert rig.run(5.0, lambda: bool(rig.asked))
    rig.autopilot.restart(rig.time_s, silent_s=4.0)
    rig.run(60.0)
    assert len(rig.asked) == 1
    assert not rig.commander.armed


@both
def test_after_a_restart_the_streams_are_asked_for_again(make, tmp_path):
    rig = rig_of(make, tmp_path, speed=True)
    local_position = 32
    assert rig.autopilot.interval_s(local_position) == pytest.approx(0.1)
    rig.autopilot.restart(rig.time_s, silent_s=3.0)
    assert rig.autopilot.interval_s(local_position) > 0.5
    rig.commander.armed = True
    assert rig.run(30.0, lambda: rig.autopilot.interval_s(local_position) < 0.2)
    assert all(one.command == 511 for one in rig.autopilot.notes.commands)


def test_only_the_streams_that_are_read_are_asked_for(tmp_path):
    rig = rig_of(Px4, tmp_path)
    asked = {one.parameters[0] for one in rig.autopilot.notes.commands}
    assert not asked & {32.0, 33.0, 36.0, float(ESC_STATUS_ID)}  # thrusters are on the bus, speed is not watched


@both
def test_two_autopilots_are_told_of_and_neither_is_asked(make, tmp_path):
    rig = rig_of(make, tmp_path)
    other = rig.add(make(), 2)
    rig.run(5.0)
    rig.scene.entangle(1)
    rig.run(40.0)
    assert rig.asked == []
    assert [one for one in other.notes.commands if one.command in set(Command)] == []
    assert any("has several autopilots: 1, 2" in one.text for one in rig.findings)


@both
def test_of_two_autopilots_the_configured_one_is_asked(make, tmp_path):
    rig = rig_of(make, tmp_path, HOLD + NO_DELAY, mavlink="system_id = 1")
    other = rig.add(make(), 2)
    rig.run(5.0)
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    assert [one for one in other.notes.commands if one.result is not None] == []


@both
def test_our_own_frames_coming_back_are_nobody_elses(make, tmp_path):
    rig = rig_of(make, tmp_path, HOLD + NO_DELAY)
    rig.echo = True
    rig.scene.entangle(1)
    assert rig.run(10.0, lambda: rig.said("Hold done for T1"))
    rig.run(20.0)
    assert not any("192" in one.text for one in rig.findings)
    assert len(rig.asked) == 1


@both
def test_another_program_with_our_ids_is_told_of(make, tmp_path):
    rig = rig_of(make, tmp_path, "")
    for _ in range(5):
        rig.autopilot.relay(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), 192)
        rig.run(1.0)
    assert any(one.detector == "link" and "192" in one.text for one in rig.findings)


def acknowledgements(rig: VirtualRig) -> list[CommandAck]:
    return [one.message for one in rig.sent if isinstance(one.message, CommandAck)]


@both
@pytest.mark.parametrize("conditions", [IDEAL, DISORDERLY], ids=["ideal", "disorderly"])
def test_operators_are_answered(make, conditions, tmp_path):
    rig = rig_of(make, tmp_path, "", conditions, seed=1)
    rig.scene.entangle(1)
    assert rig.run(5.0, lambda: rig.said("T1 entangled"))
    for act in OperatorAct:
        rig.operator(act, 1.0)
        rig.run(3.0)
    answers = {(one.command, one.result, one.target_system, one.target_component) for one in acknowledgements(rig)}
    assert answers == {(int(act), 0, 255, 190) for act in OperatorAct}


@both
def test_an_operator_of_what_is_not_there_is_denied(make, tmp_path):
    rig = rig_of(make, tmp_path, "")
    rig.operator(OperatorAct.ACKNOWLEDGE, 77.0)
    rig.operator(OperatorAct.ACCEPT, float("nan"))
    rig.operator(400, 0.0)  # not for a companion to do
    rig.run(2.0)
    assert [(one.command, one.result) for one in acknowledgements(rig)] == [(31010, 2), (31011, 2), (400, 3)]
    assert rig.commander.armed


@both
def test_scores_are_told_as_named_values(make, tmp_path):
    rig = rig_of(make, tmp_path, "")
    rig.scene.entangle(1)
    rig.run(5.0)
    values = [one.message for one in rig.sent if isinstance(one.message, NamedValue)]
    told = {value.name: value.value for value in values}
    assert told["T1"] > 1.0 > told["T2"] >= 0.0
    assert rig.autopilot.notes.counts["NAMED_VALUE_FLOAT"] > 0

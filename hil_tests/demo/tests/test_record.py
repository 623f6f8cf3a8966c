"""The summary of a demonstration, and what is shown and drawn of it, from made-up histories."""

from __future__ import annotations

import io
from dataclasses import replace
from math import inf, isnan, nan, radians

import pytest
from rich.console import Console

from detectors.navigation import ImuSample, NavigationState, NavigationVerdict, Sensor, SensorVerdict
from detectors.speed.sample import PoseSample, SpeedVerdict
from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from hil_tests.demo.display import LiveDisplay, PlainDisplay, View, flow_words
from hil_tests.demo.navigation_plot import NavigationStory, draw_navigation
from hil_tests.demo.plot import draw
from hil_tests.demo.record import (
    DVL,
    SPEED,
    Judged,
    JudgedNavigation,
    JudgedSpeed,
    Recording,
    Trouble,
    Truth,
    happenings,
    names,
)
from hil_tests.demo.speed_plot import SpeedStory, draw_speed
from hil_tests.demo.summary import summarize, summary_lines
from hil_tests.demo.tracks import Track, track
from hil_tests.rig.commands import Result
from hil_tests.rig.embedded import Moment
from hil_tests.rig.geodesy import degrees_e7
from hil_tests.rig.notes import Notes, ReceivedCommand, ReceivedHeartbeat, ReceivedText
from hil_tests.rig.vehicle import Motion

START_S = 1000.0
WEEDS = Trouble("thruster 3", "weeds catch thruster 3", "weeds in thruster 3 show", onset_s=1020.0, shown_s=1020.4)
NET = Trouble(SPEED, "a net catches", "the net shows", onset_s=1022.0, shown_s=1022.5)
DRIFT = Trouble(DVL, "the DVL begins to drift", "the DVL drifts", onset_s=1023.0, shown_s=1023.0)
TRUTH = Truth((WEEDS,), ((1015.0, "a current sets in"),))
BOTH = Truth((WEEDS, NET))
ALL = Truth((WEEDS, NET, DRIFT))
TOLD = ReceivedText(1020.9, 192, 2, "T3 entangled? 812 rpm, want 1043 (-22%)")
SLOW = ReceivedText(1026.9, 192, 4, "Speed 0.52 m/s, want 0.9-1.2 (flow 0.4 @ 085)")
DRIFTS = ReceivedText(1028.0, 192, 4, "DVL drifting 0.04 m/s/s, isolated")
HELD = ReceivedCommand(1020.91, 192, 176, (1.0, 16.0, 0.0, 0.0, 0.0, 0.0, 0.0), Result.ACCEPTED)
ASKED = ReceivedCommand(1001.0, 192, 511, (30.0, 5e4, 0.0, 0.0, 0.0, 0.0, 0.0), Result.ACCEPTED)


def judged(time_s, level) -> Judged:
    known = level is not Level.UNKNOWN
    speed_rpm = 1000.0 if level is not Level.FAULT else 780.0
    verdict = ThrusterVerdict(
        time_s=time_s,
        level=level,
        score=1.5 if level is Level.FAULT else 0.1,
        residual_rpm=speed_rpm - 1000.0 if known else nan,
        predicted_rpm=1000.0 if known else nan,
        threshold_rpm=60.0 if known else nan,
        order=3,
        window=100,
        delay=2,
        lag_s=0.08,
        refitted=False,
        kind=FaultKind.ENTANGLED if level is Level.FAULT else FaultKind.NONE,
        reason="learning" if level is Level.UNKNOWN else "",
    )
    return Judged(ThrusterSample(time_s, 0.3, speed_rpm, 15.5, 2.0), verdict)


def judged_speed(time_s, level) -> JudgedSpeed:
    known = level is not Level.UNKNOWN
    verdict = SpeedVerdict(
        time_s=time_s,
        level=level,
        score=0.5,
        speed_mps=0.52 if level is Level.FAULT else 1.05,
        speed_error_mps=0.05 if known else inf,
        flow_mps=(0.035, 0.398),
        flag=2 if not known else 1 if level is Level.FAULT else 0,
        speed_min_mps=0.9 if known else nan,
        speed_max_mps=1.2 if known else nan,
        reason="" if level is Level.NORMAL else "slow" if known else "learning",
    )
    return JudgedSpeed(PoseSample(time_s, 1.0, 2.0, 0.5), verdict)


def judged_navigation(time_s, level, sensor=Sensor.DVL) -> JudgedNavigation:
    faulty = level is Level.FAULT
    state = NavigationState(time_s, 1.1, 0.18, 5.0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    verdict = NavigationVerdict(
        time_s=time_s,
        level=level,
        score=3.0 if faulty else 0.2,
        state=state,
        innovation=(0.21, -0.01, 0.02, 0.003) if faulty else (nan,) * 4,
        statistics={"ratio": 3.0, "chi_square": 0.8} if faulty else {"ratio": 0.2},
        isolated=(sensor,) if faulty else (),
        sensors=(SensorVerdict(sensor, level, isolated=faulty), SensorVerdict(Sensor.DEPTH, Level.NORMAL)),
    )
    return JudgedNavigation(ImuSample(time_s, (0.0, 0.0, -9.8), (0.0, 0.0, 0.0)), verdict)


def navigated(kept: Recording, faulty_from_s=1027.9, sensor=Sensor.DVL) -> Recording:
    for step in range(300):
        time_s = START_S + 0.1 * step
        level = Level.UNKNOWN if time_s < 1005.0 else Level.FAULT if time_s >= faulty_from_s else Level.NORMAL
        kept.add_navigation(judged_navigation(time_s, level, sensor), time_s + 0.05)
    return kept


def recording(fault_from_s=1020.8, other_fault_s=None, slow_from_s=1026.8) -> Recording:
    kept = Recording()
    for step in range(300):
        time_s = START_S + 0.1 * step
        level = Level.UNKNOWN if time_s < 1012.0 else Level.FAULT if time_s >= fault_from_s else Level.NORMAL
        kept.add(3, judged(time_s, level), time_s + 0.05)
        other = Level.FAULT if other_fault_s and time_s >= other_fault_s else Level.NORMAL
        kept.add(5, judged(time_s, other), time_s + (0.2 if step == 7 else 0.05))
        slow = Level.FAULT if time_s >= slow_from_s else Level.NORMAL
        kept.add_speed(judged_speed(time_s, Level.UNKNOWN if time_s < 1012.0 else slow), time_s + 0.05)
    return kept


def notes(*texts, commands=(HELD,)) -> Notes:
    beats = [ReceivedHeartbeat(1010.0, 192, 18, 4), ReceivedHeartbeat(1021.0, 192, 18, 5)]
    return Notes(texts=list(texts), heartbeats=beats, commands=[ASKED, *commands])


def summary(kept=None, noted=None, truth=TRUTH):
    counts = {"CAN frames": 41000, "drops": 0}
    kept = kept or recording(slow_from_s=inf)
    return summarize(kept, noted or notes(TOLD), truth, lasted_s=30.0, counts=counts, load=0.5)


def test_a_good_run_passes():
    good = summary()
    assert good.passed
    [weeds] = good.found
    assert weeds.latency_s == pytest.approx(0.5)
    assert weeds.verdict_s == pytest.approx(1020.8)
    assert good.command_s == 1020.91


def test_both_acts_are_judged():
    good = summary(kept=recording(), noted=notes(TOLD, SLOW), truth=BOTH)
    assert good.passed
    assert [found.latency_s for found in good.found] == pytest.approx([0.5, 4.4])
    assert good.found[1].verdict_s == pytest.approx(1026.8)
    untold = summary(kept=recording(), noted=notes(TOLD), truth=BOTH)
    assert not untold.passed
    assert untold.false_alarms == ()


def test_the_dvl_is_judged_too():
    good = summary(kept=navigated(recording()), noted=notes(TOLD, SLOW, DRIFTS), truth=ALL)
    assert good.passed
    assert good.found[2].latency_s == pytest.approx(5.0)
    assert good.found[2].verdict_s == pytest.approx(1027.9)
    untold = summary(kept=navigated(recording()), noted=notes(TOLD, SLOW), truth=ALL)
    assert not untold.passed
    early = summary(kept=navigated(recording(), faulty_from_s=1022.9), noted=notes(TOLD, SLOW), truth=ALL)
    assert early.false_alarms == ("FAULT of dvl, not told",)
    other = summary(kept=navigated(recording(), sensor=Sensor.GYROSCOPE), noted=notes(TOLD, SLOW, DRIFTS), truth=ALL)
    assert other.false_alarms == ("FAULT of gyroscope, not told",)


@pytest.mark.parametrize(
    ("text", "subjects"),
    [
        ("DVL drifting 0.04 m/s/s, isolated", {DVL}),
        ("Nav: DVL or accelerometer off", {DVL, "accelerometer"}),
        ("Depth off by 2.1 m, isolated", {"depth sensor"}),
        ("Gyro noisy, isolated", {"gyroscope"}),
        ("Speed 0.52 m/s, want 0.9-1.2 (flow 0.4 @ 085)", {SPEED}),
        ("T13 worn or fouled", {"thruster 13"}),
    ],
)
def test_a_text_speaks_of_its_subjects(text, subjects):
    known = ("thruster 1", "thruster 13", *recording().subjects())
    assert {subject for subject in known if names(text, subject)} == subjects


def test_a_pilot_who_is_not_told_fails_it():
    silent = summary(noted=notes(commands=()))
    assert not silent.passed
    assert isnan(silent.found[0].text_s)
    assert isnan(silent.command_s)


@pytest.mark.parametrize(
    "text",
    [
        ReceivedText(1019.0, 192, 2, "T3 entangled? 812 rpm, want 1043 (-22%)"),
        ReceivedText(1025.0, 192, 2, "T5 entangled? 812 rpm, want 1043 (-22%)"),
        ReceivedText(1025.0, 192, 4, "T13 worn or fouled"),
        ReceivedText(1025.0, 192, 4, "can0 silent"),
        ReceivedText(1021.0, 192, 4, "Speed 0.52 m/s, want 0.9-1.2 (flow 0.4 @ 085)"),
    ],
)
def test_an_alarm_about_what_is_not_there_fails_it(text):
    wrong = summary(noted=notes(TOLD, text, SLOW), truth=BOTH)
    assert not wrong.passed
    assert wrong.false_alarms == (f'STATUSTEXT "{text.text}"',)


def test_a_notice_is_no_alarm():
    assert summary(noted=notes(TOLD, ReceivedText(1005.0, 192, 6, "thruster gateway ready"))).passed


def test_a_false_verdict_fails_it_even_if_nothing_was_said():
    assert summary(kept=recording(other_fault_s=1015.0, slow_from_s=inf)).false_alarms == (
        "FAULT of thruster 5, not told",
    )
    assert summary(kept=recording(), truth=TRUTH).false_alarms == ("FAULT of speed, not told",)
    early = summary(kept=recording(fault_from_s=1019.0, slow_from_s=inf), noted=notes())
    assert early.false_alarms == ("FAULT of thruster 3, not told",)


def test_happenings_are_in_order_and_leave_the_streams_out():
    found = happenings(notes(TOLD), TRUTH, now_s=1022.0)
    assert [one.time_s for one in found] == [1015.0, 1020.4, 1020.9, 1020.91, 1021.0]
    assert [one.alarm for one in found] == [False, False, True, True, True]
    assert found[0].text == "(rig) a current sets in"
    assert found[3].text == "COMMAND_LONG DO_SET_MODE POSHOLD: answered ACCEPTED"
    assert found[4].text == "HEARTBEAT of component 192: CRITICAL"


def test_what_is_to_come_has_not_happened_yet():
    assert happenings(Notes(), replace(TRUTH, troubles=()), now_s=1014.9) == []


def view(since_s, found=()) -> View:
    kept = recording()
    newest = kept.latest(), kept.speed[-1], judged_navigation(1029.0, Level.FAULT)
    return View(since_s, 30.0, START_S, "MANUAL", 15.6, *newest, found)


def shown(display_of, terminal) -> str:
    console = Console(file=io.StringIO(), force_terminal=terminal, width=110)
    found = happenings(notes(TOLD), TRUTH, now_s=1025.0)
    with display_of(console) as display:
        display.show(view(1.0))
        display.show(view(25.0, found))
        display.show(view(25.2, found))
    return console.file.getvalue()


def test_plain_text_says_everything_once():
    text = shown(PlainDisplay, terminal=False)
    assert text.count("T3 entangled? 812 rpm, want 1043 (-22%)") == 1
    assert "  20.90 s  STATUSTEXT" in text
    assert "T3 FAULT  T5 NORMAL  speed FAULT 0.52 m/s of 0.90-1.20, flow 0.40 m/s @ 085" in text
    assert "DVL FAULT off by +0.21 -0.01 m/s, evidence 3.00, isolated: dvl" in text
    assert "\x1b" not in text


def test_the_live_table_shows_the_thruster_and_the_text():
    text = shown(LiveDisplay, terminal=True)
    assert "FAULT entangled" in text
    assert "T3 entangled? 812 rpm" in text
    assert "-220" in text
    assert "FAULT slow" in text
    assert "+0.21 -0.01" in text


@pytest.mark.parametrize(
    ("flow_mps", "words"),
    [
        ((0.3, 0.0), "0.30 m/s @ 000"),
        ((0.3, -1e-6), "0.30 m/s @ 000"),
        ((-0.3, -0.4), "0.50 m/s @ 233"),
        ((0.0, 0.2, 0.1), "0.20 m/s @ 090"),
        ((nan, nan), "-"),
    ],
)
def test_a_flow_is_said_by_its_speed_and_set(flow_mps, words):
    assert flow_words(flow_mps) == words


def test_the_summary_is_said_in_words():
    lines = dict(summary_lines(summary(), START_S))
    assert lines["weeds catch thruster 3"] == "at 20.00 s"
    assert lines["thruster 3: from first sign to STATUSTEXT"] == "0.50 s"
    assert lines["false alarms"] == "none"
    assert lines["result"] == "passed"
    assert lines["judged at most"] == "0.20 s late"
    assert lines["CAN frames"] == "41000"
    assert "no time for" not in lines
    assert "position error since the drift set in" not in lines


def test_the_summary_tells_where_the_drift_would_have_led():
    drifted = replace(summary(truth=Truth((DRIFT,)), noted=notes(DRIFTS)), position_errors_m=(1.24, 9.66))
    lines = dict(summary_lines(drifted, START_S))
    assert lines["position error since the drift set in"] == "1.2 m; 9.7 m without isolation"
    assert lines["the DVL drifts"] == "at 23.00 s"
    assert "the DVL begins to drift" not in lines  # it shows at once


def test_the_summary_says_what_was_left_out():
    short = replace(summary(), left_out=("a current", "a net"))
    assert dict(summary_lines(short, START_S))["no time for"] == "a current; a net"


@pytest.mark.parametrize(
    ("history", "trouble"), [(recording().judged[3], WEEDS), ([], replace(WEEDS, onset_s=1050.0, shown_s=nan))]
)
def test_the_plot_is_a_picture(tmp_path, history, trouble):
    [found] = summary(truth=Truth((trouble,))).found
    draw(tmp_path / "demo.png", history, found, start_s=START_S, lasted_s=30.0, freed_s=28.0)
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")


def moments() -> list[Moment]:
    return [
        Moment(START_S + 0.1 * step, Motion(0.1 * step, 0.05 * step, forward_mps=1.0, water_mps=(0.1, 0.4, 0.0)))
        for step in range(300)
    ]


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("history", [recording().speed, []])
def test_the_speed_plot_is_a_picture(tmp_path, history, told):
    found = summary(noted=notes(TOLD, *([SLOW] if told else [])), truth=BOTH).found[1]
    draw_speed(tmp_path / "speed.png", SpeedStory(moments(), history, found, START_S, 30.0, current_s=15.0))
    assert (tmp_path / "speed.png").read_bytes().startswith(b"\x89PNG")


def test_the_speed_plot_of_a_short_run_is_a_picture_too(tmp_path):
    draw_speed(tmp_path / "speed.png", SpeedStory([], [], None, START_S, 5.0))
    assert (tmp_path / "speed.png").read_bytes().startswith(b"\x89PNG")


def straight(east_mps) -> Track:
    """Along the true track of `moments`, but faster to the east."""
    states = []
    for step in range(290):
        latitude_e7, longitude_e7 = degrees_e7(0.1 * step, 0.1 * east_mps * step)
        place = radians(1e-7 * latitude_e7), radians(1e-7 * longitude_e7)
        states.append(NavigationState(START_S + 0.1 * step, *place, 5.0, (1.0, east_mps, 0.0), (0.0, 0.0, 0.0)))
    return track(states)


def test_a_track_is_off_by_its_distance_from_the_truth():
    off = straight(0.6)
    assert len(off.time_s) == pytest.approx(290, abs=2)
    assert off.errors_m(moments())[[0, 200]] == pytest.approx([0.0, 2.0], abs=0.05)
    anchored = off.anchored(moments(), START_S + 10.0)
    assert anchored.errors_m(moments())[[100, 200]] == pytest.approx([0.0, 1.0], abs=0.05)


def test_a_track_has_ten_places_a_second_at_most():
    states = [NavigationState(0.01 * step, 1.1, 0.18, 5.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) for step in range(1001)]
    assert len(track(states).time_s) == 101
    assert len(track([]).time_s) == 0


@pytest.mark.parametrize("told", [True, False])
def test_the_navigation_plot_is_a_picture(tmp_path, told):
    texts = [TOLD, SLOW, *([DRIFTS] if told else [])]
    found = summary(kept=navigated(recording()), noted=notes(*texts), truth=ALL).found[2]
    history = navigated(recording()).navigation
    story = NavigationStory(moments(), history, found, START_S, 30.0, straight(0.5), straight(0.7))
    draw_navigation(tmp_path / "navigation.png", story)
    assert (tmp_path / "navigation.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("history", [[], navigated(recording(), faulty_from_s=inf).navigation])
def test_without_a_fault_or_without_anything_it_is_a_picture_too(tmp_path, history):
    nothing = track([])
    true = moments() if history else []
    story = NavigationStory(true, history, None, START_S, 30.0, straight(0.5) if history else nothing, nothing)
    draw_navigation(tmp_path / "navigation.png", story)
    assert (tmp_path / "navigation.png").read_bytes().startswith(b"\x89PNG")

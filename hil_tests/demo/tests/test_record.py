"""The summary of a demonstration, and what is shown and drawn of it, from made-up histories."""

from __future__ import annotations

import io
from math import isnan, nan

import pytest
from rich.console import Console

from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from hil_tests.demo.display import LiveDisplay, PlainDisplay, View, summary_lines
from hil_tests.demo.plot import draw
from hil_tests.demo.record import Judged, Recording, Truth, happenings, summarize
from hil_tests.rig.ardusub import Result
from hil_tests.rig.autopilot import Notes, ReceivedCommand, ReceivedHeartbeat, ReceivedText

START_S = 1000.0
TRUTH = Truth(thruster=3, onset_s=1020.0, shown_s=1020.4)
TOLD = ReceivedText(1020.9, 192, 2, "T3 entangled? 812 rpm, want 1043 (-22%)")
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


def recording(fault_from_s=1020.8, other_fault_s=None) -> Recording:
    kept = Recording()
    for step in range(300):
        time_s = START_S + 0.1 * step
        level = Level.UNKNOWN if time_s < 1012.0 else Level.FAULT if time_s >= fault_from_s else Level.NORMAL
        kept.add(3, judged(time_s, level), time_s + 0.05)
        other = Level.FAULT if other_fault_s and time_s >= other_fault_s else Level.NORMAL
        kept.add(5, judged(time_s, other), time_s + (0.2 if step == 7 else 0.05))
    return kept


def notes(*texts, commands=(HELD,)) -> Notes:
    beats = [ReceivedHeartbeat(1010.0, 192, 18, 4), ReceivedHeartbeat(1021.0, 192, 18, 5)]
    return Notes(texts=list(texts), heartbeats=beats, commands=[ASKED, *commands])


def summary(kept=None, noted=None, truth=TRUTH):
    counts = {"CAN frames": 41000, "drops": 0}
    return summarize(kept or recording(), noted or notes(TOLD), truth, lasted_s=30.0, counts=counts, load=0.5)


def test_a_good_run_passes():
    good = summary()
    assert good.passed
    assert good.latency_s == pytest.approx(0.5)
    assert good.verdict_s == pytest.approx(1020.8)
    assert good.command_s == 1020.91


def test_a_pilot_who_is_not_told_fails_it():
    silent = summary(noted=notes(commands=()))
    assert not silent.passed
    assert isnan(silent.text_s)
    assert isnan(silent.command_s)


@pytest.mark.parametrize(
    "text",
    [
        ReceivedText(1019.0, 192, 2, "T3 entangled? 812 rpm, want 1043 (-22%)"),
        ReceivedText(1025.0, 192, 2, "T5 entangled? 812 rpm, want 1043 (-22%)"),
        ReceivedText(1025.0, 192, 4, "T13 worn or fouled"),
        ReceivedText(1025.0, 192, 4, "can0 silent"),
    ],
)
def test_an_alarm_about_what_is_not_there_fails_it(text):
    wrong = summary(noted=notes(TOLD, text))
    assert not wrong.passed
    assert wrong.false_alarms == (f'STATUSTEXT "{text.text}"',)


def test_a_notice_is_no_alarm():
    assert summary(noted=notes(TOLD, ReceivedText(1005.0, 192, 6, "thruster gateway ready"))).passed


def test_a_false_verdict_fails_it_even_if_nothing_was_said():
    assert summary(kept=recording(other_fault_s=1015.0)).false_alarms == ("FAULT of thruster 5, not told",)
    early = summary(kept=recording(fault_from_s=1019.0), noted=notes())
    assert early.false_alarms == ("FAULT of thruster 3, not told",)


def test_happenings_are_in_order_and_leave_the_streams_out():
    found = happenings(notes(TOLD), TRUTH)
    assert [one.time_s for one in found] == [1020.4, 1020.9, 1020.91, 1021.0]
    assert [one.alarm for one in found] == [False, True, True, True]
    assert found[2].text == "COMMAND_LONG DO_SET_MODE POSHOLD: answered ACCEPTED"
    assert found[3].text == "HEARTBEAT of component 192: CRITICAL"


def view(since_s, found=()) -> View:
    return View(since_s, 30.0, START_S, "MANUAL", 15.6, recording().latest(), found)


def shown(display_of, terminal) -> str:
    console = Console(file=io.StringIO(), force_terminal=terminal, width=110)
    found = happenings(notes(TOLD), TRUTH)
    with display_of(console) as display:
        display.show(view(1.0))
        display.show(view(25.0, found))
        display.show(view(25.2, found))
    return console.file.getvalue()


def test_plain_text_says_everything_once():
    text = shown(PlainDisplay, terminal=False)
    assert text.count("T3 entangled? 812 rpm, want 1043 (-22%)") == 1
    assert "  20.90 s  STATUSTEXT" in text
    assert "T3 FAULT  T5 NORMAL" in text
    assert "\x1b" not in text


def test_the_live_table_shows_the_thruster_and_the_text():
    text = shown(LiveDisplay, terminal=True)
    assert "FAULT entangled" in text
    assert "T3 entangled? 812 rpm" in text
    assert "-220" in text


def test_the_summary_is_said_in_words():
    lines = dict(summary_lines(summary(), START_S))
    assert lines["from RPM to STATUSTEXT"] == "0.50 s"
    assert lines["false alarms"] == "none"
    assert lines["result"] == "passed"
    assert lines["judged at most"] == "0.20 s late"
    assert lines["CAN frames"] == "41000"


@pytest.mark.parametrize(("kept", "truth"), [(recording(), TRUTH), (Recording(), Truth(3, 1050.0, nan))])
def test_the_plot_is_a_picture(tmp_path, kept, truth):
    draw(tmp_path / "demo.png", kept, summary(kept=kept, truth=truth), START_S)
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")

"""From a telemetry to lines: the worst first, nothing wider than the terminal, nothing told by colour alone."""

from dataclasses import replace
from math import nan

import pytest

from detectors.verdict import Level
from gateway.severity import Severity
from gateway.telemetry import LinkTelemetry, Said, SubjectTelemetry
from gateway.watch.palette import COLOURED, PLAIN
from gateway.watch.plain import Changes
from gateway.watch.rates import Rates
from gateway.watch.rows import share, subjects, values_words
from gateway.watch.source import Look
from gateway.watch.tests.scene import BEGIN_S, ENTANGLED, telemetry, thruster, vehicle
from gateway.watch.view import Frame, headline, link_lines, subject_lines, text_lines
from gateway.watch.words import ago, clock, listed, short

WIDE, SMALL, NARROW = (Frame(width, COLOURED) for width in (120, 80, 45))


def plain(lines) -> list[str]:
    return [line.plain for line in lines]


def test_subjects_are_worst_first_and_those_with_nothing_to_show_are_together():
    found = subjects(telemetry(SubjectTelemetry("autopilot", Level.SUSPECT, nan, text="silent")).subjects)
    assert [row.name for row in found.rows] == ["T3", "autopilot", "T1", "T2", "vehicle"]
    assert found.others == {Level.UNKNOWN: "DVL", Level.NORMAL: "link can0, T1-T3 esc"}
    assert found.rows[0].text == ENTANGLED


def test_the_text_of_what_is_well_again_is_not_shown():
    (row,) = subjects([thruster(1, text="T1 fault cleared")]).rows
    assert row.text == ""


@pytest.mark.parametrize(
    ("one", "expected"),
    [
        (thruster(1, residual_rpm=-50.0), -0.5),
        (vehicle(), 0.5),
        (replace(vehicle(), values={**vehicle().values, "speed_mps": 0.6}), -2.0),
        (SubjectTelemetry("dvl", Level.NORMAL, 0.7, {"isolated": 0.0}), 0.7),
        (SubjectTelemetry("thruster 1", Level.NORMAL, 0.7, {"residual_rpm": 5.0, "threshold_rpm": 0.0}), 0.7),
        (SubjectTelemetry("vehicle", Level.NORMAL, nan, {"speed_mps": 1.0}), nan),
    ],
)
def test_how_far_off_is_a_share_of_the_threshold_with_its_sign(one, expected):
    assert share(one) == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, ()),
        ({"command": 0.5, "speed_rpm": 900.0}, (" +50 %    900 of     - rpm",)),
        ({"speed_rpm": -900.0, "predicted_rpm": -0.2, "wear": -0.12}, ("   - %   -900 of     0 rpm", "worn -12 %")),
        ({"speed_mps": 1.0, "wear": 0.01}, ("1.00 m/s",)),
        ({"flow_north_mps": 0.0, "flow_east_mps": -0.25}, ("flow 0.25 @ 270",)),
        ({"innovation_forward_mps": -0.001, "innovation_right_mps": 0.2}, ("off +0.00 +0.20 m/s",)),
        ({"isolated": 1.0}, ("not used",)),
        ({"innovation_depth_m": -0.3, "depth_m": 12.34}, ("off -0.30 m", "depth 12.3 m")),
        ({"heading_deg": 359.7}, ("heading 000",)),
    ],
)
def test_values_have_units_and_what_is_not_known_is_a_dash(values, words):
    assert values_words(values) == words


@pytest.mark.parametrize("frame", [WIDE, SMALL, NARROW])
def test_no_line_is_wider_than_the_terminal(frame):
    lines = [
        *subject_lines(telemetry(), frame),
        *link_lines(telemetry(), {"can0": 12345.0}, frame),
        *text_lines(telemetry(), frame),
    ]
    assert max(line.cell_len for line in lines) <= frame.width


def test_what_is_wrong_is_on_one_line_where_there_is_room_and_on_two_where_not():
    wide, small = plain(subject_lines(telemetry(), WIDE)), plain(subject_lines(telemetry(), SMALL))
    assert wide[1].startswith("FAULT   T3 ") and wide[1].endswith(ENTANGLED)
    assert "743 of  1060 rpm" in small[1] and small[2].strip() == ENTANGLED
    assert "3.17" in small[1]


def test_what_is_well_or_not_judged_has_one_line_with_what_there_is_room_for():
    learning = replace(thruster(4), level=Level.UNKNOWN, text="learning")
    lines = plain(subject_lines(telemetry(learning, fault=False), Frame(64, COLOURED)))
    assert [line.split()[1] for line in lines[1:6]] == ["T4", "T1", "T2", "T3", "vehicle"]
    assert "learning" in lines[1] and lines[2].endswith("1040 of  1060 rpm")
    assert lines[5].endswith("1.10 of 0.80-1.20 m/s")


def test_marks_of_the_bars_stand_below_their_words():
    heading, *rows = plain(subject_lines(telemetry(fault=False), SMALL))
    assert [heading.index(words) for words in ("0", "+1")] == [rows[0].index("│"), rows[0].rindex("┊")]
    assert heading.index("-1") + 1 == rows[0].index("┊")


def test_a_narrow_terminal_has_no_bars():
    assert not any("│" in line for line in plain(subject_lines(telemetry(), NARROW)))


def test_without_colour_no_style_has_one_and_the_words_are_the_same():
    coloured, bare = subject_lines(telemetry(), SMALL), subject_lines(telemetry(), Frame(80, PLAIN))
    assert plain(coloured) == plain(bare)
    styles = {word for line in bare for span in line.spans for word in str(span.style).split()}
    assert styles <= {"bold", "dim", "reverse"} and "reverse" in styles


def test_nothing_heard_is_said():
    assert "nothing was heard yet" in plain(subject_lines(replace(telemetry(), subjects=()), SMALL))[1]
    assert plain(text_lines(replace(telemetry(), texts=()), SMALL)) == ["texts to the pilot", "none"]


def test_links_tell_rate_load_drops_and_why_they_are_down():
    down = LinkTelemetry("mavlink", False, "no heartbeat", 7, {}, nan)
    links = replace(telemetry(), links=(telemetry().links[0], down))
    lines = plain(link_lines(links, {"can0": 1234.4}, SMALL))
    assert lines == [
        "can0     up      1234 /s  load  42 %  dropped: overrun 3",
        "mavlink  DOWN       - /s  no heartbeat",
        "dropped at pipeline: late 2",
        "recording to dive_001.mcap, 12.3 MB",
    ]


def test_nothing_from_a_log_commands_the_terminal():
    nasty = "\x1b]0;owned\x07\x9b2J\r"
    told = replace(
        telemetry(thruster(4, Level.FAULT, text=nasty)),
        vehicle=nasty,
        links=(LinkTelemetry("can0", False, nasty, 1, {nasty: 2}, nan),),
        texts=(Said(1.0, Severity.INFO, nasty),),
        recording=nasty,
    )
    shown = [*subject_lines(told, WIDE), *link_lines(told, {}, WIDE), *text_lines(told, WIDE)]
    lines = [*plain(shown), headline(told), *Changes().take(Look(told, nasty))]
    assert all(line.isprintable() for line in lines)
    assert sum("]0;owned" in line for line in lines) == 12


def test_texts_are_newest_first_with_their_age():
    lines = plain(text_lines(telemetry(), SMALL))
    assert lines[1:] == [f"   3 s ago  CRITICAL: {ENTANGLED}", "  60 s ago  INFO: Watching 3 thrusters"]


def test_the_headline_tells_what_was_found_and_how_late_the_judging_is():
    assert headline(telemetry()) == "Test vehicle  0:01:00  judging 0.2 s behind  found: FAULT 1"
    assert headline(replace(telemetry(fault=False), behind_s=0.0)) == "Test vehicle  0:01:00  found: nothing"


def test_rates_are_of_the_last_seconds_and_begin_anew_with_the_gateway():
    rates = Rates()
    assert rates.take(telemetry(since_s=0.0)) == {}
    for tenth in range(1, 101):
        told = rates.take(telemetry(since_s=tenth / 10.0))
    assert told["can0"] == pytest.approx(100.0) and told["mavlink"] == 0.0
    assert rates.take(telemetry(since_s=10.0))["can0"] == pytest.approx(100.0)  # the same once more
    stopped = telemetry(since_s=14.0, links=telemetry(since_s=10.0).links)
    assert rates.take(stopped)["can0"] < 60.0
    assert rates.take(telemetry(since_s=1.0, time_s=BEGIN_S + 15.0)) == {}


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.4, "0 s"), (119.4, "119 s"), (120.0, "2 min"), (7300.0, "2 h"), (-3.0, "0 s")]
)
def test_ages(seconds, words):
    assert ago(seconds) == words


def test_times_and_names():
    assert [clock(seconds) for seconds in (-1.0, 59.9, 3723.0)] == ["0:00:00", "0:00:59", "1:02:03"]
    assert [short(one) for one in ("thruster 12", "thruster 3 esc", "thruster", "depth sensor", "link can0")] == [
        "T12",
        "T3 esc",
        "thruster",
        "depth",
        "link can0",
    ]
    assert listed([f"thruster {n} esc" for n in (1, 2, 3, 5, 7, 8)] + ["dvl"]) == "T1-T3 T5 T7-T8 esc, DVL"

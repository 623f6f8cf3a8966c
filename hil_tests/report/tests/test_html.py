"""The page of a run: it needs nothing else, tells everything without a script, and its plots are sound."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from gateway.plotting.figure import Band, Bar, Figure, Points
from gateway.plotting.plotly_drawing import to_plotly
from gateway.report.tests.browser import BROWSER, NO_BROWSER, told_by_browser
from gateway.report.tests.page_parts import LOADS, PageParts
from hil_tests.report.expectations import checks
from hil_tests.report.figures import figures
from hil_tests.report.html import report_html, write_report
from hil_tests.report.outcome import Outcome
from hil_tests.report.tests.dive import FOUND_S, LASTED_S, dive
from hil_tests.report.tests.plays import ENTANGLED, finding, play

WRITTEN = datetime(2026, 11, 22, 15, 4, 5, tzinfo=UTC)
WANTED = {"finding": {"subject": "thruster 3", "level": "FAULT"}, "within_s": 2.0}


def page(*outcomes: Outcome) -> PageParts:
    return PageParts(report_html(outcomes, WRITTEN))


def titles(outcome: Outcome) -> list[str]:
    return [one.title for one in figures(outcome, checks(outcome))]


def figure(outcome: Outcome, title: str) -> Figure:
    (found,) = [one for one in figures(outcome, ()) if one.title == title]
    return found


def plot(outcome: Outcome, title: str) -> dict[str, Any]:
    return to_plotly(figure(outcome, title))


def line(drawn: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = [one for one in drawn["data"] if one["name"] == name]
    return dict(found)


def of_row(drawn: Figure, name: str) -> list[Bar]:
    (rows,) = drawn.panels
    return [one for one in rows.marks if isinstance(one, Bar) and rows.rows[one.row] == name]


def test_it_needs_no_network() -> None:
    seen = page(dive(), dive(simulated=False))
    assert "link" not in {tag for tag, _ in seen.tags}
    for tag, attributes in seen.tags:
        assert not LOADS & set(attributes), f"{tag} {attributes}"
        assert not any("://" in (value or "") for value in attributes.values()), f"{tag} {attributes}"
    style = "".join(seen.styles)
    assert "url(" not in style
    assert "@import" not in style
    policies = [one["content"] for tag, one in seen.tags if one.get("http-equiv") == "Content-Security-Policy"]
    assert policies
    assert "default-src 'none'" in (policies[0] or "")


def test_without_a_script_everything_is_told() -> None:
    outcome = dive(folder=Path("out/hil/weeds"))
    words = page(outcome, play(expect=(WANTED,))).words
    told = [one.text for one in outcome.findings] + [one.text for one in outcome.texts]
    told += [part for one in checks(outcome) for part in (one.expected, one.seen)]
    told += ["1 of 2 scenarios passed", "thruster 3 entangled", "share 0.3", "frames 24000", "nothing was changed"]
    told += ["hold (DO_SET_MODE 2), answered ACCEPTED", "ALT_HOLD", "received: can0 24000", "out/hil/weeds", "2.3 s"]
    told += ["gateway hil play scenarios/weeds.yaml", "never: nothing of thruster 3 was found", "seed 0", "40×"]
    for one in told:
        assert " ".join(one.split()) in words, one


def test_what_failed_comes_first() -> None:
    words = page(dive(), play(expect=(WANTED,)), dive()).words
    assert words.startswith("2 of 3 scenarios passed 2 of 3 scenarios passed")
    assert words.count("✗") == 1
    assert words.index("FAILED weeds") < words.index("passed weeds")


def test_ids_are_of_one_thing_each() -> None:
    ids = page(dive(), dive(), dive()).ids
    assert len(ids) == len(set(ids))


def test_names_are_no_markup() -> None:
    bad = "<script>alert(1)</script><img src=x>"
    outcome = play(
        expect=({"statustext": "<b>"},), findings=[finding(1.0, text=bad)], broken=bad, gateway_lines=[bad]
    )
    named = replace(outcome, scenario=outcome.scenario.model_copy(update={"name": bad, "about": bad}))
    seen = page(named)
    assert "img" not in {tag for tag, _ in seen.tags}
    assert sum(tag == "script" for tag, _ in seen.tags) == sum(tag == "script" for tag, _ in page(outcome).tags) == 3
    assert seen.words.count(bad) >= 5


def test_plots_are_as_plotly_has_them() -> None:
    for outcome in (dive(), dive(simulated=False), play()):
        for one in page(outcome).drawings()[0]:
            go.Figure(one)  # refuses what it does not know


def test_there_are_only_plots_of_what_is_known() -> None:
    everything = titles(dive())
    assert everything[:2] == ["Time line", "Thruster 3"]
    assert {"Speed", "Track, from above", "Depth and supply", "Navigation: scores", "Thruster 8"} <= set(everything)
    recorded = titles(dive(simulated=False))
    assert {"Speed", "Thrusters: measured less predicted speed", "Thruster 8"} <= set(recorded)
    assert not {"Track, from above", "Depth and supply"} & set(recorded)
    assert titles(play()) == ["Time line"]


def test_thrusters_that_nothing_happened_to_wait_until_asked_for() -> None:
    drawn = figures(dive(), ())
    assert [one.title for one in drawn if one.title.startswith("Thruster ") and one.main] == ["Thruster 3"]


def test_the_worst_score_is_in_its_plot() -> None:
    outcome = dive()
    score = outcome.scores["T3"].value
    score[300] = 99.0
    drawn = plot(outcome, "Thruster 3")
    assert max(line(drawn, "score")["y"]) == 99.0
    assert "score, cut at 10" in [one["text"] for one in drawn["layout"]["annotations"]]
    assert drawn["layout"]["yaxis3"]["range"] == [0.0, 10.0]


def test_what_is_no_number_is_a_gap() -> None:
    outcome = dive()
    assert outcome.truth is not None
    outcome.truth.healthy_rpm[100:110, 2] = np.nan
    outcome.truth.speed_rpm[200:210, 2] = np.inf
    drawn = plot(outcome, "Thruster 3")
    assert None in line(drawn, "healthy")["y"]
    assert None in line(drawn, "measured")["y"]
    json.dumps(drawn, allow_nan=False)


def test_a_stretch_of_a_level_lasts_until_the_next() -> None:
    drawn = figure(dive(), "Time line")
    bars = of_row(drawn, "thruster 3")
    assert [one.label for one in bars] == ["UNKNOWN", "NORMAL", "SUSPECT", "FAULT", "NORMAL"]
    assert bars[3].from_x == pytest.approx(FOUND_S, abs=1e-3)
    assert [one.to_x for one in bars] == [*(one.from_x for one in bars[1:]), LASTED_S]
    assert drawn.x_range == (0.0, LASTED_S)


def test_the_failsafes_notes_are_no_level_of_the_vehicle() -> None:
    assert [one.label for one in of_row(figure(dive(), "Time line"), "vehicle")] == ["NORMAL"]


def test_a_fault_is_a_bar_that_tells_how_it_grows() -> None:
    (bar,) = of_row(figure(dive(), "Time line"), "thruster 3 entangled")
    assert (bar.from_x, bar.to_x) == (ENTANGLED.at_s, ENTANGLED.until_s)
    assert "share 0.3, grows within 4 s" in bar.text


def test_what_was_expected_and_what_was_said_are_marked() -> None:
    outcome = dive()
    (rows,) = figures(outcome, checks(outcome))[0].panels
    places = {name: place for place, name in enumerate(rows.rows)}
    marked = {
        (rows.rows[int(row)], label)
        for one in rows.marks
        if isinstance(one, Points)
        for row, label in zip(one.y, one.labels, strict=True)
    }
    assert {"expected", "mode", "command", "STATUSTEXT"} < places.keys()
    assert ("STATUSTEXT", "0:28.1 CRITICAL: Hold done for T3") in marked
    assert sum(name == "expected" for name, _ in marked) == sum(one.time_s is not None for one in checks(outcome))


def test_the_same_outcomes_are_the_same_page() -> None:
    assert report_html([dive()], WRITTEN) == report_html([dive()], WRITTEN)


def test_the_library_is_there_once_and_a_scenario_is_small() -> None:
    one, four = (len(report_html([dive()] * count, WRITTEN)) for count in (1, 4))
    assert (four - one) / 3 < 150_000 < one


def test_a_play_that_broke_off_at_once_and_a_run_of_none(tmp_path: Path) -> None:
    empty = dive(broken="no such bus", findings=[], texts=[], commands=[], modes=[], scores={}, truth=None)
    assert "the play comes to its end no such bus" in page(replace(empty, end_s=empty.start_s, wall_s=0.0)).words
    write_report([], tmp_path / "report.html")
    assert "0 of 0 scenarios passed" in (tmp_path / "report.html").read_text()


def test_how_to_play_it_once_more_and_replay_what_was_heard(tmp_path: Path) -> None:
    folder = tmp_path / "weeds and all"
    folder.mkdir()
    (folder / "can.log").write_text("(0.0) can0 123#00\n")
    (folder / "heard.tlog").write_bytes(b"")
    words = page(dive(folder=folder, path=Path("my dives/weeds.yaml"))).words
    assert "gateway hil play 'my dives/weeds.yaml' --seed 0" in words
    assert f"gateway replay '{folder}/gateway.toml' '{folder}/can.log' --out '{folder}/replay'" in words
    assert "gateway replay" not in page(dive()).words


def test_normal_speeds_are_a_band_where_the_scenario_tells_them() -> None:
    def bands(outcome: Outcome) -> list[tuple[float, float]]:
        marks = figure(outcome, "Speed").panels[0].marks
        return [(float(one.low.min()), float(one.high.max())) for one in marks if isinstance(one, Band)]

    outcome = dive()
    told = outcome.scenario.gateway.model_copy(
        update={"settings": {"speed": {"minimum_mps": 0.6, "maximum_mps": 1.0}}}
    )
    scenario = outcome.scenario.model_copy(update={"gateway": told})
    assert bands(outcome) == []
    assert bands(replace(outcome, scenario=scenario)) == [(0.6, 1.0)]


@pytest.mark.skipif(BROWSER is None, reason=NO_BROWSER)
def test_a_browser_draws_it(tmp_path: Path) -> None:
    main = sum(one.main for one in figures(dive(), ()))
    ready = f'document.querySelectorAll(".plot.ready").length >= {main}'
    text = report_html([dive(), dive(simulated=False)], WRITTEN)
    seen = told_by_browser(text, tmp_path, (1280, 4000), ready, fragment="s1")
    assert seen.count('class="plot js-plotly-plot ready"') == main

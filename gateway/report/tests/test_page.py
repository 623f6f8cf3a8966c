"""The page of a dive: it needs nothing else, says first what was found, and tells everything without a script."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.plotting.palette import night_colours
from gateway.replay.result import ReplayResult
from gateway.report.dive import Dive
from gateway.report.figures import figures
from gateway.report.found import as_one, headline, name_of, troubles, watched
from gateway.report.page import LINES_MAX, page
from gateway.report.tests.browser import BROWSER, NO_BROWSER, told_by_browser
from gateway.report.tests.made_dive import BEGIN_S, DRIFT_S, LENGTH_S, TANGLED_S, dive, finding
from gateway.report.tests.page_parts import LOADS, PageParts

AGAIN = ["gateway", "replay", "my dive.toml", "can.log", "--out", "out"]
READY = 'document.querySelectorAll(".plot.ready").length'


@pytest.fixture(scope="module")
def made() -> Dive:
    return dive()


@pytest.fixture(scope="module")
def parts(made: Dive) -> PageParts:
    return PageParts(page(made, figures(made), AGAIN))


def words(shown: Dive) -> str:
    return PageParts(page(shown, [], AGAIN)).words


def quiet(*findings: Finding, **result: object) -> Dive:
    """A dive without figures and with these findings."""
    whole = {"begin_s": BEGIN_S, "end_s": BEGIN_S + LENGTH_S, "duration_s": LENGTH_S, "judged": True} | result
    nothing: dict[str, object] = {"thrusters": (), "speed": None, "navigation": None, "links": (), "modes": ()}
    return dive(findings=findings, result=ReplayResult(**whole), **nothing)  # type: ignore[arg-type]


def test_it_needs_no_network(parts: PageParts) -> None:
    assert "link" not in {tag for tag, _ in parts.tags}
    for tag, attributes in parts.tags:
        assert not LOADS & set(attributes), f"{tag} {attributes}"
        assert not any("://" in (value or "") for value in attributes.values()), f"{tag} {attributes}"
    style = "".join(parts.styles)
    assert "url(" not in style
    assert "@import" not in style
    (policy,) = (one["content"] for _, one in parts.tags if one.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in (policy or "")


def test_what_was_found_comes_first_and_the_worst_of_it_before_all(parts: PageParts) -> None:
    text = parts.words
    assert "3 faults found" in text[:120]
    places = [text.index(one) for one in ("Thruster 3 (rear right) FAULT", "Vehicle FAULT", "DVL FAULT", "zoom")]
    assert places == sorted(places)
    assert "T3 entangled? 1180 rpm, want 1502 (-21%)" in text
    assert "at 4:00.4 (22:17:20 UTC), for 1 min 2 s, then over" in text


def test_how_long_it_was_and_whether_it_was_over(made: Dive) -> None:
    found = {one.subject: one for one in troubles(made)}
    assert list(found) == ["thruster 3", "vehicle", "dvl"]
    tangled, drifting = found["thruster 3"], found["dvl"]
    assert tangled.first_s == pytest.approx(TANGLED_S + 0.4)
    assert tangled.total_s == pytest.approx(61.6)
    assert (tangled.times, tangled.lasts) == (1, False)
    assert drifting.lasts
    assert drifting.first_s > DRIFT_S
    assert "1 min 58 s, to the end" in words(made)


def test_what_comes_and_goes_is_told_once() -> None:
    several = [
        finding(at_s, level, "thruster 2", f"T2 {level.name}")
        for at_s, level in ((10, Level.FAULT), (12, Level.NORMAL), (20, Level.SUSPECT), (23, Level.NORMAL))
    ]
    shown = quiet(*several)
    (trouble,) = troubles(shown)
    assert (trouble.times, trouble.total_s, trouble.level, trouble.text) == (2, 5.0, Level.FAULT, "T2 FAULT")
    assert "2 times, first at 0:10 (22:13:30 UTC), 5 s in all" in words(shown)


def test_what_is_the_same_of_many_thrusters_is_told_once() -> None:
    silent = [finding(5, Level.SUSPECT, f"thruster {n} esc", f"T{n} ESC silent 5.1 s") for n in (1, 2, 3)]
    other = finding(6, Level.SUSPECT, "thruster 4 esc", "T4 ESC silent 5.1 s")
    told = as_one(troubles(quiet(*silent, other, finding(5, Level.SUSPECT, "dvl", "DVL noisy"))))
    assert [(one.name, one.text) for one in told] == [
        ("DVL", "DVL noisy"),
        ("Thrusters 1, 2, 3 ESC", "ESC silent 5.1 s"),
        ("Thruster 4 (rear left) ESC", "T4 ESC silent 5.1 s"),
    ]


@pytest.mark.parametrize(
    ("found", "judged", "wanted"),
    [
        ([], True, ("Nothing found", "good")),
        ([], False, ("Nothing could be judged", "warn")),
        ([finding(9, Level.SUSPECT, "thruster 1 esc")], False, ("Nothing could be judged", "warn")),
        ([finding(9, Level.SUSPECT, "dvl")], True, ("No fault, 1 suspicion", "warn")),
        ([finding(9, Level.FAULT, "dvl"), finding(9, Level.SUSPECT, "gyroscope")], True, ("1 fault found", "bad")),
        ([finding(9, Level.FAULT, "vehicle", "hold asked", "failsafe")], True, ("Nothing found", "good")),
    ],
)
def test_the_headline(found: list[Finding], judged: bool, wanted: tuple[str, str]) -> None:
    shown = quiet(*found, judged=judged)
    assert headline(shown) == wanted
    assert words(shown).startswith(f"{shown.config.vehicle.name}: {wanted[0]} {wanted[0]}")  # title and heading


def test_nothing_found_is_told_with_what_was_watched_and_what_never_was() -> None:
    shown = replace(dive(), findings=(), result=ReplayResult(judged=True, unjudged=["thruster 9", "vehicle"]))
    told = {one.name: one for one in watched(replace(shown, speed=None))}
    assert told["Thruster 3 (rear right)"].judged_s == pytest.approx(LENGTH_S - 12.0, abs=1.0)
    assert told["Vehicle"].level is Level.UNKNOWN
    assert told["Vehicle"].judged_s == 0.0
    text = words(replace(shown, speed=None))
    assert "Never judged: Thruster 9, Vehicle." in text
    assert "Thruster 1 (front right) 9 min 48 s NORMAL" in text


def test_without_a_script_everything_is_told(made: Dive, parts: PageParts) -> None:
    result = replace(
        made.result,
        drops={"can0": Counter({"CRC": 12}), "pipeline": Counter()},
        logs={"can.log": ["28548 records", "lost, line 7: cut off"]},
        unused=Counter({"can1": 5}),
        remarks={"vehicle": "positions from LOCAL_POSITION_NED"},
    )
    text = words(replace(made, result=result))
    told = [one.text for one in made.findings]
    told += ["28548 records", "lost, line 7: cut off", "CRC 12", "5 frames that no link of the configuration is for"]
    told += ["down once, at 1:40, for 12 s", "positions from LOCAL_POSITION_NED", "gateway 0.1.0"]
    told += ["gateway replay 'my dive.toml' can.log --out out", "[[thruster]]"]
    for one in told:
        assert " ".join(one.split()) in text, one


def test_what_logs_and_configurations_say_is_no_markup(made: Dive) -> None:
    bad = "<script>alert(1)</script><img src=x>"
    thruster = made.config.thruster[0].model_copy(update={"name": bad})
    config = replace(made.config, thruster=[thruster, *made.config.thruster[1:]], text=bad)
    named = replace(made.thrusters[0], name=bad)
    several = (finding(5, Level.FAULT, "thruster 1", bad), finding(6, Level.FAULT, bad))
    shown = replace(
        made,
        config=config,
        config_text=bad,
        thrusters=(named,),
        findings=several,
        modes=((0.0, bad),),
        result=replace(made.result, logs={bad: [bad]}, remarks={"vehicle": bad}),
    )
    seen = PageParts(page(shown, figures(shown), [bad]))
    plain = PageParts(page(made, figures(made), AGAIN))
    assert "img" not in {tag for tag, _ in seen.tags}
    assert sum(tag == "script" for tag, _ in seen.tags) == sum(tag == "script" for tag, _ in plain.tags)
    assert seen.words.count(bad) >= 8


def test_a_subject_that_flickers_does_not_fill_the_page() -> None:
    several = [finding(0.1 * n, Level(2 + n % 2), "thruster 2", f"no. {n}") for n in range(3 * LINES_MAX)]
    text = words(quiet(*several))
    assert "no. 0" in text
    assert f"and {2 * LINES_MAX} more, in findings.jsonl" in text
    assert len(text) < 100 * LINES_MAX


def test_ids_are_of_one_thing_each(parts: PageParts) -> None:
    assert len(parts.ids) == len(set(parts.ids))
    assert {"thruster-3", "timeline"} <= set(parts.ids)


def test_every_figure_has_its_place(made: Dive, parts: PageParts) -> None:
    drawn = figures(made)
    numbers = sorted(int(one["data-number"] or 0) for _, one in parts.tags if "data-number" in one)
    (drawings,) = parts.drawings()
    assert numbers == list(range(len(drawn))) == list(range(len(drawings)))
    for one in drawn:
        assert one.title in parts.words


def test_the_same_dive_is_the_same_page(made: Dive) -> None:
    assert page(made, figures(made), AGAIN) == page(made, figures(made), AGAIN)


def test_it_is_small_enough_to_be_sent(made: Dive) -> None:
    assert len(page(made, figures(made), AGAIN)) < 4_000_000  # of which the library is 2 million


def test_a_log_without_a_date_is_told_by_its_own_seconds() -> None:
    shown = replace(quiet(), begin_s=265.0, end_s=300.0)
    assert "265.0 s by the log" in words(shown)
    assert "UTC" not in words(replace(shown, findings=(replace(finding(0, Level.FAULT, "dvl"), time_s=270.0),)))


def test_names_are_as_people_write_them(made: Dive) -> None:
    names = [name_of(one, made) for one in ("thruster 3 esc", "dvl", "dvl signal", "link can0", "thruster 12")]
    assert names == ["Thruster 3 (rear right) ESC", "DVL", "DVL signal", "Link can0", "Thruster 12"]


# what a pilot does on a phone, and what comes of it, written where the test can read it
TAPS = """<script>
const [plot, other] = document.querySelectorAll(".plot");
const bars = () => plot.data.find((one) => one.type === "bar").marker.color;
const span = (one) => [...one.layout.xaxis.range];
const told = () => [plot.layout.dragmode, bars()[0], plot.layout.font.color, span(plot), span(other)];
const after = (event) => new Promise((done) => plot.once(event, done));
const waiting = setInterval(async () => {
  if (document.querySelectorAll(".plot.ready").length < 2) return;
  clearInterval(waiting);
  const seen = [told()];
  document.querySelector("#timeline .zoom").click();
  seen.push(told());
  const [from, to] = span(plot);
  await Plotly.relayout(plot, {"xaxis.range[0]": (3 * from + to) / 4, "xaxis.range[1]": (from + to) / 2});
  seen.push(told());
  document.getElementById("ground").click();
  await after("plotly_afterplot");
  seen.push(told());
  document.body.dataset.seen = JSON.stringify(seen);
}, 100);
</script>"""


@pytest.mark.skipif(BROWSER is None, reason=NO_BROWSER)
def test_a_phone_draws_it_scrolls_until_zooming_is_asked_for_and_keeps_what_is_zoomed_in_the_dark(
    made: Dive, tmp_path: Path
) -> None:
    drawn = [one for one in figures(made) if one.main][:3]
    text = page(made, drawn, AGAIN).replace("</body>", f"{TAPS}</body>")
    seen = told_by_browser(text, tmp_path, (500, 2500), f"document.body.dataset.seen && {READY} >= 2")
    assert seen.count('class="plot js-plotly-plot ready"') >= 2  # those in view, the time line among them
    (letters,) = re.findall(r'data-seen="([^"]*)"', seen)
    first, zooming, zoomed, dark = json.loads(unescape(letters))
    assert first[0] is False
    assert zooming == ["zoom", *first[1:]]
    assert zoomed[:3] == zooming[:3]
    assert zoomed[3] == zoomed[4] != first[3] == first[4]  # all figures show the same time
    assert dark[0] == "zoom"
    assert night_colours()[first[1]] == dark[1]
    assert first[2] != dark[2]
    assert dark[3] == zoomed[3]

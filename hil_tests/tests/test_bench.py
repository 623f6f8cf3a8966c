"""The benchmark: what it counts, that both sides of every ratio do the same work, and the command whole."""

from __future__ import annotations

import json
from importlib.util import find_spec

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from hil_tests.bench import bench, command, peers, thruster, works
from hil_tests.bench.residual import CALIBRATION, scaled_residual
from hil_tests.bench.thruster_detection import CONTENDERS, Contender, Finding, judge, score
from hil_tests.bench.timing import Comparison, DisagreementError, measure
from hil_tests.bench.works import WORKS
from hil_tests.random_runs import random_run


def findings(loss, delays):
    return [Finding("one", seed, loss, delay, seconds=0.5) for seed, delay in enumerate(delays)]


def test_alarms_count_by_when_they_came():
    healthy = findings(0.0, [None, -300, 200, None, None])
    seven = findings(0.07, [0, 20, 21, -1, None])
    three = findings(0.03, [100, 101, -5, 50, None])
    result = score("one", [*healthy, *seven, *three, Finding("another", 0, 0.0, -1, 9.0)])
    assert (result.runs, result.healthy_alarms, result.found_7, result.early_7, result.found_3) == (5, 2, 2, 1, 2)
    assert result.median_delay_7 == 20.0
    assert result.seconds_per_run == 0.5


def test_a_contender_is_judged_from_the_onset_on(monkeypatch):
    for offset in (-7, 0, 12):
        late = Contender("late", lambda run, offset=offset: run.onset + offset if run.loss else None)
        monkeypatch.setitem(CONTENDERS, "late", late)
        assert [finding.delay for finding in judge("late", 3, "plain")] == [None, offset, offset]


def test_the_residual_knows_the_thruster_and_shows_the_loss():
    run = random_run(1, loss=0.07)
    residual = scaled_residual(run)
    assert residual[:CALIBRATION].std() == pytest.approx(1.0)
    assert residual[run.onset + 30 :].mean() < -5.0


@pytest.mark.parametrize("margin", [1.0, 2.0])
def test_a_score_is_an_alarm_above_the_calibration_twice_in_a_row(margin):
    scores = np.tile([0.0, 0.5, 1.0], 400)
    scores[900] = 9.0
    assert peers._above_calibration(scores, 0, margin) is None
    scores[1000:1003] = 0.5 + margin * 0.5 + 0.01
    assert peers._above_calibration(scores, 0, margin) == 1001


@pytest.mark.parametrize("work", WORKS.values(), ids=WORKS.keys())
def test_both_sides_of_every_ratio_come_to_the_same_results(work):
    comparison = work()
    ours, theirs = comparison.ours(), comparison.theirs()
    assert comparison.agree(ours, theirs)
    again = comparison.ours()
    assert comparison.agree(again, theirs)  # a call leaves nothing behind that the next one meets


def test_times_of_different_results_are_not_compared():
    with pytest.raises(DisagreementError, match="sums: ours and the peer"):
        measure(Comparison("sums", "the peer", "sum", 1, lambda: 1, lambda: 2, lambda one, other: one == other))


def test_missing_peers_are_named_with_the_way_to_get_them(monkeypatch):
    monkeypatch.setitem(CONTENDERS, "ADWIN", Contender("ADWIN", peers.adwin, "no_such_package"))
    console = Console(record=True, width=200)
    assert thruster.available(["thruster detector", "ADWIN"], console) == ["thruster detector"]
    said = console.export_text()
    assert "ADWIN" in said
    assert "pip install 'thruster-gateway[bench]'" in said


def test_the_thruster_part_prints_tables_and_writes_the_figures(tmp_path):
    chosen = ["thruster detector", "fixed model", "PageHinkley"]
    only = [word for name in chosen for word in ("--only", name)]
    figures = measured(["thruster", "--runs", "1", "--jobs", "1", *only, "--paper", "0"], chosen[0], tmp_path)[
        "thruster"
    ]
    expected = chosen if find_spec("river") else chosen[:2]
    assert figures["options"]["runs"] == 1
    assert [line["contender"] for line in figures["detection"]] == expected
    assert [finding["loss"] for finding in figures["findings"]] == [0.0, 0.07, 0.03] * len(expected)


def test_the_timing_part_compares_every_work(tmp_path, monkeypatch):
    monkeypatch.setattr(works, "WORKS", {"DBC": WORKS["DBC"]})  # all are met above; together they take a while
    lines = measured(["timing"], "Times beside the peers", tmp_path)["timing"]
    assert [line["work"] for line in lines] == [WORKS["DBC"]().work]
    assert lines[0]["ratio"] > 0.0


def test_without_a_part_all_are_measured_and_written(tmp_path, monkeypatch):
    told = []

    def part(name):
        return lambda jobs, console: told.append((name, jobs)) or {"figure": float("nan")}

    monkeypatch.setattr(command, "PARTS", {name: part(name) for name in command.PARTS})
    figures = measured(["--jobs", "3"], "", tmp_path)
    detectors = ["thruster", "speed", "navigation", "commissioning"]
    names = [*detectors, "supervisor", "live", "bridge", "recording", "replay", "timing"]
    assert told == [(name, 3) for name in names]
    assert figures["speed"] == {"figure": None}
    assert figures["packages"]["numpy"] == np.__version__


def test_options_of_a_part_before_its_name_are_refused_rather_than_ignored():
    result = CliRunner().invoke(bench, ["--jobs", "2", "timing"])
    assert result.exit_code == 2
    assert "gateway bench timing ..." in result.output


def measured(arguments, said, folder):
    """The figures that the command writes, after it has printed what was to be said."""
    file = folder / "figures.json"
    result = CliRunner().invoke(bench, [*arguments, "--json", str(file)])
    assert result.exit_code == 0, result.output
    assert said in result.output
    return json.loads(file.read_text(), parse_constant=pytest.fail)

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from detectors.verdict import Level
from hil_tests.paper_experiments import (
    Trace,
    false_alarms,
    figure,
    mae_rpm,
    main,
    rows,
    run,
    samples_to_finding,
    samples_to_relearn,
)
from hil_tests.paper_trials import TRIALS, Fault, hov_sea_trial, portable_sea_trial, saucer_pool_test

SEED = 1


@pytest.fixture(scope="module")
def runs():
    return [run(simulate(SEED), seed=SEED) for simulate in TRIALS]


def test_online_model_raises_no_false_alarm_the_fixed_one_does(runs):
    assert [false_alarms(one, one.online) for one in runs] == [0, 0, 0]
    assert all(false_alarms(one, one.fixed) > 0 for one in runs)


def test_online_model_predicts_better_by_more_than_the_paper_s_37_9_percent(runs):
    assert all(mae_rpm(one.online) < (1 - 0.379) * mae_rpm(one.fixed) for one in runs)


def test_every_fault_is_found_and_the_second_strip_on_top_of_the_first(runs):
    _, pool, sea = runs
    first, second = pool.trial.faults
    weeds, blocked = sea.trial.faults
    assert samples_to_finding(pool.online, first) <= 4
    assert 5 <= samples_to_relearn(pool.online, first) <= 60
    assert samples_to_finding(pool.online, second) <= 4
    assert samples_to_finding(sea.online, weeds) <= 28
    assert samples_to_finding(sea.online, blocked) <= 4


def test_the_exact_search_comes_to_the_same_conclusions():
    one = run(saucer_pool_test(SEED), search="exact")
    assert false_alarms(one, one.online) == 0
    assert samples_to_finding(one.online, one.trial.faults[0]) <= 4


def test_recordings_are_as_in_the_paper_s_tables():
    assert np.abs(hov_sea_trial(SEED).command).max() <= 5.0
    assert np.abs(saucer_pool_test(SEED).command).max() <= 5.0
    portable = portable_sea_trial(SEED)
    assert portable.command.min() >= 0.0
    assert portable.command.max() <= 100.0
    assert [hov_sea_trial(SEED).threshold_rpm, portable.threshold_rpm] == [80.0, 8.0]
    assert not portable.speed_rpm[2875:].any()


@pytest.mark.parametrize("simulate", TRIALS)
def test_a_seed_is_a_recording(simulate):
    np.testing.assert_array_equal(simulate(3).speed_rpm, simulate(3).speed_rpm)
    assert (simulate(3).speed_rpm != simulate(4).speed_rpm).any()


def trace(levels):
    n = len(levels)
    return Trace(np.array(levels), np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool))


def test_how_findings_are_counted():
    n, s, f = Level.NORMAL, Level.SUSPECT, Level.FAULT
    fault = Fault("weeds", 3, 9)
    assert samples_to_finding(trace([n, n, n, s, f, f, n, n, n, f]), fault) == 2
    assert samples_to_relearn(trace([n, n, n, s, f, f, n, n, n, f]), fault) == 3
    assert np.isnan(samples_to_finding(trace([n, n, n, n, n, n, n, n, n, f]), fault))  # of the next fault
    assert np.isnan(samples_to_finding(trace([n, f, f, f, f, f, f, f, f, f]), fault))  # was there before
    assert np.isnan(samples_to_relearn(trace([n] * 10), fault))


def test_false_alarms_are_those_before_the_first_fault(runs):
    one = runs[1]
    levels = np.full(len(one.trial.command), Level.NORMAL)
    levels[1270:1290] = Level.FAULT
    assert false_alarms(one, replace(one.online, level=levels)) == 10


def test_rows_hold_the_paper_s_figures_beside_ours(runs):
    lines = {row.quantity: row for row in rows(1, [runs[1]])}
    assert lines["MAE online, rpm"].paper == "1.70"
    assert lines["MAE online, rpm"].here.startswith(f"{mae_rpm(runs[1].online):.4g}")
    assert lines["online lower by, %"].paper == "69.3"
    assert lines["false alarms online"].here == "in 0 of 1 runs"
    assert lines["second cloth strip: found at its sample no."].here.endswith("in 1 of 1 runs")


def test_figure_has_a_row_for_each_experiment(runs):
    drawn = figure(runs)
    assert len(drawn.axes) == 9 + 3  # with the scale of the commands on the right


def test_command_prints_the_table_and_draws(tmp_path):
    out = tmp_path / "experiments.png"
    result = CliRunner().invoke(main, ["--seeds", "1", "--search", "exact", "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "HOV, sea trial" in result.output
    assert out.read_bytes().startswith(b"\x89PNG")

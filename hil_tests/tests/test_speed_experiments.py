from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from detectors.speed.basis import FlowBasis
from detectors.speed.learnt_flow import FixedBasisFlow
from detectors.speed.moving_basis import MovingBasisFlow
from hil_tests import speed_experiments
from hil_tests.speed_experiments import blimp_rows, main, simulation_rows
from hil_tests.speed_figures import figure
from hil_tests.speed_traces import (
    SpeedTrace,
    false_alarms,
    found_s,
    judge_exactly,
    judge_to_the_letter,
    kept_share,
    parameters_of,
    unsettled_until_s,
)
from hil_tests.speed_trials import FanWind, blimp_trial, ocean_trial


@pytest.fixture(scope="module")
def ocean():
    trial = ocean_trial()
    return trial, judge_to_the_letter(trial)


@pytest.fixture(scope="module")
def blimp():
    trial = blimp_trial(1)
    return trial, judge_to_the_letter(trial)


def test_flag_is_2_in_the_first_seconds_only_then_0_until_the_fault_and_1_within_1_5_s_of_it(ocean):
    _, trace = ocean
    settled_s, after_s = unsettled_until_s(trace, 200.0), found_s(trace, 200.0)
    assert 8.0 <= settled_s <= 12.0  # the paper: about 10
    assert (trace.flag[trace.time_s < settled_s] == 2).all()
    assert (trace.flag[(trace.time_s >= settled_s) & (trace.time_s < after_s)] == 0).all()
    assert 200.0 < after_s <= 201.5
    assert (trace.flag[trace.time_s >= after_s] == 1).all()


def test_speed_and_flow_where_the_vehicle_is_are_learnt(ocean):
    trial, trace = ocean
    late = trace.time_s >= 100.0
    before, after = late & (trace.time_s < 200.0), trace.time_s > 230.0
    assert np.abs(trace.speed_mps[before] - 1.0).max() < 0.02
    assert np.abs(trace.speed_mps[after] - 0.5).max() < 0.01
    assert np.linalg.norm(trace.flow_mps - trial.flow_mps, axis=1)[before].max() < 0.03
    assert np.linalg.norm(trace.localisation_error_m, axis=1)[before].max() < 0.03


def test_heading_in_steps_gives_the_same_flags():
    trace = judge_to_the_letter(ocean_trial(stepped=True))
    assert false_alarms(trace, 200.0) == 0
    assert found_s(trace, 200.0) <= 201.5


def test_the_trial_is_table_1_and_equation_1(ocean):
    trial, _ = ocean
    assert trial.true_flow is not None
    np.testing.assert_array_equal(trial.true_flow.parameters, [[0.9, 0.5, 0.7], [0.8, 0.5, 0.9]])
    np.testing.assert_array_equal(trial.start_flow.parameters, [[0.17, 0.2, 0.05], [0.07, 0.1, 0.1]])
    positions = np.array([(one.north_m, one.east_m) for one in trial.samples])
    times = np.array([one.time_s for one in trial.samples])
    heading = np.array([one.heading_rad for one in trial.samples])
    np.testing.assert_allclose(heading, np.pi / 2 * times / 20)
    through = trial.speed_mps[:, None] * np.stack((np.cos(heading), np.sin(heading)), axis=1)
    moved = (trial.flow_mps + through)[:-1] + 0.5 * np.diff(trial.flow_mps + through, axis=0)
    expected = np.diff(positions, axis=0) / 0.1
    same = np.flatnonzero(np.diff(trial.speed_mps) == 0.0)
    np.testing.assert_allclose(expected[same], moved[same], atol=2e-3)


@pytest.mark.parametrize("rate_hz", [1.0, 0.2])
def test_integrated_exactly_slow_sampling_raises_no_false_alarm_where_the_explicit_step_does(rate_hz):
    trial = ocean_trial(rate_hz)
    exact, explicit = judge_exactly(trial), judge_to_the_letter(trial)
    assert false_alarms(exact, 200.0) == 0
    assert found_s(exact, 200.0) <= 200.0 + max(2.0, 1.0 / rate_hz)
    assert unsettled_until_s(exact, 200.0) <= 20.0
    assert not unsettled_until_s(explicit, 200.0) <= 40.0  # or never
    assert false_alarms(explicit, 200.0) > 0


def test_at_the_paper_s_rate_both_integrations_agree(ocean):
    trial, explicit = ocean
    exact = judge_exactly(trial)
    settled = exact.time_s > 20.0
    assert np.abs(exact.speed_mps - explicit.speed_mps)[settled].max() < 0.03


def test_blimp_with_a_disabled_thruster_is_found_about_when_the_paper_finds_it(blimp):
    _, trace = blimp
    assert (trace.flag[(trace.time_s >= 0.0) & (trace.time_s < 4.4)] == 0).all()
    assert found_s(trace, 4.0) == pytest.approx(4.43, abs=0.1)
    assert kept_share(trace, 4.0) == 1.0
    assert np.abs(trace.speed_mps[trace.time_s < 4.0] - 0.0185).max() < 0.0005


def test_a_wider_normal_range_finds_the_blimp_later():
    found = [found_s(judge_to_the_letter(blimp_trial(half_range=half)), 4.0) for half in (0.05, 0.07, 0.1)]
    assert found == sorted(found)
    assert 4.3 < found[0] < found[-1] < 4.7


def test_fan_blows_along_the_first_axis_and_less_farther_away():
    wind = FanWind()
    near, far = wind.velocity_mps(0.0, np.array([1.0, 0.3])), wind.velocity_mps(0.0, np.array([3.0, 0.3]))
    assert near[0] > far[0] > 0.0
    assert near[1] == far[1] == 0.0
    beside = wind.velocity_mps(0.0, np.array([1.0, 0.8]))
    assert beside[0] < near[0]
    assert FanWind(scale=1.1).velocity_mps(0.0, np.array([1.0, 0.3]))[0] == pytest.approx(1.1 * near[0])


def trace_of(flags):
    count = len(flags)
    nothing = np.zeros((count, 2))
    return SpeedTrace(
        np.arange(count, dtype=float), np.array(flags), np.zeros(count), np.zeros(count), nothing, nothing,
        np.zeros((count, 2, 1)),
    )  # fmt: skip


def test_how_flags_are_counted():
    trace = trace_of([2, 1, 2, 0, 0, 0, 0, 1, 1, 2])
    assert unsettled_until_s(trace, 6.0) == 3.0
    assert false_alarms(trace, 6.0) == 1
    assert found_s(trace, 6.0) == 7.0
    assert kept_share(trace, 6.0) == pytest.approx(2 / 3)
    never = trace_of([2, 2, 2, 2])
    assert np.isnan(unsettled_until_s(never, 3.0))
    assert np.isnan(found_s(never, 3.0))
    assert kept_share(never, 3.0) == 0.0
    assert unsettled_until_s(trace_of([0, 0, 1]), 2.0) == 0.0


def test_parameters_are_those_of_a_fixed_basis():
    fixed = FixedBasisFlow(FlowBasis(((0.0, 0.0),), (1.0,)), parameters=np.array([[1.0], [2.0]]))
    np.testing.assert_array_equal(parameters_of(fixed), [[1.0], [2.0]])
    with pytest.raises(TypeError, match="FixedBasisFlow"):
        parameters_of(MovingBasisFlow())


def test_rows_hold_the_paper_s_figures_beside_ours(ocean):
    _, trace = ocean
    rows = {row.quantity: row for row in simulation_rows() if row.experiment == "simulation, 10 Hz"}
    assert rows["speed falls at 200 s, flag 1 from, s"].here == f"{found_s(trace, 200.0):.1f}"
    assert rows["samples of flag 1 before the fault"].here == "0"
    blimps = {row.experiment: row for row in blimp_rows([0]) if row.paper == "4.43"}
    assert list(blimps) == ["blimp, range +-5 %", "blimp, range +-7 %", "blimp, range +-10 %"]


def test_figure_has_the_paper_s_panels(ocean, blimp):
    drawn = figure(*ocean, *blimp)
    titles = [axes.get_title() for axes in drawn.axes]
    assert [number for number in ("1a", "1b", "2", "3", "11") if any(f"figure {number}:" in t for t in titles)] == [
        "1a", "1b", "2", "3", "11",
    ]  # fmt: skip
    with pytest.raises(ValueError, match="of the basis"):
        figure(replace(ocean[0], true_flow=None), ocean[1], *blimp)


def test_command_prints_the_table_and_draws(tmp_path, monkeypatch):
    monkeypatch.setattr(speed_experiments, "OTHER_RATES_HZ", (1.0,))
    out = tmp_path / "experiments.png"
    result = CliRunner().invoke(main, ["--seeds", "1", "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "simulation, 10 Hz" in result.output
    assert out.read_bytes().startswith(b"\x89PNG")

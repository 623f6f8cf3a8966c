"""The benchmark of the navigation detector: what is found, early, false; thresholds; and that it works whole."""

from __future__ import annotations

import json
import sys
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose
from rich.console import Console

from detectors.navigation import DvlSample, FaultKind, NavigationConfig, NavigationVerdict, Sensor, SensorVerdict
from detectors.verdict import Level
from hil_tests.bench import bench
from hil_tests.bench.navigation import Figures, show
from hil_tests.bench.navigation_cases import CASES, FAULT_S, LEARNT_S, PAPER_CASE, Recorded, Simulated, onsets
from hil_tests.bench.navigation_measure import (
    RECORDINGS,
    Options,
    group_of,
    judge_all,
    judge_paper,
    judge_positions,
    judge_slow,
    rates_of,
)
from hil_tests.bench.navigation_paper import paper_score
from hil_tests.bench.navigation_pictures import PICTURED, draw, watched
from hil_tests.bench.navigation_positions import TakingOver, Variant, dvl_faults, errors_m, way
from hil_tests.bench.navigation_scores import DEFAULT, alarm, alarms, begun, delay_s, found, named, scales_for
from hil_tests.bench.navigation_timing import plain_navigation, skew
from hil_tests.bench.navigation_trace import Job, Trace, traces
from hil_tests.bench.timing import Timing
from hil_tests.dives import random_dive
from hil_tests.navigation_aids import acoustic_fixes
from hil_tests.navigation_figures import statistics_figure, track_figure
from hil_tests.navigation_trials import samples

STEP = CASES[0]
COST = Timing("NavigationDetector.update", "plain loop", "second of data", 20_000.0, 25_000.0, 1.25)
TIME_S = np.arange(0.0, 400.0)


class StandIn:
    """A detector of jumps of the DVL, as simple as can be: it compares each velocity with the one before."""

    def __init__(self, config, initial):
        self.config, self.state = config, initial
        self.before = None
        self.fault = False
        self.score = 0.0
        self.fixes = 0

    def update(self, sample):
        if isinstance(sample, DvlSample):
            before = sample.velocity_mps if self.before is None else self.before
            self.score = float(np.abs(np.subtract(sample.velocity_mps, before)).max()) / 0.4
            self.fault = self.fault or self.score >= 1.0
            self.before = sample.velocity_mps
        self.fixes += type(sample).__name__ == "FixSample"
        level = Level.FAULT if self.fault else Level.NORMAL
        return NavigationVerdict(
            time_s=sample.time_s, level=level, score=self.score, state=replace(self.state, time_s=sample.time_s),
            statistics={"chi_square": 2.0 * self.score, "cusum": self.score, "lstm": 0.0, "ratio": self.score},
            sensors=(SensorVerdict(Sensor.DVL, level, kind=FaultKind.STEP if self.fault else None),),
            isolated=("dvl",) if self.fault and self.config.isolate else (),
        )  # fmt: skip


class Installed(StandIn):
    """Is three times as restless where it does not learn how the sensors are mounted."""

    def update(self, sample):
        verdict = super().update(sample)
        if self.config.estimate_installation:
            return verdict
        return replace(verdict, statistics={name: 3.0 * value for name, value in verdict.statistics.items()})


class Inline:
    """A pool that does what it is asked for at once."""

    def submit(self, call, *arguments):
        future = Future()
        future.set_result(call(*arguments))
        return future


def trace(statistic=None, fault=None, name="one", case=None, onset_s=-np.inf, isolate=False, **keys):
    fault = np.zeros(len(TIME_S), dtype=bool) if fault is None else fault
    statistic = np.zeros(len(TIME_S)) if statistic is None else statistic
    values = {
        "group": "some", "name": name, "isolate": isolate, "case": case, "where": "straight", "onset_s": onset_s,
        "time_s": TIME_S, "fault": fault, "statistics": {"chi_square": statistic}, "first_s": None, "sensor": None,
        "kind": None, "data_s": 400.0, "seconds": 4.0,
    }  # fmt: skip
    return Trace(**{**values, **keys})


def peaks(*pairs):
    statistic = np.zeros(len(TIME_S))
    for index, height in pairs:
        statistic[index] = height
    return statistic


def test_alarms_that_are_close_are_one():
    alarmed = np.isin(TIME_S, [10.0, 12.0, 16.0, 30.0, 31.0])
    assert begun(TIME_S, alarmed).tolist() == [10.0, 30.0]
    assert len(begun(TIME_S, np.zeros(400, dtype=bool))) == 0


def test_false_alarms_are_counted_by_the_hour_and_by_their_time():
    every = [trace(peaks((10, 1.5), (11, 1.5), (200, 2.0)), name="one"), trace(name="other")]
    score = alarms("chi_square", every)
    assert (score.dives, score.alarmed, score.events, score.scale) == (2, 1, 2, 1.0)
    assert score.per_hour == pytest.approx(2 / (800.0 / 3600.0))
    assert score.share == pytest.approx(3 / 800)
    higher = alarms("chi_square", every, {"one": 1.8, "other": 1.8})
    assert (higher.events, higher.scale) == (1, 1.8)


def test_the_default_is_judged_by_its_verdict_and_what_says_nothing_is_silent():
    fault = TIME_S > 300.0
    assert (alarm(trace(fault=fault), DEFAULT) == fault).all()
    assert not alarm(trace(np.full(400, np.nan)), "chi_square").any()
    assert not alarm(trace(), "lstm").any()


def test_a_threshold_is_set_on_the_other_dives():
    dives = [
        trace(peaks((100, 3.0)), name="one"),
        trace(peaks((50, 8.0), (100, 5.0)), name="two"),
        trace(peaks((70, 2.0)), name="three"),
    ]
    none = scales_for("chi_square", dives, 0.0)
    assert none["two"] == pytest.approx(3.0, rel=0.04)  # the worst of the others, just above
    assert none["one"] == none["three"] == pytest.approx(8.0, rel=0.04)
    assert all(none[name] > worst for name, worst in (("two", 3.0), ("one", 8.0)))
    one_each = scales_for("chi_square", dives, 1.0 / (800.0 / 3600.0))  # one alarm in the two others
    assert one_each["one"] == pytest.approx(5.0, rel=0.04)


def test_a_lower_threshold_that_melts_alarms_into_one_is_not_taken():
    restless = trace(1.0 + peaks(*((index, 1.0) for index in range(0, 400, 20))), name="restless")
    other = trace(name="other")
    scales = scales_for("chi_square", [restless, other], 9.0)  # one alarm in each would be fine
    assert scales["other"] == pytest.approx(2.0, rel=0.04)


def test_a_fault_is_found_after_its_onset_and_not_by_whom_was_in_alarm_before():
    def delayed(*alarmed, **keys):
        return delay_s(
            trace(peaks(*((index, 1.0) for index in alarmed)), case=STEP, onset_s=200.5, **keys), "chi_square"
        )

    assert delayed(210) == pytest.approx(9.5)
    assert delayed() is None
    assert delayed(200, 210) is None  # still in alarm
    assert delayed(150, 210) == pytest.approx(9.5)


def test_an_imus_sample_can_be_the_first_to_show_the_default_a_fault():
    fault = TIME_S >= 207.0
    assert delay_s(trace(fault=fault, case=STEP, onset_s=200.5), DEFAULT) == pytest.approx(6.5)
    assert delay_s(trace(fault=fault, case=STEP, onset_s=200.5, first_s=206.2), DEFAULT) == pytest.approx(5.7)


def test_what_is_not_found_takes_for_ever():
    trials = [trace(peaks((205 + late, 1.0)), case=STEP, onset_s=200.0) for late in (0, 10, 20)]
    score = found("chi_square", [*trials, trace(case=STEP, onset_s=200.0)])
    assert (score.case, score.trials, score.found, score.early) == (STEP.name, 4, 3, 0)
    assert score.median_s == pytest.approx(15.0)
    assert score.late_s is None
    assert score.covered == pytest.approx(3 / 800)


def test_sensors_are_counted_by_the_one_that_was_faulty():
    fault = TIME_S >= 207.0
    gyro = next(case for case in CASES if case.sensor is Sensor.GYROSCOPE)
    table = named(
        [
            trace(fault=fault, case=STEP, onset_s=200.5, sensor=Sensor.DVL),
            trace(fault=fault, case=gyro, onset_s=200.5, sensor=Sensor.DVL),
            trace(case=gyro, onset_s=200.5),
            trace(fault=fault, case=gyro, onset_s=200.5),
            trace(),
        ]
    )
    assert table[Sensor.DVL] == {"dvl": 1}
    assert table[Sensor.GYROSCOPE] == {"dvl": 1, "open": 1, "none": 1}
    assert not table[Sensor.DEPTH]


def test_the_papers_segments_are_missed_found_and_falsely_alarmed():
    statistic = peaks((70, 1.0), (71, 1.0), (110, 1.0), (210, 1.0), (249, 1.0), (252, 1.0), (302, 1.0))
    score = paper_score("chi_square", [trace(statistic, case=PAPER_CASE)])
    # found after 20 s; never; in alarm before it; never (an alarm just after a fault is its own)
    assert (score.segments, score.missed, score.early, score.median_s) == (4, 2, 1, 20.0)
    assert score.false_segments == 2  # 110 and 210
    assert score.missed_share == pytest.approx(1.0 - 3 / 200)
    assert score.false_share == pytest.approx(4 / 200)


def test_onsets_are_on_straight_legs_and_in_turns():
    dive = random_dive(2)
    rates = np.abs(dive.motion.turning_radps(dive.imu[:, 0])[:, 2])
    for seed in range(5):
        begins = onsets(dive, np.random.default_rng(seed))
        assert LEARNT_S <= begins["straight"] <= 400.0 - FAULT_S + 1.0
        after_s = dive.imu[:, 0] - begins["straight"]
        assert rates[(after_s >= 0.0) & (after_s < 8.0)].max() < 0.06
        assert rates[np.abs(dive.imu[:, 0] - begins["turn"]) < 4.0].max() > 0.03


def test_cases_have_names_of_their_own_and_faults_that_fit():
    assert len({case.name for case in CASES}) == len(CASES)
    assert {case.sensor for case in CASES} == set(Sensor)
    axes = set()
    for case in CASES:
        fault = case.fault(100.0, np.random.default_rng(1))
        assert (fault.sensor, fault.kind, fault.end_s - fault.onset_s) == (case.sensor, case.kind, FAULT_S)
        assert abs(fault.size) == case.size
        axes.add(fault.axis)
    assert PAPER_CASE.name == "DVL drift 0.04 m/s2"


@pytest.fixture(scope="module")
def judged():
    return traces(Job(Simulated(0, duration_s=240.0), (STEP, PAPER_CASE), NavigationConfig(), StandIn))


def test_a_dive_is_traced_healthy_twice_and_with_each_fault(judged):
    assert [(one.case, one.isolate) for one in judged] == [
        (None, True), (None, False), (STEP, False), (PAPER_CASE, False),
    ]  # fmt: skip
    healthy, _, step, drift = judged
    assert healthy.data_s == pytest.approx(240.0, abs=0.1)
    assert healthy.seconds > 0.0
    assert not healthy.fault.any()
    assert delay_s(step, "cusum") < 0.5
    assert (step.sensor, step.kind) == (Sensor.DVL, FaultKind.STEP)
    assert not drift.fault.any()
    assert step.where != drift.where  # in turns, the one or the other
    assert step.time_s[-1] < step.onset_s + FAULT_S
    assert step.time_s[0] < step.onset_s - 2.0


def test_a_fault_goes_on_from_the_healthy_dive(judged):
    _, healthy, step, _ = judged
    before = step.time_s < step.onset_s
    at = np.searchsorted(healthy.time_s, step.time_s[before])
    assert_allclose(step.statistics["cusum"][before], healthy.statistics["cusum"][at])


def test_the_papers_filter_stands_beside_ours():
    job = Job(Simulated(0, duration_s=200.0, imu_hz=10.0), (STEP,), NavigationConfig(), Installed, plain=True)
    (isolating, using_all, step) = traces(job)
    for one in (isolating, using_all, step):
        assert_allclose(one.statistics["plain cusum"], 3.0 * one.statistics["cusum"])
    assert Options(only=("lstm", "cusum")).compared == ("plain cusum", "lstm", "cusum", "ratio")


def test_fixes_take_over_while_the_dvl_is_isolated():
    dive = random_dive(0, duration_s=60.0, imu_hz=10.0)
    isolating = StandIn(NavigationConfig(), dive.initial)
    watch = TakingOver(isolating)
    for sample in samples(dive, acoustic_fixes(dive, 0)):
        if sample.time_s > 30.0:
            isolating.fault = True
        watch.update(sample)
    assert isolating.fixes == pytest.approx(6, abs=1)


def test_a_way_says_how_far_off_the_vehicle_believes_itself():
    source = Simulated(0, duration_s=100.0, imu_hz=10.0, vehicle="auv")
    variant = Variant("not isolated", NavigationConfig(isolate=False))
    played = way(source, variant, StandIn, dvl_faults(-50.0))
    assert not played.isolated.any()
    dive = source.load()
    gone_m = np.linalg.norm(np.trapezoid(dive.motion.velocity_mps(np.arange(0, 99.9, 0.1)), dx=0.1, axis=0)[:2])
    assert played.last_m == pytest.approx(gone_m, rel=0.02)  # the stand-in stays where it began
    assert played.greatest_m >= played.last_m
    assert_allclose(
        np.ptp(played.true_m, axis=0),
        np.ptp(dive.motion.velocity_mps.antiderivative()(played.time_s)[:, :2], axis=0),
        rtol=0.02,
    )
    isolating = way(source, Variant("no faults", NavigationConfig()), StandIn, dvl_faults(-50.0))
    assert isolating.isolated.any()
    assert list(errors_m([played, isolating, played])) == ["not isolated", "no faults"]
    assert errors_m([played, isolating, played])["not isolated"] == 2 * [(played.last_m, played.greatest_m)]


def test_the_plain_filter_knows_the_velocity():
    dive = random_dive(8, duration_s=30.0, dvl_hz=5.0, depth_hz=5.0)
    seen = list(samples(dive))
    true_mps = dive.motion.velocity_mps(seen[-1].time_s)
    assert_allclose(plain_navigation(dive.initial, NavigationConfig(), seen), true_mps, atol=0.3)
    blind = [one for one in seen if not isinstance(one, DvlSample)]
    assert np.abs(plain_navigation(dive.initial, NavigationConfig(), blind) - true_mps).max() > 0.3
    assert_allclose(skew(np.array([1.0, 2.0, 3.0])) @ [3.0, -1.0, 2.0], np.cross([1.0, 2.0, 3.0], [3.0, -1.0, 2.0]))


@pytest.mark.skipif(
    not any(RECORDINGS.glob("*.npz")), reason="the recordings of shared/data are not beside the project"
)
def test_a_recording_is_read_and_its_imu_slowed_down():
    path = sorted(RECORDINGS.glob("*.npz"))[1]
    full, slow = Recorded(path).load(), Recorded(path, imu_hz=10.0).load()
    assert (full.name, len(full.imu), len(slow.imu)) == (path.stem, 40_000, 4_000)
    assert_allclose(slow.imu[7, 1:], full.imu[70:80, 1:].mean(axis=0))
    assert set(onsets(full, np.random.default_rng(0))) == {"straight", "turn"}


def test_figures_are_drawn(tmp_path):
    options = Options(runs=1, recordings=tmp_path / "absent", positions=0)
    seen = [
        watched(Simulated(0, duration_s=200.0, imu_hz=10.0), case, NavigationConfig(), StandIn) for case in PICTURED
    ]
    assert [one.fault.kind for one in seen] == ["step", "drift"]
    upper, lower = statistics_figure(seen).axes[::2]
    assert len(upper.lines) == 3
    assert {line.get_label() for line in lower.lines} >= {"chi-square", "ratio (default)"}
    source = Simulated(0, duration_s=60.0, imu_hz=10.0)
    ways = [way(source, Variant(name, NavigationConfig()), StandIn, ()) for name in ("no faults", "ratio")]
    drawn = draw(tmp_path / "new", Inline(), replace(options, runs=0), StandIn, ways)
    assert [path.name for path in drawn] == ["track.png"]
    assert drawn[0].read_bytes().startswith(b"\x89PNG")
    assert len(track_figure(ways, [(10.0, 20.0)]).axes[0].lines) == 3


def test_the_options_of_the_command_reach_the_measurement(tmp_path, monkeypatch):
    asked = []

    def measure(options, jobs, console, folder):
        asked.append((options, jobs, folder))
        return Figures(options, [], {}, [], {}, [], COST)

    monkeypatch.setattr(sys.modules["hil_tests.bench.navigation"], "measure", measure)
    file, folds = tmp_path / "figures.json", tmp_path / "folds"
    folds.mkdir()
    arguments = [
        "--runs",
        "3",
        "--seed",
        "7",
        "--style",
        "rough",
        "--only",
        "cusum",
        "--no-plain",
        "--both",
        "--no-slow",
    ]
    arguments += [
        "--folds",
        str(folds),
        "--positions",
        "0",
        "--figures",
        str(tmp_path),
        "--jobs",
        "1",
        "--json",
        str(file),
    ]
    result = CliRunner().invoke(bench, ["navigation", *arguments])
    assert result.exit_code == 0, result.output
    ((options, jobs, folder),) = asked
    assert (jobs, folder, options.recordings) == (1, tmp_path, RECORDINGS)
    assert options == Options(3, 7, "rough", RECORDINGS, ("cusum",), False, True, False, folds, 0)
    assert [one.seed for one in options.simulated] == [7, 8, 9]
    config = options.config(Recorded(RECORDINGS / "some.npz"))
    assert (config.lstm_model, config.compare) == (folds / "some.npz", False)
    assert options.config(Simulated(0)).lstm_model is None
    assert json.loads(file.read_text(), parse_constant=pytest.fail)["navigation"]["options"]["runs"] == 3


def test_all_is_measured_and_shown():
    options = Options(runs=2, recordings=RECORDINGS / "absent", positions=1, only=("chi_square",))
    short = replace(options, plain=False)
    judged = [
        one
        for number in range(2)
        for one in traces(
            Job(Simulated(number, duration_s=200.0, imu_hz=10.0), CASES, NavigationConfig(), StandIn, number=number)
        )
    ]
    group = group_of("random dives", short, judged)
    assert [score.method for score in group.healthy] == ["chi_square", "ratio", "chi_square", "ratio"]
    assert len(group.found) == 2 * len(CASES)
    figures = Figures(short, [group], {"random dives": named(judged)}, [], {"no faults": [(1.0, 2.0)]}, [], COST)
    console = Console(width=160, record=True, file=None, quiet=False)
    with console.capture() as shown:
        show(figures, console)
    assert "DVL drift 0.04 m/s2" in shown.get()
    assert "34/27/17" in shown.get()
    assert rates_of(short, judged, {}) == []
    assert judge_paper(Inline(), short, StandIn, judged) == []
    assert judge_slow(Inline(), replace(short, slow=False), StandIn) == {}
    assert judge_all(Inline(), replace(short, runs=0), StandIn) == []
    assert judge_positions(Inline(), replace(short, positions=0), StandIn) == []

"""The rules of align.py, one by one, and what must hold for any arrival whatever."""

import math
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.thruster.sample import ThrusterSample
from gateway.align import RATE_REPORTS, RATES_HZ, TELEMETRY_HOLD_S, ThrusterAligner, nearest_rate_hz

any_float = st.floats(allow_nan=True, allow_infinity=True)
jitter = st.lists(st.floats(-0.4, 0.4), min_size=30, max_size=80)


def play(aligner: ThrusterAligner, events: list[tuple]) -> list[ThrusterSample]:
    """Events `("command", t, value)` or `("report", t, rpm, ...)` in the order given."""
    samples = []
    for kind, *arguments in events:
        if kind == "command":
            aligner.command(*arguments)
        else:
            samples += aligner.report(*arguments)
    return samples


def test_sample_stands_on_the_grid_and_speed_is_linear_between_the_reports_around_it():
    aligner = ThrusterAligner(sample_rate_hz=10)
    samples = play(aligner, [("command", 0.8, 0.5), ("report", 0.95, 100.0), ("report", 1.15, 300.0)])
    assert [s.time_s for s in samples] == [1.0, 1.1]
    assert [s.speed_rpm for s in samples] == pytest.approx([150.0, 250.0])
    assert [s.command for s in samples] == [0.5, 0.5]


def test_another_phase_is_the_same_grid_later():
    aligner = ThrusterAligner(sample_rate_hz=10, phase=0.25)
    samples = play(aligner, [("command", 0.8, 0.5), ("report", 0.95, 100.0), ("report", 1.15, 300.0)])
    assert [s.time_s for s in samples] == pytest.approx([1.025, 1.125])
    assert [s.speed_rpm for s in samples] == pytest.approx([175.0, 275.0])


def test_change_of_command_inside_a_period_counts_in_proportion():
    aligner = ThrusterAligner(sample_rate_hz=10)
    events = [("command", 0.85, 0.0), ("command", 0.925, 1.0), ("report", 0.95, 1.0), ("report", 1.01, 1.0)]
    (sample,) = play(aligner, events)
    assert sample.command == pytest.approx(0.75)


def test_command_that_came_after_the_grid_point_belongs_to_the_next_sample():
    aligner = ThrusterAligner(sample_rate_hz=10)
    events = [("command", 0.8, 0.0), ("report", 0.95, 1.0), ("command", 1.05, 1.0), ("report", 1.11, 1.0)]
    assert [s.command for s in play(aligner, events)] == pytest.approx([0.0, 0.5])


def test_no_sample_before_commands_cover_the_whole_period():
    aligner = ThrusterAligner(sample_rate_hz=10)
    events = [("command", 0.95, 0.3), ("report", 0.95, 1.0), ("report", 1.05, 1.0), ("report", 1.15, 1.0)]
    assert [s.time_s for s in play(aligner, events)] == [1.1]


def test_gap_in_the_reports_is_not_filled():
    aligner = ThrusterAligner(sample_rate_hz=10, gap_s=0.5, stale_s=9.0)
    events = [("command", 0.0, 0.3), *(("report", t, 1.0) for t in (1.02, 1.12, 1.63, 1.73))]
    assert [s.time_s for s in play(aligner, events)] == [1.1, 1.7]


def test_stale_command_gives_no_sample_and_a_new_one_does_not_reach_back():
    aligner = ThrusterAligner(sample_rate_hz=10, stale_s=0.25, gap_s=1.0)
    reports = [("report", 1.0 + 0.1 * n + 0.01, 1.0) for n in range(8)]
    late = [*reports[:6], ("command", 1.55, 0.9), *reports[6:]]
    samples = play(aligner, [("command", 1.0, 0.3), *late])
    assert [(s.time_s, s.command) for s in samples] == [(1.1, 0.3), (1.2, 0.3), (1.7, 0.9)]


def test_telemetry_is_held_and_given_up_after_its_time():
    aligner = ThrusterAligner(sample_rate_hz=1, stale_s=99.0, gap_s=2.0)
    events = [("command", 0.0, 0.3), ("report", 0.5, None, 16.0, 3.0), *(("report", 1.5 + n, 9.0) for n in range(7))]
    samples = play(aligner, events)
    assert [s.voltage_v for s in samples] == [16.0] * 4 + [None] * 2
    assert samples[0].current_a == 3.0
    assert samples[3].time_s - 0.5 <= TELEMETRY_HOLD_S < samples[4].time_s - 0.5


def test_time_running_backwards_is_refused_and_counted():
    aligner = ThrusterAligner(sample_rate_hz=10)
    healthy = play(aligner, [("command", 0.0, 0.3), ("command", 1.0, 0.5), ("report", 1.05, 5.0)])
    assert healthy == []
    assert play(aligner, [("command", 0.9, -1.0), ("report", 1.05, 9.0), ("report", 0.5, 9.0)]) == []
    assert aligner.drops == {"command time ran backwards": 1, "report time ran backwards": 2}
    (sample,) = aligner.report(1.11, 5.0)
    assert (sample.command, sample.speed_rpm) == (0.5, 5.0)


def test_rate_is_learnt_from_the_first_reports_and_then_kept():
    aligner = ThrusterAligner()
    commands = [("command", 0.02 * n, 0.1) for n in range(200)]
    reports = [("report", 0.02 * n + 0.001 * (n % 3), 7.0) for n in range(200)]
    events = sorted([*commands, *reports], key=lambda event: event[1])
    samples = play(aligner, events)
    assert aligner.rate_hz == 50
    assert samples[0].time_s > 0.02 * RATE_REPORTS
    later = [("report", 4.0 + 0.2 * n, 7.0) for n in range(100)]
    play(aligner, later)
    assert aligner.rate_hz == 50


@pytest.mark.parametrize(("commands_hz", "rate_hz"), [(100, 50), (50, 50), (20, 20), (10, 10), (3, 10)])
def test_learnt_rate_is_not_above_that_of_the_commands_but_for_rare_ones(commands_hz, rate_hz):
    aligner = ThrusterAligner()
    commands = [("command", n / commands_hz, 0.1) for n in range(4 * commands_hz)]
    reports = [("report", n / 50, 7.0) for n in range(200)]
    play(aligner, sorted([*commands, *reports], key=lambda event: event[1]))
    assert aligner.rate_hz == rate_hz


@pytest.mark.parametrize(
    ("reports_hz", "rate_hz"), [(0.2, 1), (1, 1), (9.2, 10), (9.0, 5), (50, 50), (46, 50), (999, 200)]
)
def test_nearest_rate(reports_hz, rate_hz):
    assert nearest_rate_hz(reports_hz) == rate_hz


@pytest.mark.parametrize("wrong", [{"sample_rate_hz": 0}, {"gap_s": -1.0}, {"stale_s": math.nan}, {"phase": 1.0}])
def test_wrong_argument_is_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        ThrusterAligner(**wrong)


@given(jitter=jitter, rate_hz=st.sampled_from(RATES_HZ), fraction=st.floats(-1, 1), rpm=st.floats(-4000, 4000))
def test_constant_signal_gives_the_same_samples_whatever_the_jitter(jitter, rate_hz, fraction, rpm):
    period_s = 1.0 / rate_hz
    aligner = ThrusterAligner(sample_rate_hz=rate_hz, gap_s=5.0, stale_s=9.0)
    start_s = 1.7e9
    times_s = [start_s + (n + shift) * period_s for n, shift in enumerate(jitter, start=2)]
    events = [("command", start_s, fraction)]
    for time_s in times_s:
        events += [("command", time_s, fraction), ("report", time_s, rpm)]
    samples = play(aligner, events)
    assert {(s.command, s.speed_rpm) for s in samples} == {(fraction, rpm)}
    indices = [round(s.time_s * rate_hz) for s in samples]
    assert indices == list(range(indices[0], indices[0] + len(indices)))
    assert [s.time_s for s in samples] == [index / rate_hz for index in indices]
    assert len(samples) >= len(jitter) - 2


finite = st.floats(-1e6, 1e6)
event = st.one_of(
    st.tuples(st.just("command"), st.one_of(any_float, st.floats(0, 20)), any_float),
    st.tuples(st.just("report"), st.one_of(any_float, st.floats(0, 20)), st.one_of(st.none(), any_float), any_float),
)


@given(events=st.lists(event, max_size=80), rate_hz=st.sampled_from((None, 1, 7.5, 200)))
def test_never_raises_and_samples_advance_on_the_grid(events, rate_hz):
    aligner = ThrusterAligner(sample_rate_hz=rate_hz)
    samples = play(aligner, events)
    times_s = [s.time_s for s in samples]
    assert times_s == sorted(set(times_s))
    if rate_hz is not None:
        assert all(time_s == round(time_s * rate_hz) / rate_hz for time_s in times_s)


@given(events=st.lists(event, max_size=60), cut=st.integers(0, 60))
def test_pickled_and_resumed_goes_on_the_same(events, cut):
    whole = ThrusterAligner(sample_rate_hz=10)
    first = ThrusterAligner(sample_rate_hz=10)
    expected = play(whole, events)
    samples = play(first, events[:cut])
    samples += play(pickle.loads(pickle.dumps(first)), events[cut:])  # noqa: S301
    assert repr(samples) == repr(expected)


def streamed(interval_s: float, until_s: float, aligner: ThrusterAligner, from_s: float = 0.0) -> list:
    """RPM 50 times a second, and commands as often as that."""
    samples, told_s = [], from_s
    for n in range(round((until_s - from_s) * 50)):
        time_s = from_s + n / 50
        if time_s >= told_s - 1e-9:
            aligner.command(time_s, 0.5)
            told_s += interval_s
        samples += aligner.report(time_s + 0.005, 1000.0)
    return samples


@pytest.mark.parametrize("interval_s", [0.2, 0.5, 1.0])
def test_streamed_commands_that_become_rare_are_not_known(interval_s):
    aligner = ThrusterAligner(20.0, streamed=True)
    assert len(streamed(0.05, 5.0, aligner)) > 90 and not aligner.slow
    rare = streamed(interval_s, 15.0, aligner, from_s=5.0)
    assert aligner.slow
    assert all((sample.time_s + 1e-6) % interval_s <= 0.16 for sample in rare)  # just after each, and no longer
    assert len(streamed(0.05, 20.0, aligner, from_s=15.0)) > 90 and not aligner.slow


def test_streamed_commands_that_were_never_frequent_explain_nothing():
    aligner = ThrusterAligner(20.0, streamed=True)
    streamed(0.5, 15.0, aligner)
    assert aligner.slow and streamed(0.5, 20.0, aligner, from_s=15.0) == []


def test_commands_on_a_bus_hold_as_long_as_they_are_told_to():
    aligner = ThrusterAligner(20.0)
    streamed(0.05, 5.0, aligner)
    assert len(streamed(0.5, 10.0, aligner, from_s=5.0)) > 90 and not aligner.slow


def test_one_streamed_command_that_is_lost_changes_nothing():
    aligner = ThrusterAligner(20.0, streamed=True)
    streamed(0.05, 5.0, aligner)
    assert len(streamed(0.1, 5.3, aligner, from_s=5.05)) >= 4 and not aligner.slow

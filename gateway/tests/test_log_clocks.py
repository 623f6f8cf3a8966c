"""Clocks of logs of one dive: known offsets are found, of logs of different dives nothing is claimed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import Attitude, ThrusterCommand, ThrusterReport
from gateway.replay.log_clocks import FoundBy, LogOffset, log_offset
from gateway.replay.log_trace import LogTrace

THRUSTERS = 6
GOOD_S = 0.02


class Dive:
    """What a pilot did: six thrusters follow three sticks, which are moved now and then."""

    def __init__(self, seed: int, span_s: float, pause_s: tuple[float, float] = (0.5, 6.0)) -> None:
        random = np.random.default_rng(seed)
        self.at_s = np.cumsum(random.uniform(*pause_s, int(span_s / pause_s[0]) + 2))
        sticks = random.choice([0.0, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0], (len(self.at_s), 3))
        self.command = np.clip(sticks @ random.choice([-0.5, 0.5], (3, THRUSTERS)), -1.0, 1.0)
        self.span_s = span_s

    def commands(self, time_s: np.ndarray) -> np.ndarray:
        """(N, 6) held from one movement to the next."""
        return self.command[np.clip(np.searchsorted(self.at_s, time_s, side="right"), 0, len(self.at_s) - 1)]

    def speeds(self, time_s: np.ndarray) -> np.ndarray:
        """(N, 6) rpm, 0.1 s behind the commands."""
        grid_s = np.arange(-1.0, self.span_s, 0.01)
        share = 1.0 - np.exp(-0.01 / 0.1)
        rpm, now = np.empty((len(grid_s), THRUSTERS)), np.zeros(THRUSTERS)
        for row, wanted in enumerate(3000.0 * self.commands(grid_s)):
            now = now + share * (wanted - now)
            rpm[row] = now
        return np.column_stack([np.interp(time_s, grid_s, column) for column in rpm.T])


def stamps(random: np.random.Generator, rate_hz: float, begin_s: float, end_s: float, loss: float) -> np.ndarray:
    """Uneven times of which some are missing."""
    time_s = np.arange(begin_s, end_s, 1.0 / rate_hz)
    time_s = np.sort(time_s + random.uniform(-0.2, 0.2, len(time_s)) / rate_hz)
    return time_s[random.random(len(time_s)) > loss]


def commanded(dive: Dive, rate_hz: float, *, seed: int, ahead_s: float = 0.0, drift: float = 0.0, part=(0.0, 1.0)):
    """A log of the commands whose clock is ahead of the dive's."""
    random = np.random.default_rng(seed)
    time_s = stamps(random, rate_hz, part[0] * dive.span_s, part[1] * dive.span_s, loss=0.03)
    fractions = np.round(dive.commands(time_s) * 400.0) / 400.0
    trace, own_s = LogTrace(), (time_s + ahead_s) * (1.0 + drift)
    rows = np.arange(len(time_s))
    trace.take_block(
        ReadingBlock(tuple(CommandColumns(n + 1, rows, own_s, fractions[:, n]) for n in range(THRUSTERS)))
    )
    return trace


def error_s(found: LogOffset, ahead_s: float, drift: float = 0.0, span_s: float = 1.0) -> float:
    """The largest error over a dive."""
    dive_s = np.linspace(0.0, span_s, 5)
    return max(
        abs(found.time_s(float(own_s)) - at_s)
        for at_s, own_s in zip(dive_s, (dive_s + ahead_s) * (1.0 + drift), strict=True)
    )


@settings(max_examples=6, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    rates=st.tuples(st.sampled_from([10.0, 50.0]), st.sampled_from([10.0, 50.0])),
    ahead_s=st.floats(-20_000.0, 20_000.0),
    begin=st.floats(0.0, 0.4),
)
def test_commands_tell_the_offset(seed, rates, ahead_s, begin):
    dive = Dive(seed, 240.0)
    one = commanded(dive, rates[0], seed=seed + 1, part=(0.0, 0.9))
    other = commanded(dive, rates[1], seed=seed + 2, ahead_s=ahead_s, part=(begin, 1.0))
    found = log_offset(one, other)
    assert found is not None
    assert found.found_by is FoundBy.COMMANDS
    assert error_s(found, ahead_s, span_s=240.0) < GOOD_S
    assert found.overlap_s > 60.0
    assert found.margin > 2.0


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6), rate_hz=st.sampled_from([2.0, 4.0]))
def test_slow_streams_tell_it_less_exactly_and_say_so(seed, rate_hz):
    dive = Dive(seed, 240.0)
    found = log_offset(commanded(dive, 50.0, seed=1), commanded(dive, rate_hz, seed=2, ahead_s=60.0))
    assert found is not None
    assert error_s(found, 60.0) < GOOD_S + 1.5 * found.error_s
    assert found.error_s < 0.5 / rate_hz


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6), span_s=st.sampled_from([40.0, 120.0, 600.0]), slow=st.booleans())
def test_nothing_is_claimed_of_different_dives(seed, span_s, slow):
    pauses = (4.0, 30.0) if slow else (0.5, 6.0)
    one = commanded(Dive(seed, span_s, pauses), 50.0, seed=1)
    other = commanded(Dive(seed + 1, span_s, pauses), 10.0, seed=2)
    assert log_offset(one, other) is None


def test_nothing_is_claimed_of_what_repeats_itself():
    dive = Dive(5, 300.0)
    dive.at_s = np.arange(len(dive.at_s)) * 2.0
    dive.command = np.tile(dive.command[:4], (len(dive.at_s) // 4 + 1, 1))[: len(dive.at_s)]
    one, other = commanded(dive, 50.0, seed=1), commanded(dive, 10.0, seed=2, part=(0.3, 0.7))
    assert log_offset(one, other) is None


def test_a_dive_without_manoeuvres_tells_nothing():
    dive = Dive(5, 120.0)
    dive.command[:] = dive.command[0]
    assert log_offset(commanded(dive, 50.0, seed=1), commanded(dive, 10.0, seed=2)) is None
    assert log_offset(LogTrace(), commanded(dive, 10.0, seed=2)) is None


def test_drift_of_the_clocks_over_an_hour_is_followed():
    dive, drift = Dive(7, 3600.0, (2.0, 12.0)), -50e-6
    one = commanded(dive, 20.0, seed=1)
    other = commanded(dive, 10.0, seed=2, ahead_s=5000.0, drift=drift)
    found = log_offset(one, other)
    assert found is not None
    assert error_s(found, 5000.0, drift, 3600.0) < GOOD_S
    assert found.drift == pytest.approx(-drift, abs=5e-6)


def test_speeds_stand_in_for_commands():
    dive = Dive(11, 240.0)
    traces = []
    for rate_hz, ahead_s, seed in ((50.0, 0.0, 1), (10.0, 777.7, 2)):
        random = np.random.default_rng(seed)
        time_s = stamps(random, rate_hz, 0.0, 240.0, loss=0.03)
        rpm = dive.speeds(time_s) + random.normal(0.0, 10.0, (len(time_s), THRUSTERS))
        trace, nothing = LogTrace(), np.full(len(time_s), np.nan)
        columns = [
            ReportColumns(n + 1, np.arange(len(time_s)), time_s + ahead_s, rpm[:, n], *[nothing] * 4)
            for n in range(THRUSTERS)
        ]
        trace.take_block(ReadingBlock(reports=tuple(columns)))
        traces.append(trace)
    found = log_offset(*traces)
    assert found is not None
    assert found.found_by is FoundBy.SPEEDS
    assert error_s(found, 777.7) < GOOD_S


def attitudes(seed: int, boot_s: np.ndarray, arrival_s: np.ndarray) -> list[Attitude]:
    """What an autopilot stamped of a vehicle that moves by `seed`."""
    random = np.random.default_rng(seed)
    angles = np.zeros((len(boot_s), 3))
    for axis, size in enumerate((0.05, 0.08, 2.0)):
        for period_s in random.uniform(5.0, 60.0, 6):
            angles[:, axis] += size / 6.0 * np.sin(2.0 * np.pi * boot_s / period_s + random.uniform(0.0, 6.0))
    rows = zip(arrival_s.tolist(), angles.tolist(), boot_s.tolist(), strict=True)
    return [Attitude(at_s, *angle, 0.0, 0.0, 0.0, since_s) for at_s, angle, since_s in rows]


def heard(seed: int, span_s: float, rate_hz: float, ahead_s: float, *, drift: float = 0.0, delay_s: float = 0.0):
    """A log whose clock is ahead of the autopilot's, on a link with delays."""
    random = np.random.default_rng(99)
    boot_s = stamps(random, rate_hz, 10.0, 10.0 + span_s, loss=0.05)
    delays_s = random.exponential(delay_s, len(boot_s)) if delay_s else np.zeros(len(boot_s))
    return attitudes(seed, np.round(boot_s, 3), boot_s + ahead_s + drift * boot_s + delays_s)


def traced(*parts: list[Attitude]) -> LogTrace:
    trace = LogTrace()
    for part in parts:
        trace.take(part)
    return trace


@settings(max_examples=6, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    ahead_s=st.sampled_from([0.0, 1.7e9, -40.0]),
    rates=st.tuples(st.sampled_from([4.0, 10.0]), st.sampled_from([10.0, 25.0])),
    delay_s=st.sampled_from([0.001, 0.02, 0.05]),
)
def test_the_autopilots_stamps_tell_the_offset(seed, ahead_s, rates, delay_s):
    reference = traced(heard(seed, 120.0, rates[0], ahead_s, delay_s=delay_s))
    found = log_offset(reference, traced(heard(seed, 60.0, rates[1], 0.0)))
    assert found is not None
    assert (found.found_by, found.margin) == (FoundBy.BOOT, None)
    assert found.time_s(50.0) == pytest.approx(50.0 + ahead_s, abs=GOOD_S)


def test_the_autopilots_stamps_tell_the_drift_over_an_hour():
    reference = traced(heard(3, 3600.0, 4.0, 1.7e9, drift=50e-6, delay_s=0.02))
    found = log_offset(reference, traced(heard(3, 3600.0, 10.0, 0.0)))
    assert found is not None
    assert found.drift == pytest.approx(50e-6, abs=2e-6)
    for boot_s in (100.0, 1800.0, 3500.0):
        assert found.time_s(boot_s) == pytest.approx(1.7e9 + boot_s * (1.0 + 50e-6), abs=GOOD_S)


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_stamps_of_another_start_are_not_taken_for_those_of_this(seed):
    reference = traced(heard(seed, 120.0, 10.0, 1.7e9, delay_s=0.01))
    assert log_offset(reference, traced(heard(seed + 1, 120.0, 10.0, 0.0))) is None


def test_of_several_starts_in_one_log_the_right_one_is_found():
    before = heard(1, 60.0, 10.0, 1000.0)
    after = heard(2, 60.0, 10.0, 1100.0)
    found = log_offset(traced(before, after), traced(heard(2, 60.0, 10.0, 0.0)))
    assert found is not None
    assert found.time_s(20.0) == pytest.approx(1120.0, abs=1e-3)


def test_readings_and_blocks_of_them_leave_the_same_trace():
    commands = [ThrusterCommand(float(n), 1, n / 10.0) for n in range(5)]
    reports = [ThrusterReport(float(n), 1, -100.0 * n) for n in range(5)]
    one, other = LogTrace(), LogTrace()
    one.take([*commands, *reports, ThrusterReport(9.0, 1)])
    row, nothing = np.arange(5), np.full(5, np.nan)
    time_s = np.arange(5.0)
    other.take_block(
        ReadingBlock(
            (CommandColumns(1, row, time_s, row / 10.0),),
            (ReportColumns(1, row, time_s, -100.0 * row, *[nothing] * 4),),
        )
    )
    for mine, its in ((one.commands(), other.commands()), (one.speeds(), other.speeds())):
        assert mine.keys() == its.keys() == {1}
        np.testing.assert_array_equal(mine[1].value, its[1].value)
        np.testing.assert_array_equal(mine[1].time_s, its[1].time_s)

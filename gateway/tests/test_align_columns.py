"""Whole columns give the samples, and leave the aligner, as reading by reading, bit for bit."""

from __future__ import annotations

import pickle
from itertools import pairwise
from math import isnan, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.reading_block import CommandColumns, ReportColumns
from gateway.align import ThrusterAligner
from gateway.align_columns import align_columns

RATE_HZ = 50.0
EPOCH_S = 1_700_000_000.0

STEPS = st.sampled_from([0.0, 0.001, 0.005, 0.0125, 0.02, 0.02, 0.02, 0.021, 0.1, 0.6, 6.0])
VALUES = st.one_of(st.just(nan), st.floats(-1.0, 1.0))


@st.composite
def events(draw):
    """("command", time, fraction) and ("report", time, rpm, volts, amperes), in the order of their arrival."""
    time_s, happened = EPOCH_S, []
    for _ in range(draw(st.integers(0, 60))):
        time_s += draw(STEPS)
        if draw(st.booleans()):
            happened.append(("command", time_s, draw(st.floats(-1.0, 1.0))))
        else:
            happened.append(("report", time_s, draw(VALUES), draw(VALUES), draw(VALUES)))
    return happened


def columns(happened):
    commands = [one for one in happened if one[0] == "command"]
    reports = [one for one in happened if one[0] == "report"]
    numbers = np.array([one[1:] for one in reports]).reshape(-1, 4)
    unknown = np.full(len(reports), nan)
    before = [sum(one[0] == "command" for one in happened[:row]) for row, one in enumerate(happened)]
    return (
        CommandColumns(
            1,
            np.arange(len(commands)),
            np.array([one[1] for one in commands], dtype=float),
            np.array([one[2] for one in commands], dtype=float),
        ),
        ReportColumns(1, np.arange(len(reports)), *numbers.T, unknown, unknown),
        np.array([count for count, one in zip(before, happened, strict=True) if one[0] == "report"], dtype=np.intp),
    )


def one_by_one(aligner, happened):
    samples = []
    for kind, time_s, *values in happened:
        if kind == "command":
            aligner.command(time_s, *values)
        else:
            samples += aligner.report(time_s, *(None if isnan(value) else value for value in values))
    return [(one.time_s, one.command, one.speed_rpm, one.voltage_v, one.current_a) for one in samples]


def at_once(aligner, happened):
    samples = align_columns(aligner, *columns(happened))
    if samples is None:
        return None
    rows = zip(
        *(
            column.tolist()
            for column in (samples.time_s, samples.command, samples.speed_rpm, samples.voltage_v, samples.current_a)
        ),
        strict=True,
    )
    return [tuple(None if isnan(value) else value for value in row) for row in rows]


def strictly_rising(happened):
    times_s = [one[1] for one in happened if one[0] == "report" and not isnan(one[2])]
    return all(earlier < later for earlier, later in pairwise(times_s))


@given(events(), events(), st.sampled_from([0.0, 0.25, 0.99]))
def test_columns_are_the_readings_one_by_one(first, second, phase):
    shift_s = first[-1][1] - EPOCH_S + 0.02 if first else 0.0
    second = [(kind, time_s + shift_s, *values) for kind, time_s, *values in second]
    slow, fast = ThrusterAligner(RATE_HZ, phase=phase), ThrusterAligner(RATE_HZ, phase=phase)
    for part in (first, second):
        before = pickle.dumps(fast)
        got = at_once(fast, part)
        wanted = one_by_one(slow, part)
        if got is None:
            assert not strictly_rising(part)
            assert pickle.dumps(fast) == before
            got = one_by_one(fast, part)
        assert got == wanted
    assert fast.speed == slow.speed
    assert fast.last_index == slow.last_index
    assert (fast.voltage.newest, fast.current.newest) == (slow.voltage.newest, slow.current.newest)


@pytest.mark.parametrize(
    "happened",
    [
        [("command", EPOCH_S - 1.0, 0.5)],
        [("command", EPOCH_S + 1.0, nan)],
        [("report", EPOCH_S + 1.0, np.inf, nan, nan)],
        [("report", EPOCH_S - 1.0, 900.0, nan, nan)],
    ],
    ids=["late command", "no command", "no speed", "late speed"],
)
def test_what_is_not_regular_is_left_to_the_aligner_itself(happened):
    aligner = ThrusterAligner(RATE_HZ)
    one_by_one(aligner, [("command", EPOCH_S, 0.5), ("report", EPOCH_S, 900.0, nan, nan)])
    before = pickle.dumps(aligner)
    assert at_once(aligner, happened) is None
    assert pickle.dumps(aligner) == before


@pytest.mark.parametrize("aligner", [ThrusterAligner(), ThrusterAligner(RATE_HZ, streamed=True)])
def test_while_something_is_learnt_from_each_reading_columns_are_refused(aligner):
    assert at_once(aligner, [("command", EPOCH_S, 0.5)]) is None

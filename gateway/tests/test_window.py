"""Which part of a dive is told."""

from __future__ import annotations

from datetime import UTC, datetime
from math import inf

import numpy as np
import pytest

from drivers.reading_block import ReadingBlock
from drivers.readings import OwnClock
from gateway.replay.window import Instant, Span, Window, cut
from gateway.stretches.stretch import BlockArrival, Stretch

BEGIN_S = datetime(2026, 11, 22, 14, 5, 30, tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    ("text", "since_s"),
    [
        ("0", 0.0),
        ("90", 90.0),
        ("90.5", 90.5),
        ("5:00", 300.0),
        ("1:02:03.5", 3723.5),
        ("100:00", 6000.0),
        ("14:05:00", 50_700.0),  # no clock
        ("14:06:00Z", 30.0),
        ("14:06Z", 30.0),
        ("14:05:30.25Z", 0.25),
        ("14:05:00Z", 86_370.0),  # it is the next day by then
        ("2026-11-22T14:05:40Z", 10.0),
        ("2026-11-22 14:05:20Z", -10.0),
    ],
)
def test_times_as_people_write_them(text, since_s):
    assert Instant.of(text).after(BEGIN_S) - BEGIN_S == pytest.approx(since_s)


@pytest.mark.parametrize("text", ["", "5:", "-3", "1:2:3:4", "24:00Z", "2026-13-01T10:00Z", "x"])
def test_anything_else_is_refused_with_the_way_out(text):
    with pytest.raises(ValueError, match="1:02:03"):
        Instant.of(text)


def test_a_window_that_ends_before_it_begins_is_refused():
    with pytest.raises(ValueError, match=r"--from lies 10\.0 s behind --to"):
        Window(Instant.of("60"), Instant.of("50")).of(BEGIN_S)


def test_without_bounds_it_is_all():
    assert Window().whole
    assert Window().of(BEGIN_S) == Span(-inf, inf)
    assert not Window(Instant.of("5")).whole


def arrival(link: str, times_s: list[float], places: list[float] | None = None) -> BlockArrival:
    block = ReadingBlock.of([OwnClock(time_s) for time_s in times_s])
    return BlockArrival(link, block, None if places is None else np.array(places, dtype=float))


def order(arrivals: list[BlockArrival]) -> list[tuple[str, float]]:
    return [(link, reading.time_s) for _, link, reading in Stretch.of(arrivals).readings()]


@pytest.mark.parametrize("time_s", [-inf, 0.5, 2.0, 2.5, 9.0, inf])
@pytest.mark.parametrize("placed", [False, True])
def test_both_parts_together_are_the_whole_in_its_order(time_s, placed):
    whole = [
        arrival("a", [1.0, 2.0, 1.5, 4.0], [1, 4, 5, 9] if placed else None),
        arrival("b", [0.9, 2.1, 3.0], [2, 3, 8] if placed else None),
    ]
    before, after = cut(whole, time_s)
    assert order(before) + order(after) == order(whole)
    assert all(told_s < time_s for _, told_s in order(before))
    assert not after or max(told_s for _, told_s in order(after)) >= time_s


def test_of_a_recording_it_is_cut_at_one_place():
    """What another link brought late stays in front of what it was judged in front of."""
    whole = [arrival("a", [1.0, 5.0, 6.0], [1, 2, 5]), arrival("b", [4.9, 5.5], [3, 4])]
    before, after = cut(whole, 5.0)
    assert order(before) == [("a", 1.0)]
    assert order(after) == [("a", 5.0), ("b", 4.9), ("b", 5.5), ("a", 6.0)]

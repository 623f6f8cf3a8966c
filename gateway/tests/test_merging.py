"""Logs on one time line: all readings, in the order of time, however they were cut."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.reading_block import ReadingBlock
from drivers.readings import LinkState
from gateway.replay.merging import stretches


def block(link: str, times_s: list[float]) -> tuple[str, ReadingBlock]:
    return link, ReadingBlock.of([LinkState(time_s, link, True, "") for time_s in times_s])


def taken(logs: list, length_s: float) -> list[list[tuple[str, list[float]]]]:
    return [
        [(one.link, [reading.time_s for reading in one.readings.readings()]) for one in arrivals]
        for arrivals in stretches(logs, length_s)
    ]


def test_links_of_a_log_that_come_one_after_the_other_are_cut_together():
    log = [block("can0", [0.0, 9.0]), block("can1", [1.0, 8.0]), block("can0", [11.0]), block("can1", [12.0])]
    assert taken([log], 10.0) == [
        [("can0", [0.0, 9.0]), ("can1", [1.0, 8.0])],
        [("can0", [11.0]), ("can1", [12.0])],
    ]


def test_logs_that_begin_at_different_times_are_on_one_line():
    late = [block("mavlink", [25.0, 26.0])]
    early = [block("can0", [0.0, 5.0]), block("can0", [24.0, 31.0])]
    assert taken([late, early], 10.0) == [
        [("can0", [0.0, 5.0])],
        [("mavlink", [25.0, 26.0]), ("can0", [24.0, 31.0])],
    ]


def test_a_time_that_runs_backwards_stays_with_those_before_it():
    assert taken([[block("can0", [0.0, 12.0, 3.0, 13.0, 23.0])]], 10.0) == [
        [("can0", [0.0])],
        [("can0", [12.0, 3.0, 13.0])],
        [("can0", [23.0])],
    ]


@given(st.lists(st.lists(st.lists(st.floats(0.0, 100.0), max_size=8), max_size=6), max_size=3), st.floats(0.5, 30.0))
def test_nothing_is_lost_and_every_link_keeps_its_order(logs, length_s):
    numbered = [[block(f"can{n}", times_s) for times_s in log] for n, log in enumerate(logs)]
    found: dict[str, list[float]] = {}
    for arrivals in taken(numbered, length_s):
        assert arrivals
        for link, times_s in arrivals:
            found.setdefault(link, []).extend(times_s)
    wanted = {f"can{n}": [time_s for times_s in log for time_s in times_s] for n, log in enumerate(logs)}
    assert found == {link: times_s for link, times_s in wanted.items() if times_s}


def test_a_link_in_two_logs_is_refused():
    with pytest.raises(ValueError, match="can0 is in two logs"):
        taken([[block("can0", [0.0])], [block("can0", [1.0])]], 10.0)


def test_nothing_is_read_that_is_not_needed_yet():
    read = []

    def log():
        for time_s in range(0, 1000, 5):
            read.append(time_s)
            yield block("can0", [float(time_s)])

    next(stretches([log()], 20.0))
    assert read[-1] <= 45

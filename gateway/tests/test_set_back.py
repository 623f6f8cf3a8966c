"""A log's clock that is set back: all that follows goes on, and two links of it stay together."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.reading_block import ReadingBlock
from drivers.readings import LinkState
from gateway.replay.set_back import LogClock, SetBack


def block(link: str, *times_s: float) -> tuple[str, ReadingBlock]:
    return link, ReadingBlock.of([LinkState(time_s, link, True, "") for time_s in times_s])


def going_on(*blocks: tuple[str, ReadingBlock]) -> tuple[dict[str, list[float]], list[SetBack]]:
    clock, found = LogClock(), {}
    for link, part in clock.going_on(blocks):
        found.setdefault(link, []).extend(one.time_s for one in part.readings())
    return found, clock.set_back


def test_times_as_they_should_be_stay():
    found, set_back = going_on(block("can0", 1.0, 2.0, 1.5), block("can1", 0.5), block("can0", 900.0))
    assert found == {"can0": [1.0, 2.0, 1.5, 900.0], "can1": [0.5]}
    assert not set_back


@pytest.mark.parametrize("cut", range(5))
def test_what_follows_goes_on_wherever_blocks_end(cut):
    times_s = [100.0, 101.0, 41.0, 42.0, 43.0]
    found, set_back = going_on(block("can0", *times_s[:cut]), block("can0", *times_s[cut:]))
    assert found == {"can0": [100.0, 101.0, 101.0, 102.0, 103.0]}
    assert set_back == [SetBack(101.0, 60.0)]


def test_links_of_one_log_stay_together():
    """The second one is seldom heard: by itself it would be 0.9 s off."""
    found, set_back = going_on(
        block("can0", 100.0, 101.0, 41.1, 42.0), block("can1", 100.1, 41.2), block("can0", 43.0), block("can1", 43.2)
    )
    assert found["can0"] == pytest.approx([100.0, 101.0, 101.0, 101.9, 102.9])
    assert found["can1"] == pytest.approx([100.1, 101.1, 103.1])
    assert len(set_back) == 1


def test_set_twice_it_goes_on_twice():
    found, set_back = going_on(block("can0", 100.0, 50.0, 51.0, 1.0, 2.0), block("can1", 100.0, 50.0, 51.0, 1.0, 2.0))
    assert found["can0"] == found["can1"] == [100.0, 100.0, 101.0, 101.0, 102.0]
    assert set_back == [SetBack(100.0, 50.0), SetBack(51.0, 50.0)]


@given(st.lists(st.lists(st.floats(0.0, 1e4), min_size=1, max_size=6), max_size=6))
def test_nothing_is_lost_and_time_goes_on(several):
    found, _ = going_on(*(block("can0", *times_s) for times_s in several))
    times_s = found.get("can0", [])
    assert len(times_s) == sum(map(len, several))
    assert all(later >= max(times_s[:n], default=0.0) - 2.001 for n, later in enumerate(times_s))

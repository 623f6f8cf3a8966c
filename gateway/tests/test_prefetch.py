"""Items made in advance: all of them, in their order; errors where they are used; no thread left behind."""

from __future__ import annotations

import threading

import pytest

from gateway.replay.prefetch import prefetched


def fetching() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "prefetch"]


def test_all_items_come_in_their_order():
    assert list(prefetched(range(100))) == list(range(100))
    assert list(prefetched([])) == []
    assert fetching() == []


def test_an_error_comes_after_the_items_before_it():
    def items():
        yield 1
        raise OSError("the disk is gone")

    got = []
    with pytest.raises(OSError, match="the disk is gone"):
        for item in prefetched(items()):
            got.append(item)  # noqa: PERF402
    assert got == [1]
    assert fetching() == []


def test_no_more_are_made_in_advance_than_wanted():
    made, enough = [], threading.Event()

    def items():
        for number in range(1000):
            made.append(number)
            if number == 3:
                enough.set()
            yield number

    several = prefetched(items(), ahead=2)
    assert next(several) == 0
    assert enough.wait(10.0)
    several.close()
    assert made == [0, 1, 2, 3]
    assert fetching() == []

"""Calls in a thread: nobody waits for one that hangs, and nothing that it opens late is left open."""

import asyncio
import threading
import time

import pytest

from drivers.can.bus import CanLink
from drivers.can.hanging import in_thread
from drivers.can.tests.link_listener import until
from drivers.clock import Clock


async def test_result_and_exception_come_from_the_thread():
    assert await in_thread(threading.get_ident) != threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        await in_thread(lambda: 1 // 0)


class Adapter:
    """An adapter that hangs when it is opened and closed, until it is let go."""

    def __init__(self) -> None:
        self.go, self.opening, self.closing = threading.Event(), threading.Event(), threading.Event()
        self.closed = False

    def open(self, *_):
        self.opening.set()
        assert self.go.wait(10.0)
        return self

    async def receive(self):
        await asyncio.Event().wait()

    def close(self):
        self.closing.set()
        assert self.go.wait(10.0)
        self.closed = True


async def cancelled_within_s(task: asyncio.Task) -> float:
    start_s = time.monotonic()
    task.cancel()
    await asyncio.wait([task])
    assert task.cancelled()
    return time.monotonic() - start_s


@pytest.fixture
def adapter():
    adapter = Adapter()
    yield adapter
    adapter.go.set()


@pytest.fixture
def link(adapter):
    return CanLink("can a", "virtual", "x", [], Clock(), open_port=adapter.open)


async def test_a_link_whose_adapter_hangs_while_it_is_opened_ends_at_once_and_closes_it_late(adapter, link):
    task = asyncio.create_task(link.run(lambda frames: None, lambda state: None))
    await until(adapter.opening.is_set)
    assert await cancelled_within_s(task) < 0.3
    adapter.go.set()
    await until(lambda: adapter.closed)


async def test_a_link_whose_adapter_hangs_while_it_is_closed_ends_soon(adapter, link):
    adapter.go.set()
    states = []
    task = asyncio.create_task(link.run(lambda frames: None, states.append))
    await until(lambda: states)
    adapter.go.clear()
    assert 0.4 < await cancelled_within_s(task) < 1.0
    assert adapter.closing.is_set() and not adapter.closed


async def test_a_result_that_comes_in_the_moment_of_the_cancellation_is_abandoned():
    abandoned = []
    task = asyncio.create_task(in_thread(lambda: "port", abandoned.append))
    await asyncio.sleep(0)
    # the loop is held until the thread has spoken: its result is next, and we are cancelled right after it
    time.sleep(0.05)  # noqa: ASYNC251
    asyncio.get_running_loop().call_soon(task.cancel)
    await asyncio.wait([task])
    assert task.cancelled()
    await until(lambda: abandoned)
    assert abandoned == ["port"]


def test_a_result_that_comes_after_the_loop_has_ended_is_abandoned():
    abandoned, go, done = [], threading.Event(), threading.Event()

    def slow() -> str:
        go.wait(10.0)
        return "port"

    def abandon(result: str) -> None:
        abandoned.append(result)
        done.set()

    async def cut_short() -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.01):
                await in_thread(slow, abandon)

    asyncio.run(cut_short())
    go.set()
    assert done.wait(5.0) and abandoned == ["port"]

import asyncio
import socket
import time

import pytest

from hil_tests.playback.virtual_time import START_S, run_in_virtual_time


def test_whoever_sleeps_is_woken_at_once_and_the_clock_has_gone_on():
    async def work(clock):
        began_s = time.monotonic()
        await asyncio.sleep(3600.0)
        return clock.now(), time.monotonic() - began_s

    virtual_s, real_s = run_in_virtual_time(work)
    assert virtual_s == pytest.approx(START_S + 3600.0)
    assert real_s < 60.0


def test_tasks_wake_in_the_order_of_their_times():
    async def work(clock):
        woken = []

        async def sleeper(seconds):
            await asyncio.sleep(seconds)
            woken.append((seconds, clock.now()))

        async with asyncio.TaskGroup() as group:
            for seconds in (0.3, 0.1, 0.2):
                group.create_task(sleeper(seconds))
        return woken

    assert run_in_virtual_time(work) == [(s, pytest.approx(START_S + s)) for s in (0.1, 0.2, 0.3)]


def test_time_limits_hold_in_virtual_time():
    async def work(clock):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(5.0):
                await asyncio.Event().wait()
        return clock.now()

    assert run_in_virtual_time(work) == pytest.approx(START_S + 5.0)


def test_work_for_threads_takes_no_time_and_its_errors_come_to_who_waits():
    async def work(clock):
        assert await asyncio.to_thread(sum, [1, 2]) == 3
        with pytest.raises(ZeroDivisionError):
            await asyncio.to_thread(divmod, 1, 0)
        return clock.now()

    assert run_in_virtual_time(work) == START_S


def test_sockets_are_real():
    async def work(clock):
        one, other = socket.socketpair()
        with one, other:
            one.setblocking(False)
            other.send(b"here")
            return await asyncio.get_running_loop().sock_recv(one, 10)

    assert run_in_virtual_time(work) == b"here"


def test_nothing_left_to_wait_for_is_said_and_does_not_hang():
    async def work(clock):
        await asyncio.Event().wait()

    with pytest.raises(RuntimeError, match="nothing in virtual time can bring about"):
        run_in_virtual_time(work)


def test_stamps_are_whole_microseconds():
    async def work(clock):
        stamps = []
        for _ in range(50):
            await asyncio.sleep(0.0123456789)
            stamps.append(clock.now())
        return stamps

    assert all(stamp == round(1e6 * stamp) / 1e6 for stamp in run_in_virtual_time(work))

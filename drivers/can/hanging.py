"""Calls that may hang, as drivers of adapters do: each in a thread of its own, that nothing waits for at the end."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import TypeVar

ResultT = TypeVar("ResultT")


def _nothing(_late: object) -> None:
    """For results that hold nothing."""


async def in_thread(call: Callable[[], ResultT], abandon: Callable[[ResultT], None] = _nothing) -> ResultT:
    """Calls it in a daemon thread: an event loop, or a program, that ends does not wait for it.

    Args:
        call: what may hang.
        abandon: gets its result where that comes after we were cancelled; in a thread, too.

    Raises:
        Exception: what the call raises.
    """
    loop = asyncio.get_running_loop()
    coming: asyncio.Future[ResultT] = loop.create_future()

    def work() -> None:
        try:
            result = call()
        except Exception as error:  # goes on where the call is awaited
            _tell(loop, _fail, coming, error)
        else:
            if not _tell(loop, _arrive, coming, result, abandon):
                abandon(result)

    threading.Thread(target=work, name="may hang", daemon=True).start()
    try:
        return await coming
    except asyncio.CancelledError:
        if not coming.cancelled() and coming.exception() is None:  # it came in the same moment
            _leave(coming.result(), abandon)
        raise


def _tell(loop: asyncio.AbstractEventLoop, callback: Callable[..., None], *arguments: object) -> bool:
    try:
        loop.call_soon_threadsafe(callback, *arguments)
    except RuntimeError:  # the loop has ended meanwhile
        return False
    return True


def _fail(coming: asyncio.Future[ResultT], error: Exception) -> None:
    if not coming.done():
        coming.set_exception(error)


def _arrive(coming: asyncio.Future[ResultT], result: ResultT, abandon: Callable[[ResultT], None]) -> None:
    if coming.done():
        _leave(result, abandon)
    else:
        coming.set_result(result)


def _leave(result: ResultT, abandon: Callable[[ResultT], None]) -> None:
    threading.Thread(target=abandon, args=(result,), name="may hang", daemon=True).start()

"""An event loop whose time is virtual: whoever sleeps is woken at once, and the clock has gone on by so much.

All that the gateway consists of runs in it unchanged: its tasks, its sleeps, its time limits. A mission of minutes
takes seconds, and the same mission takes the same course each time: nothing depends on how fast this machine is.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from typing import Any, TypeVar

from drivers.clock import Clock

T = TypeVar("T")
# No time of any recording, and easy to recognise: 14 November 2023, 22:13:20 UTC
START_S = 1_700_000_000.0


class _Selector(selectors.SelectSelector):
    """Looks at the sockets, but never waits for them: it has the time go on instead."""

    def __init__(self, pass_time: Callable[[float], None]) -> None:
        super().__init__()
        self._pass_time = pass_time

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0.0)
        if not ready and timeout is None:
            raise RuntimeError("all tasks wait for something that nothing in virtual time can bring about")
        if not ready and timeout is not None:
            self._pass_time(timeout)
        return ready


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """See the module's text. Work for other threads is done at once, in this one: it takes no time."""

    def __init__(self) -> None:
        self._passed_s = 0.0
        super().__init__(_Selector(self._pass_time))

    def time(self) -> float:
        """Seconds since the loop was made."""
        return self._passed_s

    def run_in_executor(  # type: ignore[override]  # typeshed's has a type variable tuple
        self, executor: Executor | None, func: Callable[..., T], *args: Any
    ) -> asyncio.Future[T]:
        """Does it now; its result or error is in the future."""
        future: asyncio.Future[T] = self.create_future()
        try:
            future.set_result(func(*args))
        except Exception as error:  # belongs to whoever waits for the future, as with a thread
            future.set_exception(error)
        return future

    def _pass_time(self, seconds: float) -> None:
        self._passed_s += max(seconds, 0.0)


class VirtualClock(Clock):
    """Begins at `START_S`, and goes on with the loop in whole microseconds, as the stamps in logs are."""

    def __init__(self, loop: VirtualTimeLoop) -> None:
        super().__init__(lambda: START_S + loop.time(), loop.time)

    def now(self) -> float:
        """See Clock."""
        return round(super().now(), 6)


def run_in_virtual_time(work: Callable[[Clock], Coroutine[Any, Any, T]]) -> T:
    """Runs a coroutine, made with the clock that it is to live by, to its end."""
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        loop = runner.get_loop()
        assert isinstance(loop, VirtualTimeLoop)  # noqa: S101  for the type checker: we have just made it
        return runner.run(work(VirtualClock(loop)))

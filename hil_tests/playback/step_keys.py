"""Keys of a terminal, or lines of an input, by which a user steps through something."""

from __future__ import annotations

import asyncio
import sys
import termios
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

QUIT = "q"


class StepKeys:
    """One step for each key that is pressed, or each line where the input is no terminal; `q` or its end: no more.

    Args:
        source: where they come from.
    """

    def __init__(self, source: TextIO) -> None:
        self._source = source
        self._loop = asyncio.get_running_loop()
        self._typed: asyncio.Queue[str] = asyncio.Queue()
        # nothing else can wait for any kind of input, and be left waiting when the program ends
        threading.Thread(target=self._read, name="step keys", daemon=True).start()

    async def asked(self) -> bool:
        """Waits for the next one; False: no more."""
        typed = await self._typed.get()
        return typed != "" and typed.strip() != QUIT

    def end(self) -> None:
        """No more steps, whatever is typed."""
        self._typed.put_nowait("")

    def _read(self) -> None:
        with suppress(RuntimeError):  # the loop has ended before
            for typed in iter(self._next, ""):
                self._loop.call_soon_threadsafe(self._typed.put_nowait, typed)
            self._loop.call_soon_threadsafe(self.end)

    def _next(self) -> str:
        return self._source.read(1) if self._source.isatty() else self._source.readline()


@contextmanager
def single_keys(source: TextIO = sys.stdin) -> Iterator[TextIO]:
    """Keys of a terminal come one by one, without a return behind them; afterwards it is as it was."""
    if not source.isatty():
        yield source
        return
    before = termios.tcgetattr(source)
    try:
        tty.setcbreak(source)
        yield source
    finally:
        termios.tcsetattr(source, termios.TCSADRAIN, before)

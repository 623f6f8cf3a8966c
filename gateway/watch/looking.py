"""Looks again and again, in a thread that nobody waits for: a gateway that hangs must not hold up its watcher."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Thread

from gateway.watch.source import Look, Rhythm, Source


class Looking:
    """See the module's text.

    Args:
        source: what is looked at.
        every_s: from one look to the next.
        seen: gets each look, or what went wrong with it, in that thread; with the latter it ends.
    """

    def __init__(self, source: Source, every_s: float, seen: Callable[[Look | Exception], object]) -> None:
        self._source, self._every_s, self._seen = source, every_s, seen
        self._stopped = Event()

    def start(self) -> None:
        """Begins to look."""
        Thread(target=self._run, name="looking", daemon=True).start()

    def stop(self) -> None:
        """Nothing more is seen, after the look that may be under way."""
        self._stopped.set()

    def _run(self) -> None:
        rhythm = Rhythm(self._every_s, time.monotonic)
        while not self._stopped.is_set():
            try:
                look = self._source.look()
            except Exception as error:  # it is raised where it can be shown
                self._seen(error)
                return
            self._seen(look)
            self._stopped.wait(rhythm.rest_s())

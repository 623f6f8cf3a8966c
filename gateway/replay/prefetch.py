"""The next ones are made while the present one is used: reading logs while detectors are waited for."""

from __future__ import annotations

import queue
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from threading import Event, Thread
from typing import Generic, TypeVar

T = TypeVar("T")
WAIT_S = 0.1


class _Ahead(Generic[T]):
    """Goes through an iterable in a thread."""

    def __init__(self, items: Iterable[T], ahead: int) -> None:
        self._items = items
        self._queue: queue.Queue[tuple[T | None, BaseException | None, bool]] = queue.Queue(ahead)
        self._stopped = Event()
        self._thread = Thread(target=self._fetch, name="prefetch", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[T]:
        while True:
            item, error, last = self._queue.get()
            if error is not None:
                raise error
            if last:
                return
            yield item  # type: ignore[misc]  # only the last is None

    def close(self) -> None:
        self._stopped.set()
        self._thread.join()

    def _fetch(self) -> None:
        try:
            for item in self._items:
                if not self._put((item, None, False)):
                    return
        except BaseException as error:  # it is raised where the items are used
            self._put((None, error, False))
        else:
            self._put((None, None, True))

    def _put(self, entry: tuple[T | None, BaseException | None, bool]) -> bool:
        """False where nobody wants it any more."""
        while not self._stopped.is_set():
            try:
                self._queue.put(entry, timeout=WAIT_S)
            except queue.Full:
                continue
            return True
        return False


def prefetched(items: Iterable[T], ahead: int = 2) -> Generator[T, None, None]:
    """The same items, of which so many are made in advance, in a thread of their own."""
    with closing(_Ahead(items, ahead)) as fetching:
        yield from fetching

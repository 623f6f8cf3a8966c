"""Signals of this process, heard in a thread of their own: the event loop may be what hangs.

Stopping has a time limit. When it is over, the process ends as it is: what is on disk is whole at every moment.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import FrameType

log = logging.getLogger("gateway")

STOP = frozenset({signal.SIGINT, signal.SIGTERM})
ACCEPT = signal.SIGUSR1
# from the signal to the end of the process, at most; a moment before it, why is logged
STOP_S = 1.9
WORDS_S = 1.8


def _end(*_: object) -> None:
    os._exit(1)


@contextmanager
def heard_signals(
    on_stop: Callable[[], object], on_accept: Callable[[], object], end: Callable[[], object] = _end
) -> Iterator[None]:
    """Calls these in the thread, at SIGINT or SIGTERM, and at SIGUSR1.

    The limit of a stop is not lifted where this ends, but with the process: the interpreter waits for threads, too.

    Args:
        on_stop: called once.
        on_accept: called each time.
        end: what is done when stopping has taken too long.
    """
    hearing, writing = socket.socketpair()
    writing.setblocking(False)
    before = signal.set_wakeup_fd(writing.fileno(), warn_on_full_buffer=False)
    handlers = {number: signal.signal(number, _ignore) for number in (*STOP, ACCEPT)}
    thread = threading.Thread(target=_hear, args=(hearing, on_stop, on_accept, end), name="signals", daemon=True)
    thread.start()
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(before)
        writing.close()
        thread.join()
        hearing.close()


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """What is started meanwhile never gets it: a terminal sends it to all, and only who was asked should answer."""
    resource_tracker.ensure_running()  # while it starts, it lets the signal through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _ignore(_number: int, _frame: FrameType | None) -> None:
    """Python writes a signal's number to the wake-up socket only where it has a handler."""


def _hear(
    hearing: socket.socket, on_stop: Callable[[], object], on_accept: Callable[[], object], end: Callable[[], object]
) -> None:
    stopped = False
    while numbers := hearing.recv(64):
        for number in numbers:
            if number == ACCEPT:
                on_accept()
            elif number in STOP and not stopped:
                stopped = True
                _limit(end)
                on_stop()


def _limit(end: Callable[[], object]) -> None:
    """Two timers, for the words may hang, too."""
    for after_s, act in ((WORDS_S, _tell), (STOP_S, end)):
        timer = threading.Timer(after_s, act)
        timer.daemon = True
        timer.start()


def _tell() -> None:
    alive = ", ".join(thread.name for thread in threading.enumerate() if thread is not threading.current_thread())
    log.error("stopping took %.1f s and is cut short; threads still there: %s", WORDS_S, alive)

"""Frames onto a bus, each at its own time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from drivers.can.frame import CanFrame


def play(
    frames: Iterable[CanFrame],
    send: Callable[[CanFrame], None],
    *,
    now: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> float:
    """Send every frame when it is due: the frame of time 0 at once, all others so much later.

    A frame that is late does not delay those after it.

    Args:
        frames: in order of `time_s`, which counts from the start of the play.
        send: puts a frame on the bus.
        now, sleep: the clock, in seconds.

    Returns:
        By how much the latest frame was late, in seconds.
    """
    start_s, latest_s = now(), 0.0
    for frame in frames:
        wait_s = start_s + frame.time_s - now()
        if wait_s > 0.0:
            sleep(wait_s)
        send(frame)
        latest_s = max(latest_s, -wait_s)
    return latest_s

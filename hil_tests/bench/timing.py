"""Times: our code beside a peer's on the same input, in turns, as a ratio of the two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

REPEATS = 5


@dataclass(frozen=True, slots=True)
class Comparison:
    """The same work done in two ways.

    Attributes:
        work: what is done. peer: by whom else.
        unit, count: what one call does, and how many of them.
        ours, theirs: one call each, from a state of its own.
        agree: whether what the two returned is the same to all that matters.
    """

    work: str
    peer: str
    unit: str
    count: int
    ours: Callable[[], Any]
    theirs: Callable[[], Any]
    agree: Callable[[Any, Any], bool]


@dataclass(frozen=True, slots=True)
class Timing:
    """Microseconds a unit of work, medians; `ratio`: median of the peer's time over ours, pair by pair."""

    work: str
    peer: str
    unit: str
    ours_us: float
    peer_us: float
    ratio: float


class DisagreementError(Exception):
    """Two ways to do the same work came to different results: their times must not be compared."""


def measure(comparison: Comparison, repeats: int = REPEATS) -> Timing:
    """Time both, in turns, so that a machine that slows down slows both.

    Raises:
        DisagreementError: the results differ.
    """
    if not comparison.agree(comparison.ours(), comparison.theirs()):  # also warms both up
        raise DisagreementError(f"{comparison.work}: ours and {comparison.peer} came to different results")
    seconds = np.array([(_seconds(comparison.ours), _seconds(comparison.theirs)) for _ in range(repeats)])
    ours_us, peer_us = (np.median(seconds, axis=0) / comparison.count * 1e6).tolist()
    ratio = float(np.median(seconds[:, 1] / seconds[:, 0]))
    return Timing(comparison.work, comparison.peer, comparison.unit, ours_us, peer_us, ratio)


def _seconds(call: Callable[[], object]) -> float:
    begin = perf_counter()
    call()
    return perf_counter() - begin

"""A log whose clock was set back while it was written: its times go on all the same.

Nothing that is judged may come before what was judged already, so what follows is told that much later than the log
says, and where that begins is noted. (A clock that was set forward looks like a pause, and is taken for one.)
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from math import inf
from operator import add

import numpy as np

from drivers.reading_block import ReadingBlock

Blocks = Iterator[tuple[str, ReadingBlock]]

# Readings of one link overtake each other by less.
BACK_S = 2.0
# The same setting of the clock, as two links show it, each by the times of its own readings.
AGREE_S = 5.0


@dataclass(frozen=True, slots=True)
class SetBack:
    """The clock was set back.

    Attributes:
        at_s: by the log, the last time before.
        by_s: how far.
    """

    at_s: float
    by_s: float


@dataclass(slots=True)
class _Link:
    """Of a link: the newest time, as in the log, since the clock was set for the last time.

    `later_s`: what is added since then; `passed`: how many of the log's steps came before.
    """

    newest_s: float = -inf
    later_s: float = 0.0
    passed: int = 0


class LogClock:
    """Follows one log.

    Attributes:
        set_back: where.
        begin_s, end_s: the oldest and the newest time so far, as they go on.
    """

    def __init__(self) -> None:
        self.set_back: list[SetBack] = []
        self.begin_s, self.end_s = inf, -inf
        self._links: dict[str, _Link] = {}

    def going_on(self, blocks: Iterable[tuple[str, ReadingBlock]]) -> Blocks:
        """The same blocks; those in which the clock is set come in parts."""
        for name, block in blocks:
            for part in self._parts(self._links.setdefault(name, _Link()), block):
                yield name, part

    def _parts(self, link: _Link, block: ReadingBlock) -> Iterator[ReadingBlock]:
        while block:
            rows, times_s = block.times()
            newest_s = np.maximum.accumulate(np.append(link.newest_s, times_s))
            steps = np.flatnonzero(times_s < newest_s[:-1] - BACK_S)
            first = int(steps[0]) if len(steps) else len(rows)
            before, block = block.split(int(rows[first])) if len(steps) else (block, ReadingBlock())
            link.newest_s = float(newest_s[first])
            if before:
                self.begin_s = min(self.begin_s, float(times_s[0]) + link.later_s)
                self.end_s = max(self.end_s, link.newest_s + link.later_s)
                yield _later(before, link.later_s)
            if block:
                self._step(link, SetBack(link.newest_s, link.newest_s - float(times_s[first])))

    def _step(self, link: _Link, seen: SetBack) -> None:
        """All links of a log are of one clock: what the first one shows is taken for the others, too."""
        agreeing = (n for n in range(link.passed, len(self.set_back)) if _agree(self.set_back[n], seen))
        number = next(agreeing, len(self.set_back))
        if number == len(self.set_back):
            self.set_back.append(seen)
        link.later_s += self.set_back[number].by_s
        link.passed = number + 1
        link.newest_s = -inf


def _later(block: ReadingBlock, by_s: float) -> ReadingBlock:
    return block.moved(partial(add, by_s)) if by_s else block


def _agree(one: SetBack, other: SetBack) -> bool:
    return abs(one.by_s - other.by_s) <= AGREE_S

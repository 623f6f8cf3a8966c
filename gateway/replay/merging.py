"""Several logs on one time line: each read as far as is needed, and all cut into the same stretches of time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf

import numpy as np

from drivers.reading_block import ReadingBlock
from gateway.stretches.stretch import BlockArrival

# long enough for columns to pay, short enough to see how far a replay has come
STRETCH_S = 20.0


class _Link:
    """What was read of a link and is not yet given out; a reading is due with those before it, whatever its time."""

    def __init__(self) -> None:
        self._block = ReadingBlock()
        self._due_s = np.empty(0)
        self._rows = np.empty(0, dtype=np.intp)
        self._latest_s = -inf

    @property
    def begin_s(self) -> float:
        """When the next reading is due."""
        return float(self._due_s[0]) if len(self._due_s) else inf

    def append(self, block: ReadingBlock) -> None:
        """Takes what was read."""
        self._block = ReadingBlock.joined([self._block, block])
        self._rows, times_s = self._block.times()
        self._due_s = np.fmax(np.fmax.accumulate(times_s), self._latest_s)

    def before(self, end_s: float) -> ReadingBlock:
        """Gives out what is due before a time."""
        count = int(np.searchsorted(self._due_s, end_s))
        if not count:
            return ReadingBlock()
        self._latest_s = float(self._due_s[count - 1])
        row = self._block.rows if count == len(self._rows) else int(self._rows[count])
        given, self._block = self._block.split(row)
        kept = np.searchsorted(self._rows, row)
        self._rows, self._due_s = self._rows[kept:], self._due_s[kept:]
        return given


class _Log:
    """A log that is being read.

    Attributes:
        links: what it has of each.
        whole_until_s: there is nothing more to come from before this time.
    """

    def __init__(self, blocks: Iterable[tuple[str, ReadingBlock]]) -> None:
        self._blocks = iter(blocks)
        self.links: dict[str, _Link] = {}
        self.whole_until_s = -inf

    def read(self) -> None:
        """Reads on by one block."""
        arrival = next(self._blocks, None)
        if arrival is None:
            self.whole_until_s = inf
        elif arrival[1]:
            link, block = arrival
            self.links.setdefault(link, _Link()).append(block)
            # readers give a part of the log link by link: when the next part begins, this one is whole
            self.whole_until_s = max(self.whole_until_s, float(block.times()[1][0]))


def stretches(
    logs: Iterable[Iterable[tuple[str, ReadingBlock]]], length_s: float = STRETCH_S
) -> Iterator[list[BlockArrival]]:
    """The readings of all logs, in stretches of time one after the other; where there is nothing, there is none.

    Args:
        logs: link and readings, again and again, in the order of the times: part by part of the log, and within a
            part link by link.
        length_s: of a stretch, in the time of the logs.

    Raises:
        ValueError: a link that is in two logs.
    """
    reading, end_s = [_Log(log) for log in logs], -inf
    while True:
        links = _links(reading)
        begin_s = min((link.begin_s for link in links.values()), default=inf)
        next_s = max(end_s, begin_s) + length_s
        behind = [log for log in reading if log.whole_until_s < next_s]
        if behind:
            min(behind, key=lambda log: log.whole_until_s).read()
        elif begin_s == inf:
            return
        else:
            end_s = next_s
            yield [BlockArrival(name, block) for name, link in links.items() if (block := link.before(end_s))]


def _links(logs: Iterable[_Log]) -> dict[str, _Link]:
    links: dict[str, _Link] = {}
    for log in logs:
        for name in links.keys() & log.links.keys():
            raise ValueError(f"{name} is in two logs: replay one of them")
        links |= log.links
    return links

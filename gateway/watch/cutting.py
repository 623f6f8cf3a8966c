"""A stretch of a recording in bits, each as long as is wanted when its turn comes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from gateway.stretches.stretch import BlockArrival

FloatArray = NDArray[np.float64]


@dataclass(slots=True)
class _Rest:
    """What is left of a link. `row`, `due_s`: (N,) of its readings, and when each is due; neither runs backwards."""

    arrival: BlockArrival
    row: NDArray[np.intp]
    due_s: FloatArray

    def before(self, end_s: float) -> BlockArrival | None:
        """Gives out what is due before a time."""
        count = int(np.searchsorted(self.due_s, end_s))
        if not count:
            return None
        readings = self.arrival.readings
        row = readings.rows if count == len(self.row) else int(self.row[count])
        given, left = readings.split(row)
        kept = np.searchsorted(self.row, row)
        self.row, self.due_s = self.row[kept:], self.due_s[kept:]
        # rows keep their numbers, by which the places are found
        arrival, self.arrival = replace(self.arrival, readings=given), replace(self.arrival, readings=left)
        return arrival


class Bits:
    """See the module's text.

    Args:
        arrivals: of the stretch.
    """

    def __init__(self, arrivals: Sequence[BlockArrival]) -> None:
        self._rests = list(_rests(arrivals))

    @property
    def begin_s(self) -> float:
        """When the next bit begins; infinity where nothing is left."""
        return min((float(one.due_s[0]) for one in self._rests if len(one.due_s)), default=inf)

    def take(self, length_s: float) -> list[BlockArrival]:
        """The next bit, in the time of the recording."""
        end_s = np.nextafter(self.begin_s, inf) if length_s <= 0.0 else self.begin_s + length_s
        return [arrival for one in self._rests if (arrival := one.before(end_s)) is not None]


def _rests(arrivals: Sequence[BlockArrival]) -> Iterator[_Rest]:
    """Readings are due in their order: of a link by its rows; where they have places, of all links by these."""
    times = [arrival.readings.times() for arrival in arrivals]
    places = [
        arrival.place[row] for arrival, (row, _) in zip(arrivals, times, strict=True) if arrival.place is not None
    ]
    due_s = _in_order([time_s for _, time_s in times], places) if places else None
    for number, (arrival, (row, time_s)) in enumerate(zip(arrivals, times, strict=True)):
        if len(row):
            yield _Rest(arrival, row, np.fmax.accumulate(time_s) if due_s is None else due_s[number])


def _in_order(times_s: Sequence[FloatArray], places: Sequence[FloatArray]) -> list[FloatArray]:
    """The newest time so far, by the places, of each reading of each link."""
    order = np.argsort(np.concatenate(places), kind="stable")
    newest_s = np.empty(len(order))
    newest_s[order] = np.fmax.accumulate(np.concatenate(times_s)[order])
    return np.split(newest_s, np.cumsum([len(one) for one in times_s])[:-1])

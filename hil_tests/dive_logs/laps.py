"""A part of a recorded dive, once or over and over, by the time since the play began."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf, isfinite

from hil_tests.dive_logs.counting_on import CountingOn
from hil_tests.dive_logs.pieces import OnBus, OnLink, Piece

STEP_MIN_S = 1e-3  # from the last piece of a lap to the first one of the next


@dataclass(frozen=True, slots=True)
class Part:
    """Which part of a dive.

    Attributes:
        from_s, to_s: since its beginning; infinity: to its end.

    Raises:
        ValueError: times that are no part of anything.
    """

    from_s: float = 0.0
    to_s: float = inf

    def __post_init__(self) -> None:
        if not (isfinite(self.from_s) and self.from_s >= 0.0):
            raise ValueError(f"from_s = {self.from_s}: want 0 or more seconds since the beginning of the dive")
        if not self.to_s > self.from_s:
            raise ValueError(f"to_s = {self.to_s}: want a time after from_s = {self.from_s}")


WHOLE = Part()


class Laps:
    """The part's pieces; `time_s` counts from where the part begins, and goes on from lap to lap.

    Args:
        dive: its pieces by any clock; read anew for every lap, and never held.
        part: of it.
        again: whether it begins anew at its end, for ever.
        dronecan: names of the buses that speak it: their counters go on as well.

    Attributes:
        laps: that are begun.
        lap_s: how long one is, once the first is done.
    """

    def __init__(self, dive: Iterable[Piece], part: Part, again: bool, dronecan: frozenset[str]) -> None:
        self._dive = dive
        self._part = part
        self._again = again
        self._counting = CountingOn(dronecan)
        self.laps = 0
        self.lap_s = inf

    def __iter__(self) -> Iterator[Piece]:
        """All pieces.

        Raises:
            OSError: a log cannot be read.
            ValueError: a log is not of its kind, or nothing is in that part.
        """
        later_s = 0.0
        while True:
            self.laps += 1
            for piece in self._lap():
                shown = self._counting.shown(piece) if self._again else piece
                if shown is not None:
                    yield moved(shown, later_s)
            if not self._again:
                return
            later_s += self.lap_s
            self._counting.begin_anew(later_s)

    def _lap(self) -> Iterator[Piece]:
        """The part from its beginning to its end; afterwards `lap_s` is known."""
        begin_s, pieces, first_s, newest_s = inf, 0, 0.0, 0.0
        part, cut = self._part, False
        for piece in self._dive:
            begin_s = min(begin_s, piece.time_s)
            since_s = piece.time_s - begin_s
            if since_s >= part.to_s:
                cut = True
                break
            if since_s >= part.from_s:
                newest_s = since_s - part.from_s
                first_s, pieces = newest_s if not pieces else first_s, pieces + 1
                yield moved(piece, -begin_s - part.from_s)
        if not pieces:
            raise ValueError(f"nothing was recorded {self._words()}")
        mean_step_s = (newest_s - first_s) / (pieces - 1) if pieces > 1 else 1.0
        self.lap_s = part.to_s - part.from_s if cut else newest_s + max(mean_step_s, STEP_MIN_S)

    def _words(self) -> str:
        if self._part == WHOLE:
            return "that the configuration has a link for"
        end = "on" if self._part.to_s == inf else f"to {self._part.to_s:g} s"
        return f"from {self._part.from_s:g} s {end}, counted from the beginning of the dive"


def moved(piece: Piece, by_s: float) -> Piece:
    """The same, so much later."""
    if isinstance(piece, OnLink):
        return OnLink(piece.time_s + by_s, piece.packet)
    return OnBus(piece.time_s + by_s, piece.frame, piece.bus)

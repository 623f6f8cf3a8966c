"""A recorded dive as a running gateway would have told of it: logs in, a bit at a time, telemetry out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from math import inf, isfinite

from drivers.readings import Reading
from gateway.config import Config
from gateway.control.subject_words import watched_subjects
from gateway.findings import Finding
from gateway.pipeline import Factories, Pipeline
from gateway.replay.reel import Reel
from gateway.replay.result import ReplayResult
from gateway.stretches.stretch import BlockArrival
from gateway.telemetry import Telemetry
from gateway.telemetry_board import Counts, TelemetryBoard
from gateway.watch.cutting import Bits


@dataclass(slots=True)
class ReadLink:
    """What was read of a link. Attributes as in `gateway.telemetry_board.Counted`."""

    name: str
    received: int = 0
    dropped: Counter[str] = field(default_factory=Counter)

    def drops(self) -> Counter[str]:
        """What was thrown away of what was read, which is a little more than was judged."""
        return self.dropped

    def decode_errors(self) -> Counter[str]:
        """They are among the drops."""
        return Counter()


class RecordedDive:
    """See the module's text. What several runs of the gateway have recorded is judged run by run.

    Args:
        config: what to watch.
        reels: one after the other, see `gateway.replay.reels`.
        factories: makes the detectors; None: the real ones.

    Attributes:
        begin_s: when the dive begins; infinity where there is nothing of it.
        time_s: how far it was judged, by the logs.
        next_s: when the next bit begins; infinity: there is none.

    Raises:
        OSError, ValueError: a log cannot be read, see `Reel`; `step` raises them as well.
    """

    def __init__(self, config: Config, reels: Sequence[Reel], factories: Factories | None = None) -> None:
        if config.mavlink is not None:  # there is no ground station to plot anything
            config = replace(config, mavlink=config.mavlink.model_copy(update={"named_values_period_s": 0.0}))
        self._config, self._factories = config, factories
        self._reels, self._lost = iter(reels), list[str]()
        self._stretches: Iterator[list[BlockArrival]] = iter(())
        self._bits = Bits([])
        self._reel: Reel | None = None
        self._next_reel: Reel | None = None
        self._fetch()
        self.time_s = self.begin_s = self.next_s

    def step(self, length_s: float) -> list[Finding]:
        """Judges the next bit, so long by the logs; says what was found in it."""
        if self._next_reel is not None:
            self._begin(self._next_reel)
        arrivals = self._bits.take(length_s)
        self.time_s = max(_end_s(arrivals), self.next_s)
        for arrival in arrivals:
            link = self._links.setdefault(arrival.link, ReadLink(arrival.link))
            link.received += len(arrival.readings.times()[0])
        for reading in _others(arrivals):
            self._board.hear(reading)
        outcomes = self._pipeline.take_stretch(arrivals)
        self._board.take(outcomes, self.time_s)
        self._fetch()
        return [outcome for outcome in outcomes if isinstance(outcome, Finding)]

    def telemetry(self) -> Telemetry | None:
        """How it was then; None before the first bit."""
        if self._reel is None:
            return None
        account = _account(self._reel)
        for link in self._links.values():
            link.dropped = account.drops.get(link.name, Counter())
        self._board.keep(self._pipeline)
        links = [self._links[name] for name in self._config.links()]
        unused = Counter({f"{interface}: no link is for it": count for interface, count in account.unused.items()})
        return self._board.telemetry(self.time_s, Counts(links, {"log": unused, "pipeline": self._pipeline.drops()}))

    def lost(self) -> list[str]:
        """What could not be read of the logs, in lines."""
        return [*self._lost, *_lost(self._reel)]

    def _fetch(self) -> None:
        """Reads on where nothing is left of a stretch; behind the last one of a reel, in the next reel."""
        while not isfinite(self._bits.begin_s):
            arrivals = next(self._stretches, None)
            if arrivals is not None:
                self._bits = Bits(arrivals)
            elif (reel := next(self._reels, None)) is not None:
                self._next_reel, self._stretches = reel, iter(reel)
            else:
                break
        self.next_s = self._bits.begin_s

    def _begin(self, reel: Reel) -> None:
        """A pipeline of its own."""
        self._lost += _lost(self._reel)
        self._reel, self._next_reel = reel, None
        self._pipeline = Pipeline(self._config, self._factories)
        reel.begin(self._pipeline)
        watched = watched_subjects(self._config)
        self._board = TelemetryBoard(self._config.vehicle.name, watched, self.next_s)
        self._links = {name: ReadLink(name) for name in self._config.links()}


def _account(reel: Reel) -> ReplayResult:
    """What was read of it so far, and what was lost."""
    result = ReplayResult()
    reel.account(result, None)
    return result


def _lost(reel: Reel | None) -> list[str]:
    logs = {} if reel is None else _account(reel).logs
    return [f"{name}: {line}" for name, lines in logs.items() for line in lines if line.startswith("lost")]


def _end_s(arrivals: Sequence[BlockArrival]) -> float:
    return max((float(one.readings.times()[1].max()) for one in arrivals), default=-inf)


def _others(arrivals: Sequence[BlockArrival]) -> Iterator[Reading]:
    return chain.from_iterable((reading for _, reading in one.readings.others) for one in arrivals)

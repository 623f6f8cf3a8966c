"""A recorded dive as a running gateway would have told of it: logs in, a bit at a time, telemetry out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

from drivers.readings import Reading
from gateway.config import Config
from gateway.control.subject_words import watched_subjects
from gateway.findings import Finding
from gateway.pipeline import Factories, Pipeline
from gateway.replay.clocks import TimedLog
from gateway.replay.merging import stretches
from gateway.stretches.stretch import BlockArrival
from gateway.telemetry import Telemetry
from gateway.telemetry_board import Counts, TelemetryBoard

# of the dive, that is judged at once: what moves on a screen moves ten times a second
STEP_S = 0.1


@dataclass(slots=True)
class ReadLink:
    """What was read of a link. Attributes as in `gateway.telemetry_board.Counted`."""

    name: str
    logs: Sequence[TimedLog]
    received: int = 0

    def drops(self) -> Counter[str]:
        """What its decoders threw away, as far as the logs were read: a little further than they were judged."""
        return sum((one.readings.drops().get(self.name, Counter()) for one in self.logs), Counter[str]())

    def decode_errors(self) -> Counter[str]:
        """They are among the drops."""
        return Counter()


class RecordedDive:
    """See the module's text.

    Args:
        config: what to watch.
        logs: on one clock, see `gateway.replay.clocks`.
        factories: makes the detectors; None: the real ones.

    Attributes:
        time_s: how far it was judged, by the logs.
        next_s: when the next bit begins; infinity: there is none.
        begin_s: when it begins; infinity where there is nothing.

    Raises:
        OSError, ValueError: a log cannot be read, see `gateway.replay.log_readings`; `step` raises them as well.
    """

    def __init__(self, config: Config, logs: Sequence[TimedLog], factories: Factories | None = None) -> None:
        if config.mavlink is not None:  # there is no ground station to plot anything
            config = replace(config, mavlink=config.mavlink.model_copy(update={"named_values_period_s": 0.0}))
        self._logs = tuple(logs)
        self._pipeline = Pipeline(config, factories)
        self._links = {name: ReadLink(name, self._logs) for name in config.links()}
        self._bits = iter(stretches(self._logs, STEP_S))
        self._next: list[BlockArrival] = []
        self.next_s = inf
        self._fetch()
        self.time_s = self.begin_s = self.next_s
        self._board = TelemetryBoard(config.vehicle.name, watched_subjects(config), self.begin_s)

    def step(self) -> list[Finding]:
        """Judges the next bit; says what was found in it."""
        arrivals, self.time_s = self._next, max(self.time_s, _end_s(self._next))
        for arrival in arrivals:
            self._links[arrival.link].received += len(arrival.readings.times()[0])
        for reading in _others(arrivals):
            self._board.hear(reading)
        outcomes = self._pipeline.take_stretch(arrivals)
        self._board.take(outcomes, self.time_s)
        self._fetch()
        return [outcome for outcome in outcomes if isinstance(outcome, Finding)]

    def telemetry(self) -> Telemetry:
        """How it was then."""
        self._board.keep(self._pipeline)
        return self._board.telemetry(
            self.time_s, Counts(self._links.values(), {"log": self._lost(), "pipeline": self._pipeline.drops()})
        )

    def close(self) -> None:
        """The logs are read no more."""
        self._bits = iter(())

    def _fetch(self) -> None:
        self._next = next(self._bits, [])
        self.next_s = min((float(one.readings.times()[1].min()) for one in self._next), default=inf)

    def _lost(self) -> Counter[str]:
        """What is damaged in the logs, and of what link nobody knows."""
        lost: Counter[str] = Counter()
        for one in self._logs:
            for damage in one.readings.damage.values():
                lost += damage.lost
            lost += Counter({f"{interface} is no link": count for interface, count in one.readings.unused.items()})
        return lost


def _end_s(arrivals: Sequence[BlockArrival]) -> float:
    return max((float(one.readings.times()[1].max()) for one in arrivals), default=-inf)


def _others(arrivals: Sequence[BlockArrival]) -> Iterator[Reading]:
    for arrival in arrivals:
        yield from (reading for _, reading in arrival.readings.others)

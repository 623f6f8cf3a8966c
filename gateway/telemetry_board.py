"""Collects what a running gateway says, for whoever wants to know how it is.

What comes with each judgement costs half a microsecond; the rest is put together when somebody asks.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Protocol

from detectors.verdict import Level
from drivers.mavlink.messages import StatusText
from drivers.readings import BusLoad, LinkState, Reading
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.findings import Finding
from gateway.outlet import NOTES
from gateway.pipeline import Outcome, Pipeline
from gateway.subject_values import SubjectValues, values_of
from gateway.telemetry import LinkTelemetry, Refits, Said, SubjectTelemetry, Telemetry

# around the tenth of a second in which readings are collected, up to what no pilot waits for
LATENCY_BOUNDS_S = (0.025, 0.05, 0.1, 0.15, 0.2, 0.25, 0.35, 0.5, 0.75, 1.0, 2.5, 5.0, 10.0)
# texts that are kept for one who asks how it is
TEXTS_MAX = 10


class Counted(Protocol):
    """A link that counts for itself. `received`: frames; of MAVLink, readings."""

    @property
    def name(self) -> str:
        """In the configuration."""
        ...

    @property
    def received(self) -> int:
        """So far."""
        ...

    def drops(self) -> Counter[str]:
        """What was thrown away, and what was wrong with it, by cause."""
        ...

    def decode_errors(self) -> Counter[str]:
        """That of it which its decoder threw away."""
        ...


@dataclass(frozen=True, slots=True)
class Counts:
    """What others than the board count, as it is when somebody asks. Attributes as in `Telemetry`."""

    links: Iterable[Counted] = ()
    drops: Mapping[str, Counter[str]] = field(default_factory=dict)
    behind_s: float = 0.0
    refits: Mapping[str, Refits] = field(default_factory=dict)
    recording: str = ""
    recorded_bytes: int | None = None


class TelemetryBoard:
    """See the module's text. All of it belongs to one thread, but `keep`.

    Args:
        vehicle: name of it.
        watched: subjects of the configuration, for those that nothing was said of yet.
        start_s: when the run began.

    Attributes:
        start_s: as given.
        levels: of the subjects, as the pilot was told.
        refused: what the pipeline has refused, by cause.
    """

    def __init__(self, vehicle: str, watched: Iterable[str], start_s: float) -> None:
        self._vehicle, self._watched, self.start_s = vehicle, tuple(watched), start_s
        self._newest: dict[int | type[Judgement], Judgement] = {}
        self._latencies = [0] * (len(LATENCY_BOUNDS_S) + 1)
        self._latency_s = 0.0
        self._found: dict[str, Finding] = {}
        self._findings: Counter[str] = Counter()
        self._texts: deque[tuple[float, StatusText]] = deque(maxlen=TEXTS_MAX)
        self._states: dict[str, LinkState] = {}
        self._loads: dict[str, float] = {}
        self.levels: Mapping[str, Level] = {}
        self.refused: Mapping[str, int] = {}

    def take(self, outcomes: Iterable[Outcome], now_s: float) -> None:
        """What the pipeline has come to, told at this time."""
        for outcome in outcomes:
            match outcome:
                case ThrusterJudgement():
                    self._judged(outcome.thruster, outcome, now_s)
                case SpeedJudgement() | NavigationJudgement():
                    self._judged(type(outcome), outcome, now_s)
                case Finding() if outcome.detector not in NOTES:
                    self._findings[outcome.level.name] += 1
                    self._found[outcome.subject] = outcome
                case StatusText():
                    self._texts.append((now_s, outcome))

    def hear(self, reading: Reading) -> None:
        """A reading that no decoder has made: only the state of a link and the load of a bus are of interest."""
        match reading:
            case LinkState():
                self._states[reading.link] = reading
            case BusLoad():
                self._loads[reading.link] = reading.share

    def keep(self, pipeline: Pipeline) -> None:
        """Copies what the pipeline alone knows: in the judging's thread, for nobody else may touch it."""
        self.levels, self.refused = pipeline.levels(), pipeline.drops()

    def texts(self, now_s: float) -> tuple[Said, ...]:
        """The newest texts for the pilot, the last one last."""
        return tuple(Said(now_s - said_s, one.severity, one.text) for said_s, one in self._texts)

    def telemetry(self, now_s: float, counts: Counts) -> Telemetry:
        """How it is now."""
        return Telemetry(
            time_s=now_s,
            vehicle=self._vehicle,
            running_s=now_s - self.start_s,
            subjects=tuple(self._subjects()),
            links=tuple(map(self._link, counts.links)),
            texts=self.texts(now_s),
            findings=dict(self._findings),
            drops={stage: dict(drops) for stage, drops in counts.drops.items()},
            behind_s=counts.behind_s,
            latency_bounds_s=LATENCY_BOUNDS_S,
            latency_counts=tuple(self._latencies),
            latency_sum_s=self._latency_s,
            refits=counts.refits,
            recording=counts.recording,
            recorded_bytes=counts.recorded_bytes,
        )

    def _judged(self, of: int | type[Judgement], judgement: Judgement, now_s: float) -> None:
        latency_s = now_s - judgement.verdict.time_s
        self._newest[of] = judgement
        self._latencies[bisect_left(LATENCY_BOUNDS_S, latency_s)] += 1
        self._latency_s += max(0.0, latency_s)

    def _subjects(self) -> Iterator[SubjectTelemetry]:
        """Those of the configuration first."""
        known = {one.subject: one for judgement in self._newest.values() for one in values_of(judgement)}
        levels = self.levels
        for subject in dict.fromkeys((*self._watched, *levels)):
            level, values = levels.get(subject, Level.UNKNOWN), known.get(subject)
            text = self._text(subject, level, values)
            if values is None:
                yield SubjectTelemetry(subject, level, nan, text=text)
            else:
                yield SubjectTelemetry(subject, level, values.score, values.values, text)

    def _text(self, subject: str, level: Level, values: SubjectValues | None) -> str:
        """What the pilot was told; of what is not known, rather why."""
        found, reason = self._found.get(subject), "" if values is None else values.reason
        if found is None or (level is Level.UNKNOWN and reason):
            return reason
        return found.text

    def _link(self, link: Counted) -> LinkTelemetry:
        state = self._states.get(link.name)
        return LinkTelemetry(
            name=link.name,
            up=None if state is None else state.up,
            detail="" if state is None else state.detail,
            received=link.received,
            drops=link.drops(),
            load=self._loads.get(link.name, nan),
            decode_errors=link.decode_errors(),
        )

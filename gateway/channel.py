"""One detector's way through the pipeline: readings become samples, and samples are judged, many at once.

What is common to all detectors is here; what is particular to one in `gateway.thruster_channel`,
`gateway.speed_channel` and `gateway.navigation_channel`. A further detector needs a channel, a judgement, and its
words in `gateway.rules`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

from detectors.navigation import DepthSample, DvlSample, NavigationSample, NavigationVerdict
from detectors.speed.sample import PoseSample, SpeedVerdict
from detectors.thruster import ThrusterSample, ThrusterVerdict
from drivers.readings import Reading
from gateway.silence import Watched

SampleT = TypeVar("SampleT")


@dataclass(frozen=True, slots=True)
class ThrusterJudgement:
    """A sample of a thruster and what its detector said of it."""

    thruster: int
    sample: ThrusterSample
    verdict: ThrusterVerdict


@dataclass(frozen=True, slots=True)
class SpeedJudgement:
    """A sample of the vehicle's pose and what the speed detector said of it.

    Attributes:
        sample, verdict: as the detector took and gave them.
        relies_on: subjects of the findings without which heading or position of the sample mean nothing.
    """

    sample: PoseSample
    verdict: SpeedVerdict
    relies_on: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class NavigationJudgement:
    """A sample of a navigation sensor and what the navigation detector said of it.

    Attributes:
        sample, verdict: as the detector took and gave them.
        dvl, depth: the newest of these samples; None before the first.
        changed: the level of some sensor is another than before, or it is used or not used now.
    """

    sample: NavigationSample
    verdict: NavigationVerdict
    dvl: DvlSample | None
    depth: DepthSample | None
    changed: bool


Judgement = ThrusterJudgement | SpeedJudgement | NavigationJudgement


class Source(NamedTuple):
    """Where a channel's readings come from: which kind, over which link, of which thruster (None: of none)."""

    link: str
    kind: type[Reading]
    thruster: int | None = None


class Aligned(NamedTuple):
    """What a reading did: samples that it completed, the watched signal that it is of, and whether that is rare."""

    samples: int
    signal: str | None
    rare: bool = False


@dataclass(frozen=True, slots=True)
class Learnt:
    """What survives a restart of the program, of one channel.

    Attributes:
        sources: where its readings came from, and in which scale: what gives that which was learnt its meaning.
        settings: of detector and alignment: what gives the detector's memory its meaning.
        alignment: what the alignment had settled on.
        detector: the detector, with all that it knows.
    """

    sources: str
    settings: str
    alignment: Any
    detector: Any


class Channel(ABC, Generic[SampleT]):
    """One subject: where its readings come from, its alignment, its detector, and the newest judgement.

    Readings are aligned first (`align`), their samples judged together (`judge`), and the judgements then taken
    reading by reading (`judgements`).

    Args:
        subject: as in the findings.
        sources: of its readings.
        signals: what should keep coming.

    Attributes:
        subject, sources, signals: as given.
        newest: newest judgement, None before the first.
    """

    def __init__(self, subject: str, sources: Iterable[Source], signals: Iterable[Watched]) -> None:
        self.subject = subject
        self.sources = tuple(sources)
        self.signals = tuple(signals)
        self.newest: Judgement | None = None
        self._aligned: list[SampleT] = []
        self._judged: deque[Judgement] = deque()

    def align(self, reading: Reading) -> Aligned:
        """Takes a reading in that came from one of the sources."""
        samples, signal = self._align(reading)
        self._aligned += samples
        return Aligned(len(samples), signal, signal is not None and self._is_rare(signal))

    def judge(self) -> Sequence[Judgement]:
        """Judges all samples that were aligned since the last time."""
        samples, self._aligned = self._aligned, []
        judgements = list(self._judge(samples))
        if judgements:
            self.newest = judgements[-1]
            self._judged += judgements
        return judgements

    def judgements(self, samples: int) -> Iterator[Judgement]:
        """The oldest judgements that were not taken yet, one for each of as many samples."""
        return (self._judged.popleft() for _ in range(samples))

    def told(self) -> tuple[str, ...]:
        """The subjects that are told of, each with a level of its own."""
        return (self.subject,)

    def remark(self) -> str:
        """What the summary of a run should say of it beside its level, e.g. where positions came from."""
        return ""

    def _is_rare(self, signal: str) -> bool:
        """Whether a signal comes, but too rarely to be of use."""
        return False

    @abstractmethod
    def accept(self) -> None:
        """The operator says that the subject is well as it is."""

    @abstractmethod
    def drops(self) -> Counter[str]:
        """What was refused, by cause."""

    @abstractmethod
    def learnt(self) -> Learnt:
        """What the next start of the program should know."""

    @abstractmethod
    def recall(self, old: Learnt) -> bool:
        """Takes of what was learnt that which still has a meaning; False where that is nothing."""

    @abstractmethod
    def _align(self, reading: Reading) -> tuple[Sequence[SampleT], str | None]:
        """The samples that a reading completes, and the watched signal that it belongs to."""

    @abstractmethod
    def _judge(self, samples: Sequence[SampleT]) -> Iterable[Judgement]:
        """A judgement for each of successive samples."""

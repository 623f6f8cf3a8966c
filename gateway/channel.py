"""One thruster's way through the pipeline: readings become samples, and samples are judged, many at once."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from detectors.thruster import ThrusterConfig, ThrusterSample, ThrusterVerdict
from detectors.thruster.wear import CommissionedCurve
from drivers.readings import ThrusterReport
from gateway.align import ThrusterAligner
from gateway.config import Config
from gateway.config_sections import Thruster


class Verdicts(Protocol):
    """Verdicts of a block of samples."""

    def row(self, index: int) -> ThrusterVerdict:
        """One of them."""
        ...


class Detector(Protocol):
    """What the pipeline needs of a thruster detector."""

    @property
    def commissioned(self) -> CommissionedCurve | None:
        """The curve that wear is measured against."""
        ...

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        """Judges one sample."""
        ...

    def run(
        self,
        time_s: ArrayLike,
        command: ArrayLike,
        speed_rpm: ArrayLike,
        voltage_v: ArrayLike | None = None,
        current_a: ArrayLike | None = None,
    ) -> Verdicts:
        """Judges (N,) samples, NaN where not measured: equal to `update` on each, and much faster."""
        ...

    def accept(self) -> None:
        """Makes today's curve the commissioned one."""
        ...


DetectorFactory = Callable[[ThrusterConfig, CommissionedCurve | None], Detector]


@dataclass(frozen=True, slots=True)
class Judgement:
    """A sample of a thruster and what its detector said of it."""

    thruster: int
    sample: ThrusterSample
    verdict: ThrusterVerdict


@dataclass(frozen=True, slots=True)
class Learnt:
    """What survives a restart of the program, of one thruster.

    Attributes:
        sources: where command and speed came from, and in which scale: what gives a curve its meaning.
        settings: of detector and alignment: what gives the detector's memory its meaning.
        rate_hz: sample rate; None where it was not known yet.
        detector: the detector, with its commissioned curve and its memory.
    """

    sources: str
    settings: str
    rate_hz: float | None
    detector: Detector


class Channel:
    """One thruster: where its readings come from, its aligner, its detector, and the newest judgement.

    Reports are aligned first (`align`), their samples judged together (`judge`), and the judgements then taken report
    by report (`judgements`).

    Args:
        thruster: which one.
        config: settings of alignment and detector.
        make: makes the detector.
    """

    def __init__(self, thruster: Thruster, config: Config, make: DetectorFactory) -> None:
        align = config.align
        self.number = thruster.number
        self.command_link = thruster.command.link
        self.rpm_link = thruster.rpm.link
        self.aligner = ThrusterAligner(align.sample_rate_hz, align.gap_s, align.stale_s)
        # by its own seed each thruster learns at its own time: eight at once would hold up the judging
        settings = replace(config.detector, seed=config.detector.seed + thruster.number)
        self.detector = make(settings, None)
        self._remake = partial(make, settings)
        self._sources = thruster.model_dump_json(exclude={"name"})
        self._settings = f"{config.detector!r} {align.model_dump_json()}"
        self._aligned: list[ThrusterSample] = []
        self._judged: deque[Judgement] = deque()
        self.newest: Judgement | None = None

    def align(self, report: ThrusterReport) -> int:
        """Takes a report in; number of samples that it completes."""
        samples = self.aligner.report(report.time_s, report.speed_rpm, report.voltage_v, report.current_a)
        self._aligned += samples
        return len(samples)

    def judge(self) -> None:
        """Judges all samples that were aligned since the last time."""
        samples, self._aligned = self._aligned, []
        for sample, verdict in zip(samples, verdicts(self.detector, samples), strict=True):
            self.newest = Judgement(self.number, sample, verdict)
            self._judged.append(self.newest)

    def judgements(self, samples: int) -> Iterator[Judgement]:
        """The oldest judgements that were not taken yet, one for each of as many samples."""
        return (self._judged.popleft() for _ in range(samples))

    def learnt(self) -> Learnt:
        """What the next start of the program should know."""
        return Learnt(self._sources, self._settings, self.aligner.rate_hz, self.detector)

    def recall(self, old: Learnt) -> bool:
        """Other settings leave only the commissioned curve of what was learnt, other sources nothing: False."""
        if old.sources != self._sources:
            return False
        if old.settings == self._settings:
            self.aligner.rate_hz, self.detector = old.rate_hz, old.detector
        else:
            self.detector = self._remake(old.detector.commissioned)
        return True


def verdicts(detector: Detector, samples: Sequence[ThrusterSample]) -> list[ThrusterVerdict]:
    """What a detector says of successive samples, in the way that costs least."""
    if len(samples) < 2:
        return [detector.update(sample) for sample in samples]
    rows = [
        (one.time_s, one.command, one.speed_rpm, _measured(one.voltage_v), _measured(one.current_a))
        for one in samples
    ]
    block = detector.run(*np.array(rows).T)
    return [block.row(index) for index in range(len(samples))]


def _row(sample: ThrusterSample) -> tuple[float, ...]:
    telemetry = (_measured(sample.voltage_v), _measured(sample.current_a))
    return sample.time_s, sample.command, sample.speed_rpm, *telemetry


def _measured(value: float | None) -> float:
    return nan if value is None else value

"""A thruster's way through the pipeline: commands and reports, evenly spaced samples, verdicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isnan, nan
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from detectors.thruster import LearntCurve, ThrusterConfig, ThrusterSample, ThrusterVerdict, ThrusterVerdicts
from detectors.thruster.wear import CommissionedCurve
from drivers.reading_block import CommandColumns, ReportColumns
from drivers.readings import Reading, ThrusterCommand, ThrusterReport
from gateway.align import ThrusterAligner
from gateway.align_columns import SampleColumns, align_columns
from gateway.channel import Channel, Learnt, Source, ThrusterJudgement
from gateway.config import Config
from gateway.config_sections import MAVLINK, Thruster
from gateway.silence import Watched


class Verdicts(Protocol):
    """Verdicts of a block of samples, as columns (N,); see `ThrusterVerdict`."""

    @property
    def level(self) -> NDArray[np.int64]:
        """Of `Level`."""
        ...

    @property
    def whole(self) -> ThrusterVerdicts:
        """All that they say."""
        ...

    def row(self, index: int) -> ThrusterVerdict:
        """One of them."""
        ...


@dataclass(frozen=True, slots=True)
class JudgedColumns:
    """Samples of a thruster as columns, and what its detector said of them.

    Attributes:
        thruster: its number.
        samples, verdicts: (N,) each.
    """

    thruster: int
    samples: SampleColumns
    verdicts: Verdicts

    def judgement(self, row: int) -> ThrusterJudgement:
        """One of them."""
        samples = self.samples
        volts, amperes = float(samples.voltage_v[row]), float(samples.current_a[row])
        sample = ThrusterSample(
            float(samples.time_s[row]),
            float(samples.command[row]),
            float(samples.speed_rpm[row]),
            None if isnan(volts) else volts,
            None if isnan(amperes) else amperes,
        )
        return ThrusterJudgement(self.thruster, sample, self.verdicts.row(row))


@dataclass(frozen=True, slots=True)
class ThrusterCurves:
    """Steady speed over command: as learnt by now, and as wear is measured against; None: there is none."""

    learnt: LearntCurve | None
    commissioned: CommissionedCurve | None


class Detector(Protocol):
    """What the pipeline needs of a thruster detector."""

    @property
    def commissioned(self) -> CommissionedCurve | None:
        """The curve that wear is measured against."""
        ...

    @property
    def learnt(self) -> LearntCurve | None:
        """The steady curve as it is learnt by now."""
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

    def resume(self) -> None:
        """After a restart of the program: the clock may be another."""
        ...


SIGNALS = ("command", "rpm", "esc")
# of all thrusters whose commands come over MAVLink
COMMANDS = "commands"

ThrusterFactory = Callable[[ThrusterConfig, CommissionedCurve | None], Detector]


class ThrusterChannel(Channel[ThrusterSample]):
    """See `Channel`.

    Args:
        thruster: which one.
        config: settings of alignment and detector.
        make: makes the detector.
        phase: of the grid of its samples, see `ThrusterAligner`.

    Attributes:
        number: of the thruster.
    """

    def __init__(self, thruster: Thruster, config: Config, make: ThrusterFactory, phase: float = 0.0) -> None:
        align, number = config.alignment(thruster), thruster.number
        super().__init__(f"thruster {number}", _sources(thruster), _signals(thruster, config.supervisor.silent_s))
        self.number = number
        self._command_signal, self._rpm_signal, esc = (f"thruster {number} {what}" for what in SIGNALS)
        self._esc_signal = esc if thruster.rpm.rpm_sensor is None else None
        streamed = thruster.command.link == MAVLINK
        self._aligner = ThrusterAligner(align.sample_rate_hz, align.gap_s, align.stale_s, streamed, phase)
        # by its own seed each thruster learns at its own time: eight at once would hold up the judging
        settings = replace(config.detector.thruster, seed=config.detector.thruster.seed + number)
        self._detector = make(settings, None)
        self._remake = partial(make, settings)
        self._meaning = thruster.model_dump_json(exclude={"name", "ahead", "right"})
        self._settings = f"{config.detector.thruster!r} {align.model_dump_json()}"

    def judge_columns(
        self, commands: CommandColumns, reports: ReportColumns, commands_before: NDArray[np.intp]
    ) -> JudgedColumns | None:
        """Takes a stretch of its readings, as `align_columns` does, and judges the samples that they complete.

        Returns:
            None, and nothing was taken, where they have to be taken one by one. `newest` is for the caller to set,
            for the detector may still be at work.
        """
        samples = align_columns(self._aligner, commands, reports, commands_before)
        if samples is None:
            return None
        columns = (samples.time_s, samples.command, samples.speed_rpm, samples.voltage_v, samples.current_a)
        return JudgedColumns(self.number, samples, self._detector.run(*columns))

    def signal_of(self, kind: type[Reading], measured: bool) -> str | None:
        """The watched signal that a reading belongs to; `measured`: it has a speed."""
        if kind is ThrusterCommand:
            return self._command_signal
        return self._rpm_signal if measured else self._esc_signal

    def accept(self) -> None:
        """The present curve is the commissioned one from now on."""
        self._detector.accept()

    def curves(self) -> ThrusterCurves:
        """What the detector knows of the thruster by now."""
        return ThrusterCurves(self._detector.learnt, self._detector.commissioned)

    def drops(self) -> Counter[str]:
        """What alignment refused, by cause."""
        return self._aligner.drops

    def learnt(self) -> Learnt:
        """Sample rate and detector."""
        return Learnt(self._meaning, self._settings, self._aligner.rate_hz, self._detector)

    def recall(self, old: Learnt) -> bool:
        """Other settings leave only the commissioned curve of what was learnt, other sources nothing."""
        if old.sources != self._meaning:
            return False
        if old.settings == self._settings:
            self._aligner.rate_hz, self._detector = old.alignment, old.detector
            self._detector.resume()
        else:
            self._detector = self._remake(old.detector.commissioned)
        return True

    def _align(self, reading: Reading) -> tuple[Sequence[ThrusterSample], str | None]:
        match reading:
            case ThrusterCommand():
                self._aligner.command(reading.time_s, reading.fraction)
                return (), self.signal_of(ThrusterCommand, measured=False)
            case ThrusterReport():
                samples = self._aligner.report(
                    reading.time_s, reading.speed_rpm, reading.voltage_v, reading.current_a
                )
                return samples, self.signal_of(ThrusterReport, measured=reading.speed_rpm is not None)
        return (), None

    def _is_rare(self, signal: str) -> bool:
        return signal == self._command_signal and self._aligner.slow

    def _judge(self, samples: Sequence[ThrusterSample]) -> Iterator[ThrusterJudgement]:
        for sample, verdict in zip(samples, verdicts(self._detector, samples), strict=True):
            yield ThrusterJudgement(self.number, sample, verdict)


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


def _measured(value: float | None) -> float:
    return nan if value is None else value


def _sources(thruster: Thruster) -> tuple[Source, Source]:
    return (
        Source(thruster.command.link, ThrusterCommand, thruster.number),
        Source(thruster.rpm.link, ThrusterReport, thruster.number),
    )


def _signals(thruster: Thruster, silent_s: float) -> Iterator[Watched]:
    """Command and RPM, and the ESC that says the RPM; a sensor of its own has none."""
    number, rpm = thruster.number, thruster.rpm
    command, speed, esc = (f"thruster {number} {what}" for what in SIGNALS)
    whole = esc if rpm.rpm_sensor is None else None
    streamed = thruster.command.link == MAVLINK
    if streamed:  # SERVO_OUTPUT_RAW, which has all of them
        yield Watched("signal", COMMANDS, "Commands", MAVLINK, silent_s, armed_only=True)
    yield Watched(
        "signal",
        command,
        f"T{number} command",
        thruster.command.link,
        silent_s,
        armed_only=True,
        part_of=COMMANDS if streamed else None,
    )
    yield Watched("signal", speed, f"T{number} RPM", rpm.link, silent_s, part_of=whole)
    if whole is not None:
        yield Watched("signal", whole, f"T{number} ESC", rpm.link, silent_s)

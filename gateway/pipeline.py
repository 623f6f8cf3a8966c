"""Readings in, outcomes out: alignment, detectors, watches and supervisor in one deterministic object.

It knows no bus, socket or clock. The same readings in the same order give the same findings, byte for byte, live or
in replay, however often `advance` is called in between, and after `snapshot` and `restore`.
"""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol, assert_never

from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.wear import CommissionedCurve
from detectors.verdict import Level
from drivers.readings import (
    Attitude,
    AutopilotConflict,
    AutopilotHeartbeat,
    AutopilotReboot,
    CommandAcknowledgement,
    GlobalPosition,
    LinkState,
    LocalPosition,
    Reading,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.align import ThrusterAligner
from gateway.config import Config, Thruster
from gateway.rules import CONFLICT, autopilots_observation, silence_watch, supervisor, thruster_observation
from gateway.supervisor import Action
from gateway.timeline import Timeline


class Detector(Protocol):
    """What the pipeline needs of a thruster detector."""

    @property
    def commissioned(self) -> CommissionedCurve | None:
        """The curve that wear is measured against."""
        ...

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        """Judges one sample."""
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


Outcome = Judgement | Action


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


class _Channel:
    """One thruster: where its readings come from, its aligner, its detector, and the newest judgement."""

    def __init__(self, thruster: Thruster, config: Config, make: DetectorFactory) -> None:
        align = config.align
        self.number = thruster.number
        self.command_link = thruster.command.link
        self.rpm_link = thruster.rpm.link
        self.aligner = ThrusterAligner(align.sample_rate_hz, align.gap_s, align.stale_s)
        self.detector = make(config.detector, None)
        self._remake = partial(make, config.detector)
        self._sources = thruster.model_dump_json(exclude={"name"})
        self._settings = f"{config.detector!r} {align.model_dump_json()}"
        self.newest: Judgement | None = None

    def judge(self, report: ThrusterReport) -> Iterator[Judgement]:
        samples = self.aligner.report(report.time_s, report.speed_rpm, report.voltage_v, report.current_a)
        for sample in samples:
            self.newest = Judgement(self.number, sample, self.detector.update(sample))
            yield self.newest

    def learnt(self) -> Learnt:
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


class Pipeline:
    """See the module's text.

    Args:
        config: what to watch.
        detector: makes a thruster's detector from its settings and its commissioned curve, if there is one.

    Attributes:
        newest: newest judgement by thruster number, None before the first.
    """

    def __init__(self, config: Config, detector: DetectorFactory = ThrusterDetector) -> None:
        self._timeline = Timeline()
        self._drops: Counter[str] = Counter()
        self._channels = {thruster.number: _Channel(thruster, config, detector) for thruster in config.thruster}
        self._silence = silence_watch(config)
        self._supervisor = supervisor(config)

    @property
    def newest(self) -> Mapping[int, Judgement | None]:
        """Newest judgement by thruster number, None before the first."""
        return {number: channel.newest for number, channel in self._channels.items()}

    def levels(self) -> dict[str, Level]:
        """Level of every subject, as the pilot was told."""
        return self._supervisor.levels()

    def drops(self) -> Counter[str]:
        """What was refused after decoding, by cause."""
        total = self._drops + self._timeline.drops
        for channel in self._channels.values():
            total += channel.aligner.drops
        return total

    def feed(self, link: str, readings: Iterable[Reading]) -> list[Outcome]:
        """Takes readings of one link, in the order of their arrival."""
        outcomes: list[Outcome] = []
        for reading in readings:
            if self._timeline.admits(reading.time_s):
                outcomes += self._tick_to(reading.time_s)
                outcomes += self._take(link, reading)
        return outcomes

    def advance(self, time_s: float) -> list[Outcome]:
        """Takes the time, for what is found by nothing happening. No reading should come that is older."""
        return list(self._tick_to(time_s)) if self._timeline.admits(time_s) else []

    def accept(self, thruster: int, time_s: float) -> list[Outcome]:
        """The operator says that a thruster is well as it is: its present curve is the commissioned one from now on.

        Raises:
            ValueError: no such thruster.
        """
        channel = self._channels.get(thruster)
        if channel is None:
            raise ValueError(f"thruster = {thruster!r}: want one of {', '.join(map(str, self._channels))}")
        channel.detector.accept()
        return list(self._supervisor.accept(f"thruster {thruster}", time_s))

    def learnt(self) -> dict[int, Learnt]:
        """What the next start of the program should know, by thruster number."""
        return {number: channel.learnt() for number, channel in self._channels.items()}

    def recall(self, learnt: Mapping[int, Learnt]) -> list[int]:
        """Takes what an earlier run had learnt; returns the thrusters that are now others, or no more there."""
        return [
            number
            for number, old in learnt.items()
            if number not in self._channels or not self._channels[number].recall(old)
        ]

    def snapshot(self) -> bytes:
        """The whole state; `restore` goes on from it bit for bit. To be read only where it was written: a pickle."""
        return pickle.dumps(self)

    @staticmethod
    def restore(snapshot: bytes) -> Pipeline:
        """The pipeline of a snapshot.

        Raises:
            ValueError: it holds something else.
        """
        pipeline = pickle.loads(snapshot)  # noqa: S301  our own bytes, see `snapshot`
        if not isinstance(pipeline, Pipeline):
            raise ValueError(f"snapshot holds a {type(pipeline).__name__}: want a Pipeline's own snapshot")
        return pipeline

    def _tick_to(self, time_s: float) -> Iterator[Outcome]:
        for tick_s in self._timeline.ticks(time_s):
            for observation in self._silence.judge(tick_s, self._supervisor.disarmed()):
                yield from self._supervisor.observe(observation)
            yield from self._supervisor.advance(tick_s)

    def _take(self, link: str, reading: Reading) -> Iterator[Outcome]:
        if isinstance(reading, LinkState):
            self._silence.link_state(reading)
            return
        self._silence.hear_link(link, reading.time_s)
        match reading:
            case ThrusterCommand():
                self._command(link, reading)
            case ThrusterReport():
                yield from self._report(link, reading)
            case AutopilotHeartbeat():
                yield from self._heartbeat(reading)
            case CommandAcknowledgement():
                yield from self._supervisor.acknowledge(reading)
            case AutopilotConflict():
                yield from self._supervisor.observe(autopilots_observation(reading.time_s, reading.system_ids))
            case AutopilotReboot() | Attitude() | GlobalPosition() | LocalPosition():
                pass  # not needed to watch thrusters
            case _:
                assert_never(reading)

    def _command(self, link: str, reading: ThrusterCommand) -> None:
        channel = self._channel(reading.thruster, link, "command_link")
        if channel is not None:
            self._silence.hear_signal(f"thruster {channel.number} command", reading.time_s)
            channel.aligner.command(reading.time_s, reading.fraction)

    def _report(self, link: str, reading: ThrusterReport) -> Iterator[Outcome]:
        channel = self._channel(reading.thruster, link, "rpm_link")
        if channel is None:
            return
        if reading.speed_rpm is not None:
            self._silence.hear_signal(f"thruster {channel.number} rpm", reading.time_s)
        for judgement in channel.judge(reading):
            yield judgement
            yield from self._supervisor.observe(
                thruster_observation(judgement.thruster, judgement.sample, judgement.verdict)
            )

    def _channel(self, thruster: int, link: str, source: str) -> _Channel | None:
        """The thruster's channel, where this link is its configured source; another link's readings are counted."""
        channel = self._channels.get(thruster)
        if channel is None or getattr(channel, source) != link:
            self._drops["not the configured source"] += 1
            return None
        return channel

    def _heartbeat(self, reading: AutopilotHeartbeat) -> Iterator[Outcome]:
        yield from self._supervisor.heartbeat(reading)
        if CONFLICT in self._supervisor.levels():  # one autopilot is listened to again
            yield from self._supervisor.observe(autopilots_observation(reading.time_s, ()))

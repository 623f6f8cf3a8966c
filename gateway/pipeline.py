"""Readings in, outcomes out: alignment, detectors, watches and supervisor in one deterministic object.

It knows no bus, socket or clock. The same readings in the same order give the same findings, byte for byte, live or
in replay, however they are cut into batches, however often `advance` is called in between, and after `snapshot` and
`restore`.

A batch goes through in three passes: all its readings are aligned, each detector judges its thruster's samples in one
block (a fraction of the cost of one by one), and then the supervisor hears of everything in the order of arrival.
That gives the same as one by one because neither alignment nor detectors depend on what the supervisor says.
"""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import assert_never

from detectors.thruster import ThrusterDetector
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
    PositionFix,
    Reading,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.channel import Channel, DetectorFactory, Judgement, Learnt
from gateway.config import Config
from gateway.rules import CONFLICT, autopilots_observation, silence_watch, supervisor, thruster_observation
from gateway.supervisor import Action
from gateway.timeline import Timeline

Outcome = Judgement | Action


@dataclass(frozen=True, slots=True)
class Arrival:
    """Readings of one link, in the order of their arrival."""

    link: str
    readings: Sequence[Reading]


@dataclass(frozen=True, slots=True)
class Now:
    """The time, for what is found by nothing happening. No reading should come after it that is older."""

    time_s: float


Event = Arrival | Now
# A part of an event that comes to the supervisor, once the detectors have judged
_Step = Callable[[], Iterable[Outcome]]


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
        self._channels = {thruster.number: Channel(thruster, config, detector) for thruster in config.thruster}
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

    def feed(self, link: str, readings: Sequence[Reading]) -> list[Outcome]:
        """Takes readings of one link, in the order of their arrival."""
        return self.take([Arrival(link, readings)])

    def advance(self, time_s: float) -> list[Outcome]:
        """Takes the time, for what is found by nothing happening. No reading should come that is older."""
        return self.take([Now(time_s)])

    def take(self, events: Iterable[Event]) -> list[Outcome]:
        """Takes events in the order in which they happened; the outcomes are in that order too."""
        steps = [step for event in events for step in self._prepared(event)]
        for channel in self._channels.values():
            channel.judge()
        return [outcome for step in steps for outcome in step()]

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

    def _prepared(self, event: Event) -> Iterator[_Step]:
        """Passes an event through timeline and alignment; its steps are for when the detectors have judged."""
        if isinstance(event, Now):
            if self._timeline.admits(event.time_s):
                yield partial(self._tick, tuple(self._timeline.ticks(event.time_s)))
            return
        for reading in event.readings:
            if self._timeline.admits(reading.time_s):
                yield partial(self._tick, tuple(self._timeline.ticks(reading.time_s)))
                yield partial(self._hear, event.link, reading, *self._align(event.link, reading))

    def _align(self, link: str, reading: Reading) -> tuple[Channel | None, int]:
        """The channel that a reading is for, and the number of samples that it completes there."""
        match reading:
            case ThrusterCommand():
                channel = self._channel(reading.thruster, link, "command_link")
                if channel is not None:
                    channel.aligner.command(reading.time_s, reading.fraction)
                return channel, 0
            case ThrusterReport():
                channel = self._channel(reading.thruster, link, "rpm_link")
                return channel, 0 if channel is None else channel.align(reading)
        return None, 0

    def _tick(self, ticks_s: Iterable[float]) -> Iterator[Outcome]:
        for tick_s in ticks_s:
            for observation in self._silence.judge(tick_s, self._supervisor.disarmed()):
                yield from self._supervisor.observe(observation)
            yield from self._supervisor.advance(tick_s)

    def _hear(self, link: str, reading: Reading, channel: Channel | None, samples: int) -> Iterator[Outcome]:
        if isinstance(reading, LinkState):
            self._silence.link_state(reading)
            return
        self._silence.hear_link(link, reading.time_s)
        match reading:
            case ThrusterCommand():
                if channel is not None:
                    self._silence.hear_signal(f"thruster {channel.number} command", reading.time_s)
            case ThrusterReport():
                if channel is not None:
                    yield from self._report(channel, reading, samples)
            case AutopilotHeartbeat():
                yield from self._heartbeat(reading)
            case CommandAcknowledgement():
                yield from self._supervisor.acknowledge(reading)
            case AutopilotConflict():
                yield from self._supervisor.observe(autopilots_observation(reading.time_s, reading.system_ids))
            case AutopilotReboot() | Attitude() | GlobalPosition() | LocalPosition() | PositionFix():
                pass  # not needed to watch thrusters
            case _:
                assert_never(reading)

    def _report(self, channel: Channel, report: ThrusterReport, samples: int) -> Iterator[Outcome]:
        if report.speed_rpm is not None:
            self._silence.hear_signal(f"thruster {channel.number} rpm", report.time_s)
        for judgement in channel.judgements(samples):
            yield judgement
            yield from self._supervisor.observe(
                thruster_observation(judgement.thruster, judgement.sample, judgement.verdict)
            )

    def _channel(self, thruster: int, link: str, source: str) -> Channel | None:
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

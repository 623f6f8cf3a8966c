"""Readings in, outcomes out: alignment, detectors, watches and supervisor in one deterministic object.

It knows no bus, socket or clock. The same readings in the same order give the same findings, byte for byte, live or
in replay, however they are cut into batches, however often `advance` is called in between, and after `snapshot` and
`restore`.

A batch goes through in three passes: all its readings are aligned, each detector judges its samples in one block (for
thrusters a fraction of the cost of one by one), and then the supervisor hears of everything in the order of arrival.
That gives the same as one by one because neither alignment nor detectors depend on what the supervisor says. Where an
operator accepts a subject as it is, which changes its detector, a batch is cut.
"""

from __future__ import annotations

import pickle
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Any

from detectors.navigation.detector import NavigationDetector
from detectors.speed import SpeedDetector
from detectors.thruster import ThrusterDetector
from detectors.verdict import Level
from drivers.bus_readings import BusReading
from drivers.mavlink.messages import CommandAck, NamedValue
from drivers.readings import (
    AutopilotConflict,
    AutopilotHeartbeat,
    BusLoad,
    CommandAcknowledgement,
    FrameLoss,
    IdentityConflict,
    Lateness,
    LinkState,
    OperatorAct,
    OperatorRequest,
    Reading,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.bus_watch import BusWatch
from gateway.channel import Aligned, Channel, Judgement, Learnt, Source
from gateway.config import Config
from gateway.conflicts import ConflictWatch
from gateway.load_observations import bus_load_observation, frame_loss_observation, lateness_observation
from gateway.named_values import Plots
from gateway.navigation_channel import NavigationChannel
from gateway.operator import OperatorDesk
from gateway.rules import observations, silence_watch, supervisor
from gateway.sensor_watch import NavigationFactory
from gateway.silence import AUTOPILOT
from gateway.speed_channel import SpeedChannel, SpeedFactory
from gateway.stretches.judging import judge_stretch
from gateway.stretches.parts import Parts, Seen
from gateway.stretches.stretch import BlockArrival, Stretch
from gateway.supervisor import Memory, Outgoing
from gateway.thruster_channel import JudgedColumns, ThrusterChannel, ThrusterCurves, ThrusterFactory
from gateway.timeline import Timeline

Outcome = Judgement | Outgoing | CommandAck | NamedValue


@dataclass(frozen=True, slots=True)
class Factories:
    """What makes the detectors. None: there is none, and what it would judge is not watched.

    Attributes:
        thruster: a thruster's, from its settings and its commissioned curve, if there is one.
        speed: the vehicle's, from its settings and its normal speed, where that was learnt.
        navigation: of the navigation sensors, from its settings, a state to begin with, and the sensors'
            installation, where that was learnt.
    """

    thruster: ThrusterFactory | None = ThrusterDetector
    speed: SpeedFactory | None = SpeedDetector
    navigation: NavigationFactory | None = NavigationDetector


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
# How a channel is made to judge: what measures the time that it takes is outside, for nothing in here knows a clock
Judge = Callable[[Channel[Any]], object]
# A part of an event that comes to the supervisor, once the detectors have judged
_Step = Callable[[], Iterable[Outcome]]
# The channels that a reading went to, and what it did there
_Taken = tuple[tuple[Channel[Any], Aligned], ...]


def _unseen(_: JudgedColumns | Judgement) -> None:
    """Nobody looks at the judgements."""


class Pipeline:
    """See the module's text.

    Args:
        config: what to watch.
        factories: makes the detectors; None: the real ones.
        judge: makes a channel judge what it has aligned; what it gives back is not looked at.
        phase: of the grid of the thrusters' samples, see `gateway.align`.
    """

    def __init__(
        self,
        config: Config,
        factories: Factories | None = None,
        judge: Judge = Channel.judge,
        phase: float = 0.0,
    ) -> None:
        self._judge = judge
        self._timeline = Timeline()
        self._drops: Counter[str] = Counter()
        channels = _channels(config, factories or Factories(), phase)
        self._channels = {channel.subject: channel for channel in channels}
        self._routes: dict[Source, list[Channel[Any]]] = defaultdict(list)
        for channel in self._channels.values():
            for source in channel.sources:
                self._routes[source].append(channel)
        signals = [signal for channel in self._channels.values() for signal in channel.signals]
        self._silence = silence_watch(config, signals)
        self._supervisor = supervisor(config)
        self._conflicts = ConflictWatch()
        self._buses = BusWatch()
        self._desk = OperatorDesk(self._channels, self._supervisor)
        self._plots = Plots(0.0 if config.mavlink is None else config.mavlink.named_values_period_s)
        self._load_max = {bus.name: bus.load_max for bus in config.can}

    @property
    def subjects(self) -> tuple[str, ...]:
        """Whatever is judged: "thruster 1", ..., "vehicle", "navigation"."""
        return tuple(self._channels)

    @property
    def newest(self) -> Mapping[str, Judgement | None]:
        """Newest judgement by subject, None before the first."""
        return {subject: channel.newest for subject, channel in self._channels.items()}

    def levels(self) -> dict[str, Level]:
        """Level of every subject, as the pilot was told."""
        return self._supervisor.levels()

    def remarks(self) -> dict[str, str]:
        """What is worth saying of the subjects beside their levels."""
        said = {subject: channel.remark() for subject, channel in self._channels.items()}
        return {subject: remark for subject, remark in said.items() if remark}

    def drops(self) -> Counter[str]:
        """What was refused after decoding, by cause."""
        total = self._drops + self._timeline.drops
        for channel in self._channels.values():
            total += channel.drops()
        return total

    def feed(self, link: str, readings: Sequence[Reading]) -> list[Outcome]:
        """Takes readings of one link, in the order of their arrival."""
        return self.take([Arrival(link, readings)])

    def advance(self, time_s: float) -> list[Outcome]:
        """Takes the time, for what is found by nothing happening. No reading should come that is older."""
        return self.take([Now(time_s)])

    def take(self, events: Iterable[Event], seen: Seen = _unseen) -> list[Outcome]:
        """Takes events in the order in which they happened; the outcomes are in that order too.

        `seen` is shown every judgement, each once, those of a subject in their order.
        """
        return [outcome for batch in _batches(events) for outcome in self._taken(batch, seen)]

    def _taken(self, events: Iterable[Event], seen: Seen) -> list[Outcome]:
        steps = [step for event in events for step in self._prepared(event, seen)]
        for channel in self._channels.values():
            self._judge(channel)
        return [outcome for step in steps for outcome in step()]

    def take_stretch(self, arrivals: Sequence[BlockArrival], seen: Seen = _unseen) -> list[Outcome]:
        """Takes readings of several links over the same stretch of time, as columns: a hundred times as fast.

        They are in the order of their times, those of one link in the order of their rows; no stretch should begin
        before the one before ends. The findings are those of the same readings one by one. Values for ground stations
        to plot are not given, and of the judgements only some: `seen` is shown all, as in `take`.
        """
        stretch = Stretch.of(arrivals)
        accepted = any(_accepts(reading) for _, _, reading in stretch.others)
        if accepted or not self._timeline.passes(stretch.time_s):
            return self.take([Arrival(link, [reading]) for _, link, reading in stretch.readings()], seen)
        parts = Parts(
            timeline=self._timeline,
            silence=self._silence,
            supervisor=self._supervisor,
            channels=tuple(self._channels.values()),
            routes=self._routes,
            hear=partial(self._hear, seen),
            judged=self._judged,
            tick=self._tick,
            drops=self._drops,
            seen=seen,
        )
        return list(judge_stretch(stretch, parts))

    def curves(self) -> dict[int, ThrusterCurves]:
        """What is known of the thrusters by now, by their numbers."""
        return {
            channel.number: channel.curves()
            for channel in self._channels.values()
            if isinstance(channel, ThrusterChannel)
        }

    def accept(self, subject: str, time_s: float) -> list[Outcome]:
        """The operator says that a subject is well as it is: how it is now is its reference from now on.

        Raises:
            ValueError: no such subject.
        """
        channel = self._channels.get(subject)
        if channel is None:
            raise ValueError(f"subject = {subject!r}: want one of {', '.join(self._channels)}")
        return [*self._desk.accept(channel.told(), time_s)]

    def learnt(self) -> dict[str, Learnt]:
        """What the next start of the program should know, by subject."""
        return {subject: channel.learnt() for subject, channel in self._channels.items()}

    def recall(self, learnt: Mapping[str, Learnt]) -> list[str]:
        """Takes what an earlier run had learnt; returns the subjects that are now others, or no more there."""
        return [
            subject
            for subject, old in learnt.items()
            if subject not in self._channels or not self._channels[subject].recall(old)
        ]

    def remember(self) -> Memory:
        """What depends on the moment: levels, and what was asked of the autopilot. For `resume`, if it is young."""
        return self._supervisor.remember()

    def resume(self, memory: Memory) -> None:
        """Takes up what an earlier run remembered a moment ago, of what is still watched."""
        watched = {one for channel in self._channels.values() for one in channel.told()}
        self._supervisor.resume(memory.of(watched | self._silence.subjects))

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

    def _prepared(self, event: Event, seen: Seen) -> Iterator[_Step]:
        """Passes an event through timeline and alignment; its steps are for when the detectors have judged."""
        if isinstance(event, Now):
            if self._timeline.admits(event.time_s):
                yield self._time(event.time_s)
            return
        for reading in event.readings:
            if self._timeline.admits(reading.time_s):
                yield self._time(reading.time_s)
                yield partial(self._hear, seen, event.link, reading, self._align(event.link, reading))

    def _time(self, time_s: float) -> _Step:
        """The ticks up to a time, of which those that nobody was there for are no silence."""
        woken_s = time_s if self._timeline.stands_still(time_s) else None
        return partial(self._ticks, tuple(self._timeline.ticks(time_s)), woken_s)

    def _align(self, link: str, reading: Reading) -> _Taken:
        """Gives a reading to the channels that it is for; a thruster's over another link than its own is counted."""
        thruster = reading.thruster if isinstance(reading, ThrusterCommand | ThrusterReport) else None
        channels = self._routes.get(Source(link, type(reading), thruster), ())
        if thruster is not None and not channels:
            self._drops["not the configured source"] += 1
        return tuple((channel, channel.align(reading)) for channel in channels)

    def _ticks(self, ticks_s: Iterable[float], woken_s: float | None) -> Iterator[Outcome]:
        if woken_s is not None:
            self._silence.wake(woken_s)
        for tick_s in ticks_s:
            yield from self._tick(tick_s)
            yield from self._plots.advance(tick_s)

    def _tick(self, tick_s: float) -> Iterator[Outgoing]:
        silences = self._silence.judge(tick_s, self._supervisor.disarmed(), self._supervisor.steady)
        for heard in chain(silences, self._conflicts.advance(tick_s), self._buses.advance(tick_s)):
            yield from self._supervisor.observe(heard)
        yield from self._supervisor.advance(tick_s)

    def _hear(self, seen: Seen, link: str, reading: Reading, taken: _Taken) -> Iterator[Outcome]:
        if isinstance(reading, LinkState):
            self._silence.link_state(reading)
            return
        self._silence.hear_link(link, reading.time_s)
        for channel, (samples, signal, rare) in taken:
            if signal is not None:
                self._silence.hear_signal(signal, reading.time_s, rare)
            for judgement in channel.judgements(samples):
                seen(judgement)
                self._plots.take(channel.subject, judgement)
                yield from self._judged(judgement)
        if isinstance(reading, BusReading):
            for told in self._buses.take(link, reading, self._supervisor.disarmed()):
                yield from self._supervisor.observe(told)
        yield from self._attend(reading)

    def _judged(self, judgement: Judgement) -> Iterator[Outcome]:
        yield judgement
        for observed in observations(judgement):
            yield from self._supervisor.observe(observed)

    def _attend(self, reading: Reading) -> Iterator[Outcome]:
        """What is no sample of a detector: autopilot, operator, links, this machine."""
        match reading:
            case AutopilotHeartbeat():
                self._silence.hear_signal(AUTOPILOT, reading.time_s)
                yield from self._supervisor.heartbeat(reading)
                for over in self._conflicts.heartbeat(reading.time_s):
                    yield from self._supervisor.observe(over)
            case CommandAcknowledgement():
                yield from self._supervisor.command_ack(reading)
            case OperatorRequest():
                yield from self._desk.take(reading)
            case AutopilotConflict() | IdentityConflict():
                if isinstance(reading, AutopilotConflict):
                    self._supervisor.conflict(len(reading.system_ids) > 1)
                yield from self._supervisor.observe(self._conflicts.take(reading))
            case BusLoad():
                yield from self._supervisor.observe(bus_load_observation(reading, self._load_max[reading.link]))
            case FrameLoss():
                yield from self._supervisor.observe(frame_loss_observation(reading))
            case Lateness():
                yield from self._supervisor.observe(lateness_observation(reading))


def _batches(events: Iterable[Event]) -> Iterator[list[Event]]:
    """Cut behind what changes detectors: they must not have judged yet what comes after it."""
    batch: list[Event] = []
    for event in events:
        batch.append(event)
        if isinstance(event, Now) or not any(map(_accepts, event.readings)):
            continue
        batch.pop()
        for reading in event.readings:
            batch.append(Arrival(event.link, [reading]))
            if _accepts(reading):
                yield batch
                batch = []
    yield batch


def _accepts(reading: Reading) -> bool:
    return isinstance(reading, OperatorRequest) and reading.act is OperatorAct.ACCEPT


def _channels(config: Config, factories: Factories, phase: float) -> Iterator[Channel[Any]]:
    thruster, speed, navigation = factories.thruster, factories.speed, factories.navigation
    if thruster is not None:
        yield from (ThrusterChannel(one, config, thruster, phase) for one in config.thruster)
    if speed is not None and config.speed is not None and config.detector.speed is not None:
        yield SpeedChannel(config.speed, config.detector.speed, config, speed)
    if navigation is not None and config.navigation is not None and config.detector.navigation is not None:
        yield NavigationChannel(config.navigation, config.detector.navigation, config.supervisor.silent_s, navigation)

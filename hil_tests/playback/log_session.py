"""A recorded dive played onto buses and a link, from permission to account."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from drivers.clock import Clock
from gateway.config import Config
from hil_tests.bridge.armed_watch import LISTEN_S, ArmedWatch
from hil_tests.bridge.permission import Granted
from hil_tests.playback.log_outlets import Outlets, check_alone, nobody_else, opened, permitted
from hil_tests.playback.log_play import LogPlay, Sent, Wires
from hil_tests.playback.log_player import LogPlayer, Pace
from hil_tests.playback.recorded import DiveLogs, RecordedDive
from hil_tests.playback.step_keys import StepKeys
from hil_tests.rig.notes import ReceivedText
from hil_tests.scenario.fault import Fault

TEXTS_TOLD = 20  # of those that came back


@dataclass(frozen=True, slots=True, kw_only=True)
class LogSession:
    """What is played, and where.

    Attributes:
        dive: its logs.
        config: whose buses and link they are of.
        faults: laid over it.
        channels: SocketCAN interfaces by the names of the configuration's buses.
        endpoint: of the link; None: its packets go nowhere.
        granted: what may be put onto a real bus.
        pace: how fast; None: stepped.
        seed: of all chance in the faults.
    """

    dive: DiveLogs
    config: Config
    faults: Sequence[Fault] = ()
    channels: Mapping[str, str] = field(default_factory=dict)
    endpoint: str | None = None
    granted: Granted = Granted()  # noqa: RUF009  frozen
    pace: Pace | None = Pace()  # noqa: RUF009
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a play is.

    Attributes:
        dive_s: of the dive, since its part began.
        laps: how often it has begun.
        sent: what was sent just now.
        faults: what they have done, by cause.
        texts: that have come from the other end.
    """

    dive_s: float
    laps: int
    sent: Sent
    faults: Counter[str]
    texts: Sequence[ReceivedText]


async def play_logs(
    session: LogSession,
    shown: Callable[[Progress], None],
    stopped: asyncio.Event,
    keys: StepKeys | None = None,
    listen_s: float = LISTEN_S,
) -> list[str]:
    """Plays until it is over, or stopped.

    Args:
        session: what, and where.
        shown: hears how far it is.
        stopped: ends it.
        keys: ask for the steps of a play without a pace.
        listen_s: how long is listened for an autopilot on the link before.

    Returns:
        An account of it, in lines.

    Raises:
        RefusedError: a real bus without leave, or an autopilot that is there already.
        CanPortError: a bus does not open, or takes no frames any more.
        OSError: a log or the link cannot be opened.
        ValueError: logs that do not go with the configuration, or a fault that they cannot have.
    """
    clock = Clock()
    gates = permitted(session.channels, session.granted)
    if session.endpoint is not None:
        await nobody_else(session.endpoint, clock, listen_s)
    start_s = clock.now()
    dive = RecordedDive(session.dive, session.config, start_s)
    play = LogPlay(dive, Wires.of(session.config, session.faults, start_s, session.seed))
    others = _Others(play, ArmedWatch(start_s), start_s, stopped)
    async with opened(session.channels, gates, session.endpoint, clock, others.hear) as outlets:

        def show(dive_s: float, sent: Sent) -> None:
            others.dive_s = dive_s
            shown(Progress(dive_s, dive.laps, sent, play.wires.counts(), dive.notes.texts))

        player = LogPlayer(play, start_s, outlets, show)
        if session.pace is not None:
            await player.at_pace(session.pace, stopped)
        elif keys is not None:
            await player.stepped(keys.asked)
        if session.endpoint is not None:
            check_alone(others.watch, session.endpoint)
        return _account(play, player.played_s, outlets)


class _Others:
    """Whoever is at the other end of the link: the gateway, a ground station, and nobody who is an autopilot."""

    def __init__(self, play: LogPlay, watch: ArmedWatch, start_s: float, stopped: asyncio.Event) -> None:
        self._play, self._start_s, self._stopped = play, start_s, stopped
        self.watch = watch
        self.dive_s = 0.0

    def hear(self, data: bytes) -> None:
        time_s = self._start_s + self.dive_s
        self.watch.feed(data, time_s)
        if self.watch.heard():
            self._stopped.set()
        self._play.hear(time_s, data)


def _account(play: LogPlay, dive_s: float, outlets: Outlets) -> list[str]:
    dive = play.dive
    lines = [f"played {dive_s:.1f} s of the dive" + (f", in {dive.laps} laps" if dive.laps > 1 else "")]
    lines += [f"{name}: {count} sent" for name, count in outlets.sent.items()]
    lines += outlets.lines()
    lines += [f"left out: {count} {cause}" for cause, count in dive.left_out.items()]
    lines += [f"fault: {count} {cause}" for cause, count in sorted(play.wires.counts().items())]
    lines += _came_back([text.text for text in dive.notes.texts])
    lines += [f"{path}: lost, {line}" for path, lost in dive.damage().items() for line in lost]
    return lines


def _came_back(texts: Sequence[str]) -> list[str]:
    more = [f"came back: {len(texts) - TEXTS_TOLD} texts more"] if len(texts) > TEXTS_TOLD else []
    return [f"came back: {text}" for text in texts[:TEXTS_TOLD]] + more

"""A recorded dive that is played, with what the keys of a player do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from math import inf
from queue import Empty, SimpleQueue

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.outlet import NOTES
from gateway.replay.result import instant
from gateway.watch.pace import Pace
from gateway.watch.recorded_dive import RecordedDive
from gateway.watch.source import Look
from gateway.watch.words import clock

# judged at once: as much as is played from one look to the next, for the more it is the less it costs; on the way to
# another place, so much that a finding is not far behind
STEP_MIN_S, STEP_MAX_S, SEEK_S = 0.05, 10.0, 1.0
SKIP_S = 30.0
# a pause in the logs, in which nothing is to be seen, is passed over
GAP_S = 5.0
# a share of the wanted speed below which the machine is told to be slow
SLOW = 0.8
NEWS = (Level.SUSPECT, Level.FAULT)


class RecordedSource:
    """See `gateway.watch.source.Source`.

    Args:
        name: of the dive, as it is shown.
        dive: begins to read it; again for each time that it is played from its beginning.
        pace: how fast it is played.
        every_s: from one look to the next; a look takes about as long at most, for keys to be heard.
        now: real time, in seconds from anywhere.

    Attributes:
        acts: what may be asked for at any time, from any thread; done at the next look.

    Raises:
        OSError, ValueError: as `dive` does.
    """

    def __init__(
        self, name: str, dive: Callable[[], RecordedDive], pace: Pace, every_s: float, now: Callable[[], float]
    ) -> None:
        self._name, self._make, self._pace, self._every_s, self._now = name, dive, pace, every_s, now
        self._dive = dive()
        self._asked: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._seeking = False
        self._failed = ""
        steps: Mapping[str, Callable[[], None]] = {
            "pause": self._pause,
            "faster": pace.faster,
            "slower": pace.slower,
            "skip": lambda: pace.skip(SKIP_S),
            "next_finding": self._seek,
            "again": self._again,
        }
        self.acts = {name: lambda step=step: self._asked.put(step) for name, step in steps.items()}

    def look(self) -> Look:
        """Plays on to where the dive should be by now, and shows it."""
        try:
            self._do_what_is_asked()
            self._play()
        except (OSError, ValueError) as error:  # of a log that cannot be read any further
            self._failed = str(error)
        dive, told = self._dive, self._dive.telemetry()
        note = "  ".join(filter(None, ("" if told is None else instant(dive.time_s), self._reached())))
        time = clock(0.0 if told is None else dive.time_s - dive.begin_s)
        return Look(told, f"{self._name}, {self._how()}", note, time=time, ended=self._ended)

    def close(self) -> None:
        """Its logs are closed as they are forgotten."""

    @property
    def _ended(self) -> bool:
        return bool(self._failed) or self._dive.next_s == inf

    def _do_what_is_asked(self) -> None:
        with suppress(Empty):
            while True:
                self._asked.get_nowait()()

    def _play(self) -> None:
        dive, until_s = self._dive, self._now() + self._every_s
        wanted_s = self._pace.wanted_s(self._now())
        if not self._pace.paused and dive.next_s > dive.time_s + GAP_S:
            wanted_s = max(wanted_s, dive.next_s - dive.begin_s)
        while dive.next_s <= dive.begin_s + wanted_s and not self._ended and self._now() < until_s:
            if any(map(_is_news, dive.step(self._step_s))) and self._seeking:
                self._seeking = False
                self._pace.stay()
                break
        reached_s = dive.time_s - dive.begin_s if self._ended else min(wanted_s, dive.next_s - dive.begin_s)
        self._pace.at(reached_s, self._now())

    @property
    def _step_s(self) -> float:
        return SEEK_S if self._pace.skipping else min(max(STEP_MIN_S, self._pace.speed * self._every_s), STEP_MAX_S)

    def _pause(self) -> None:
        self._seeking = False
        self._pace.toggle()

    def _seek(self) -> None:
        self._seeking = True
        self._pace.skip(inf)

    def _again(self) -> None:
        self._dive = self._make()
        self._pace.restart()
        self._seeking, self._failed = False, ""

    def _how(self) -> str:
        pace = self._pace
        if self._failed:
            return f"stopped: {self._failed}"
        if self._ended:
            return "; ".join(["end of the dive", *self._dive.lost()])
        if pace.skipping:
            return "on to the next finding" if self._seeking else "on"
        return "paused" if pace.paused else f"{pace.speed:g} times real time"

    def _reached(self) -> str:
        """The speed that there is, where it is another than the one that is wanted."""
        pace = self._pace
        if self._ended or not (pace.skipping or pace.reached < SLOW * pace.speed):
            return ""
        return f"({pace.reached:.1f} times, as fast as this machine can)"


def _is_news(finding: Finding) -> bool:
    return finding.level in NEWS and finding.detector not in NOTES

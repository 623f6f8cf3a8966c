"""Watches that links are alive, and that what the detectors need of them keeps coming. Judged on ticks only.

Where a whole link is silent, that is said, and not that each of its signals is, nor that a bus is which is read over
it; where an ESC is, not that its RPM is, too. Commands are not missed while the vehicle is disarmed: some autopilots
do not send any then.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from detectors.verdict import Level
from drivers.readings import LinkState
from gateway.observation import Observation

# what has never been heard gets this long to begin: an autopilot boots for some seconds
START_S = 5.0
# what comes once in two seconds is rare, and not silent
RARE_S = 3.0
# subject of the autopilot's HEARTBEAT, which may be lost while others still speak on the link
AUTOPILOT = "autopilot"


# whether nothing comes of a subject that is observed in a level once more, see `Supervisor.steady`
Steady = Callable[[str, float, Level], bool]


def _never(_subject: str, _time_s: float, _level: Level) -> bool:
    return False


@dataclass(frozen=True, slots=True)
class Watched:
    """Something that should be heard again and again.

    Attributes:
        detector: "link" or "signal".
        subject: in findings.
        label: in texts.
        link: the link that it comes over.
        limit_s: silence that counts.
        armed_only: not missed while the vehicle is disarmed.
        part_of: subject of the signal that this is a part of: while all of that is silent, only that is said.
        carrier: of a link, the link that it is read over: while that is silent or down, only that is said.
    """

    detector: str
    subject: str
    label: str
    link: str
    limit_s: float
    armed_only: bool = False
    part_of: str | None = None
    carrier: str | None = None


class _Ear:
    """When one watched thing was heard."""

    def __init__(self, watched: Watched) -> None:
        self.watched = watched
        self._since_s: float | None = None
        self._heard = False
        self._silence_s = 0.0
        self._rare_s = -math.inf
        self._settled = False  # that it is well is known, and would be no news

    def hear_rare(self, time_s: float) -> None:
        """Something came, and too rarely to be of use."""
        self._rare_s = time_s

    def hear(self, time_s: float, until_s: float) -> None:
        if self._since_s is not None and time_s < self._since_s:
            self._since_s = max(self._since_s, until_s)
            return  # late, and no news
        if self._heard and self.silent(time_s):
            self._silence_s = self.age_s(time_s)
        self._heard = True
        self._since_s = until_s

    def start(self, time_s: float) -> None:
        """Silence counts from now on, as if it had been heard."""
        if self._since_s is None or self._since_s < time_s:
            self._since_s = time_s

    def age_s(self, time_s: float) -> float:
        return 0.0 if self._since_s is None else time_s - self._since_s

    def silent(self, time_s: float) -> bool:
        limit_s = self.watched.limit_s if self._heard else max(self.watched.limit_s, START_S)
        return self.age_s(time_s) > limit_s

    def observation(self, time_s: float, steady: Steady, trouble: str = "") -> Observation | None:
        """What to say now; `trouble` that the driver tells counts at once, but not while a link still begins."""
        silent = self.silent(time_s)
        self._settled = not (silent or trouble) and (
            self._settled or steady(self.watched.subject, time_s, Level.NORMAL)
        )
        if self._settled:
            return None
        if silent or (trouble and self._heard):
            rare = time_s - self._rare_s <= max(self.watched.limit_s, RARE_S)
            trouble = trouble or ("too rare to judge by" if rare else f"silent {self.age_s(time_s):.1f} s")
            return self._observation(time_s, Level.SUSPECT, trouble, ())
        details = (f"after {self._silence_s:.1f} s",) if self._silence_s else ()
        return self._observation(time_s, Level.NORMAL, "", details) if self._heard else None

    def silent_from_s(self) -> float:
        """When it will be silent if nothing more comes, or a millisecond before: what is close is to be looked at."""
        return -math.inf if self._since_s is None else self._since_s + self.watched.limit_s - 0.001

    def calm(self, time_s: float) -> bool:
        """Whether there is nothing to say of it for sure."""
        return self._settled and not self.silent(time_s)

    def _observation(self, time_s: float, level: Level, trouble: str, details: tuple[str, ...]) -> Observation:
        watched = self.watched
        return Observation(
            time_s, watched.detector, watched.subject, watched.label, level, math.nan, trouble, details
        )


class SilenceWatch:
    """Hears of readings and link states; says on ticks what has fallen silent.

    Args:
        links: by their names; `link` is their own name.
        signals: each over one of these links.
    """

    def __init__(self, links: Iterable[Watched], signals: Iterable[Watched]) -> None:
        self._links = {watched.link: _Ear(watched) for watched in links}
        self._signals = {watched.subject: _Ear(watched) for watched in signals}
        self._by_link: defaultdict[str, list[_Ear]] = defaultdict(list)
        for signal in self._signals.values():
            self._by_link[signal.watched.link].append(signal)
        self._states: dict[str, LinkState] = {}
        self._calm_until_s: dict[str, float] = {}
        self._started = False

    @property
    def subjects(self) -> frozenset[str]:
        """All that is listened for, as in the findings."""
        return frozenset(ear.watched.subject for ear in (*self._links.values(), *self._signals.values()))

    def hear_link(self, link: str, time_s: float, until_s: float | None = None) -> None:
        """A reading came over this link; `until_s`: and others until then, without a gap as long as `patience_s`."""
        ear = self._links.get(link)
        if ear is not None:
            if ear.silent(time_s):
                self._give_signals_time(link, time_s)
            ear.hear(time_s, time_s if until_s is None else until_s)

    def patience_s(self, link: str, subject: str | None = None) -> float:
        """For how long a link, or a signal of it, may say nothing without anybody noticing, even another signal."""
        watched = [ear.watched for ear in (self._links.get(link), *self._by_link[link]) if ear is not None]
        if subject is None:
            # others are judged only while the link was heard of late: see `_alive`
            return min((one.limit_s for one in watched), default=math.inf) / 2.0
        return min((one.limit_s for one in watched if one.subject == subject), default=math.inf)

    def hear_signal(self, subject: str, time_s: float, rare: bool = False, until_s: float | None = None) -> None:
        """Something of this signal came in, and so of that which it is a part of.

        Args:
            subject: of the signal; one that is not watched is let pass.
            time_s: when.
            rare: it comes, but too rarely to be of use: as good as silent.
            until_s: from then on it came again and again until now, without a gap longer than `patience_s`.
        """
        part = self._signals.get(subject)
        for ear in () if part is None else (part, self._whole(part)):
            if ear is None:
                continue
            if rare:
                ear.hear_rare(time_s)
            else:
                ear.hear(time_s, time_s if until_s is None else until_s)

    def link_state(self, state: LinkState) -> None:
        """The driver says that a link came up, went down, or has trouble while it is up."""
        if state.link not in self._links:
            return
        if state.up and not self._is_up(state.link):
            self._give_signals_time(state.link, state.time_s)
        self._states[state.link] = state
        self._calm_until_s.pop(state.link, None)

    def wake(self, time_s: float) -> None:
        """Nobody listened until now: silence counts from here."""
        for ear in (*self._links.values(), *self._signals.values()):
            ear.start(time_s)

    def judge(self, time_s: float, disarmed: bool, steady: Steady = _never) -> Iterator[Observation]:
        """What is silent and what is not, at a tick; what is steady need not be said."""
        if not self._started:
            self._started = True
            self.wake(time_s)
        for link, ear in self._links.items():
            if self._lacks_carrier(ear.watched, time_s):
                ear.start(time_s)
                self._give_signals_time(link, time_s)
                continue
            if time_s <= self._calm_until_s.get(link, -math.inf) and not disarmed:
                continue
            yield from _some(ear.observation(time_s, steady, self._trouble(link)))
            if self._is_up(link):
                yield from self._judge_signals(link, time_s, disarmed, steady)
            self._look_ahead(link, time_s)

    def _lacks_carrier(self, link: Watched, time_s: float) -> bool:
        carrier = link.carrier
        return carrier is not None and not (self._is_up(carrier) and self._alive(carrier, link.limit_s, time_s))

    def _judge_signals(self, link: str, time_s: float, disarmed: bool, steady: Steady) -> Iterator[Observation]:
        for signal in self._by_link[link]:
            missed = not (disarmed and signal.watched.armed_only)
            if (missed and signal.calm(time_s)) or not self._alive(link, signal.watched.limit_s, time_s):
                continue
            whole = self._whole(signal)
            if not missed or (whole is not None and whole.silent(time_s)):
                signal.start(time_s)
            else:
                yield from _some(signal.observation(time_s, steady))

    def _look_ahead(self, link: str, time_s: float) -> None:
        """Until when there is surely nothing to say: none of them can be silent sooner."""
        ears = (self._links[link], *self._by_link[link])
        alone = self._links[link].watched.carrier is None
        calm = alone and not self._trouble(link) and all(ear.calm(time_s) for ear in ears)
        self._calm_until_s[link] = min(ear.silent_from_s() for ear in ears) if calm else -math.inf

    def _whole(self, part: _Ear) -> _Ear | None:
        return None if part.watched.part_of is None else self._signals[part.watched.part_of]

    def _alive(self, link: str, limit_s: float, time_s: float) -> bool:
        # heard of late, so that a silent signal is not just the first to show that the link falls silent
        ear = self._links[link]
        return ear.age_s(time_s) < min(ear.watched.limit_s, limit_s) / 2.0

    def _is_up(self, link: str) -> bool:
        return link not in self._states or self._states[link].up

    def _trouble(self, link: str) -> str:
        state = self._states.get(link)
        if state is None or state.up:
            return "" if state is None else state.detail
        return f"down: {state.detail}" if state.detail else "down"

    def _give_signals_time(self, link: str, time_s: float) -> None:
        """After a silence of the whole link its signals are not missed before their own time."""
        for signal in self._by_link[link]:
            signal.start(time_s)


def _some(observation: Observation | None) -> Iterator[Observation]:
    if observation is not None:
        yield observation

"""When to learn: at intervals that grow, not while a fault may begin, and rarely where nothing is new."""

from __future__ import annotations

import numpy as np

from detectors.thruster.config import ThrusterConfig

CALM = 0.8  # the model is not learnt anew while the score is above this ...
POSTPONE, POSTPONE_MAX = 25, 8  # ... but this many samples later, so many times at most
INTERVAL_MIN, INTERVAL_MAX = 50, 300  # samples from learning to learning, ...
IDLE_MAX = 3  # ... but so many more intervals where nothing new was seen
DRIFTED = 0.01  # gain error from which on there is something new
YOUNG = 2  # longest windows: before, each learning has more to learn from than the one before it
STAGGER = 17  # samples
RETRY = 50  # samples to the next attempt to learn when there was too little to learn from


class Schedule:
    """When a thruster's model is learnt, in numbers of samples.

    Args:
        config: settings; its seed makes the interval a little longer, for not all thrusters to learn at once.

    Attributes:
        due: sample before which to learn, or to think about it again.
    """

    def __init__(self, config: ThrusterConfig) -> None:
        _, window_max, self._warmup = config.spans
        self._young_until = YOUNG * window_max
        self._stagger = config.seed % STAGGER
        self.due = self._warmup
        self._postponed = self._idle = 0
        self._news = True

    def is_young(self, now: int) -> bool:
        """Whether windows are still filling up."""
        return now < self._young_until

    def postpone(self, now: int, faulty: bool, score: float) -> bool:
        """Whether this is no time to learn: a fault lasts, or may be about to be found."""
        if not faulty and not (score > CALM and self._postponed < POSTPONE_MAX):
            self._postponed = 0
            return False
        self._postponed += 1
        self.due = now + POSTPONE
        return True

    def may_idle(self, now: int, gain_error: float) -> bool:
        """Whether nothing new was seen since the last learning, and that is not long ago."""
        return not (self.is_young(now) or self._news or self._idle >= IDLE_MAX or abs(gain_error) > DRIFTED)

    def stay_idle(self, now: int) -> None:
        """This time nothing is learnt."""
        self._idle += 1
        self.due = now + self._interval(now)

    def saw_news(self) -> None:
        """Something was seen that the model does not know: the next learning is not left out."""
        self._news = True

    def learnt(self, now: int) -> None:
        """A model was learnt."""
        self._idle, self._news = 0, False
        self.due = now + self._interval(now)

    def confirm(self, now: int) -> None:
        """What was learnt wants to be confirmed soon."""
        self.due = min(self.due, now + INTERVAL_MIN)
        self._news = True

    def try_again(self, now: int) -> None:
        """There was too little to learn from."""
        self.due = now + RETRY

    def begin_anew(self, now: int) -> None:
        """The thruster is another one from here on."""
        self.due = now + self._warmup
        self._news = True

    def _interval(self, now: int) -> int:
        return int(np.clip(now // 10, INTERVAL_MIN, INTERVAL_MAX)) + self._stagger

"""Which speed is normal now: a fixed range, or one about a curve over the command that is configured or learnt."""

from __future__ import annotations

from dataclasses import dataclass
from math import expm1, sqrt

from detectors.speed.config import SpeedConfig
from detectors.speed.curve import SpeedCurve

STOPPED = 0.05  # a command below this gives no thrust that counts
LEAST_SHARE = 0.25  # below this share of the greatest normal speed, thrust and drag are too little known to judge by
USUAL_S = 10.0  # the usual command is the mean of the first so many seconds under way
LEARNT_S = 20.0  # a point of the curve is the mean of so many seconds in which the speed was well known
LEAST_LEARNT = 0.15  # a vehicle that makes less of the speed that may be expected is caught already: not normal
UNITY = 1.0  # stands for the command where there is none


@dataclass(frozen=True, slots=True)
class NormalRange:
    """The normal speed at the present command.

    Attributes:
        usual_mps: what a healthy vehicle does.
        low, high: what is normal, in shares of it.
    """

    usual_mps: float
    low: float
    high: float

    @property
    def limits_mps(self) -> tuple[float, float]:
        """Lowest and highest normal speed; astern both are negative, and the slower one is still the first."""
        return self.low * self.usual_mps, self.high * self.usual_mps


@dataclass(slots=True)
class _Mean:
    """What is learnt about a command: mean command and speed over so many seconds."""

    seconds: float = 0.0
    command: float = 0.0
    speed_mps: float = 0.0

    def take(self, command: float, speed_mps: float, interval_s: float) -> None:
        self.seconds += interval_s
        gain = min(interval_s / self.seconds, 1.0)
        self.command += (command - self.command) * gain
        self.speed_mps += (speed_mps - self.speed_mps) * gain


class NormalSpeed:
    """Knows the normal speed at each command that was driven, and learns the others. Picklable.

    Without commands the curve is one point. A fixed range holds at the usual command, and at others in proportion to
    the curve, which is learnt there.

    Args:
        config: settings.
        curve: learnt on an earlier dive.
    """

    def __init__(self, config: SpeedConfig, curve: SpeedCurve | None = None) -> None:
        self.reference_mps = config.speed_scale_mps
        self._seeded = config.speed_min_mps is not None
        self._low, self._high = config.normal_shares
        self.curve = curve or config.speed_curve
        if self.curve is None and self._seeded and config.range_command is not None:
            self.curve = SpeedCurve((config.range_command,), (self.reference_mps,))
        self._by_command = self.curve is not None and curve is None  # what was given means nothing without commands
        self._usual = 0.0
        self._usual_s = 0.0
        self._learning: dict[int, _Mean] = {}  # by tenths of the command
        self._smooth: float | None = None
        self._told: float | None = None
        self._known = True
        self._surge_time_s = config.surge_time_s

    def follow(self, command: float | None, interval_s: float) -> None:
        """Takes the command that held during an interval."""
        if command is not None and self._told is None and not self._by_command:
            self._begin_by_command()
        self._known = command is not None or (self._told is None and not self._by_command)
        self._told = self._told if command is None else command
        told = self._present()
        before = told if self._smooth is None else self._smooth
        self._smooth = before + (told - before) * -expm1(-interval_s / self._surge_time_s)
        if self.curve is None and self._usual_s < USUAL_S and abs(told) > STOPPED:
            self._settle(abs(told), interval_s)

    def _begin_by_command(self) -> None:
        """The first command: what was learnt or assumed without any is of no use."""
        self._by_command = True
        if self.curve is not None and self.curve.commands == (UNITY,):
            self.curve = None
        self._usual = self._usual_s = 0.0
        self._learning.clear()

    def _settle(self, told: float, interval_s: float) -> None:
        """Finds the usual command, and begins a curve that is given there."""
        self._usual_s += interval_s
        self._usual += (told - self._usual) * min(interval_s / self._usual_s, 1.0) if self._usual_s > 0.0 else told
        if self._seeded and (self._usual_s >= USUAL_S or self._told is None):
            self.curve = SpeedCurve((self._usual,), (self.reference_mps,))

    def _present(self) -> float:
        """The newest command that is known."""
        return UNITY if self._told is None else self._told

    def share(self) -> float:
        """Speed that the present command leads to, as a share of the reference; a guess where it was not learnt."""
        return self._share_at(self._present())

    def _share_at(self, command: float) -> float:
        if self.curve is not None:
            return self.curve.speed_mps(command) / self.reference_mps
        if abs(command) <= STOPPED:
            return 0.0
        return command / self._usual if self._usual_s >= USUAL_S else (1.0 if command > 0.0 else -1.0)

    def range(self) -> NormalRange | None:
        """The normal speed at the present command, as the hull has followed it; None where it is not known."""
        if self.curve is None or not self._known:
            return None
        command = self._followed
        if self.curve.covers(command):
            return NormalRange(self.curve.speed_mps(command), self._low, self._high)
        beyond = self.curve.beyond(command)
        if beyond <= 1.0:
            return None
        # more thrust than was ever learnt: the speed grows, by no more than in proportion and no less than its root
        return NormalRange(self.curve.speed_mps(command), self._low / sqrt(beyond), self._high)

    @property
    def command_lost(self) -> bool:
        """Whether there should be a command and is none."""
        return not self._known

    @property
    def learnt(self) -> bool:
        """Whether the normal speed at the present command was given or learnt, and is not only bounded."""
        return self.curve is not None and self.curve.covers(self._followed)

    @property
    def stopped(self) -> bool:
        """Whether the thrusters give next to nothing."""
        greatest = 1.0 if self.curve is None else max(map(abs, self.curve.speeds_mps)) / self.reference_mps
        return abs(self._share_at(self._followed)) < LEAST_SHARE * greatest

    @property
    def _followed(self) -> float:
        """The command as the hull has followed it."""
        return self._present() if self._smooth is None else self._smooth

    def learn(self, ratio: float, interval_s: float) -> float:
        """Takes a speed that is well known and healthy; returns by what the estimator's speed is to be multiplied.

        Args:
            ratio: the speed, as a share of what the curve, or the guess in its place, gives at this command.
            interval_s: for so long.
        """
        learning = self.curve is not None or self._usual_s >= USUAL_S
        if not learning or not self._known or self.stopped or self.learnt:
            return 1.0
        foreseen = self._share_at(self._followed)
        tenth = round(10.0 * self._followed)
        mean = self._learning.setdefault(tenth, _Mean())
        mean.take(self._followed, ratio * foreseen * self.reference_mps, interval_s)
        usual_mps = foreseen * self.reference_mps
        if mean.seconds < LEARNT_S or mean.speed_mps / usual_mps < LEAST_LEARNT:
            return 1.0
        del self._learning[tenth]
        return self._insert(mean.command, mean.speed_mps)

    def _insert(self, command: float, speed_mps: float) -> float:
        foreseen = self._share_at(self._followed)
        point = SpeedCurve((command,), (speed_mps,))
        self.curve = point if self.curve is None else self.curve.with_point(command, speed_mps)
        return foreseen / self._share_at(self._followed)

    def accept(self, ratio: float) -> None:
        """From now on so many times the present curve is normal."""
        if self.curve is not None:
            self.curve = self.curve.scaled(ratio)

    def forget(self) -> None:
        """What is driven next is normal."""
        self.curve, self._seeded = None, False
        self._usual, self._usual_s = 0.0, 0.0
        self._learning.clear()

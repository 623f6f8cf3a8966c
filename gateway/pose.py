"""Joins positions, attitudes and commands, which come unevenly, into the samples of the speed detector.

- **Position sample.** Each new place (`gateway.position`) gives a sample at its own time. Heading and pitch are
  linear between the two attitudes around it, the short way round, so the sample waits for the later one: up to 50 ms.
- **Gap.** Two attitudes more than `HOLD_S` apart are not joined: a place within `HOLD_S` of the earlier one takes its
  heading, a later one is refused.
- **Heading sample.** The detector needs the integral of the heading between two places. An attitude that comes
  `HEADING_PERIOD_S` or more after the newest sample gives one that repeats the last place: at 5 Hz and more of
  positions there is none. For this it, too, waits for the next attitude. No place, or one older than
  `position.SILENT_S`: no sample.
- **Command.** What the thrusters were told over the time since the sample before, of which the last
  `HEADING_PERIOD_S` count (`gateway.thrust`).
- **Restart of the autopilot.** Its local position begins anew: what was half joined is forgotten.
- **Order.** Samples come in the order of their times, no two at one. What comes too late for that is refused and
  counted in `drops`. Nothing here raises on data.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterator

from detectors.speed.sample import PoseSample
from drivers.readings import Attitude
from gateway.position import SILENT_S, Place, PositionReading, PositionTrack
from gateway.thrust import ThrustDemand

HOLD_S = 0.5
HEADING_PERIOD_S = 0.2


class PoseAligner:
    """Positions, attitudes and commands in, pose samples out. See the module's text for the rules.

    Args:
        track: chooses the source of positions.
        demand: adds up the commands.

    Attributes:
        track, demand: as given.
    """

    def __init__(self, track: PositionTrack, demand: ThrustDemand) -> None:
        self.track = track
        self.demand = demand
        self._drops: Counter[str] = Counter()
        self._before: Attitude | None = None  # the newest attitude but one, and
        self._newest: Attitude | None = None
        self._waiting: deque[Place] = deque()  # newer than the newest attitude, but not by more than HOLD_S
        self._place: Place | None = None
        self._sample_s = -math.inf

    @property
    def drops(self) -> Counter[str]:
        """Refused inputs by cause."""
        return self._drops + self.track.drops

    def position(self, reading: PositionReading) -> list[PoseSample]:
        """Takes a position; gives out the samples that it completes, oldest first."""
        place = self.track.take(reading)
        if place is None:
            return []
        newest = self._newest
        if newest is None or place.time_s - newest.time_s > HOLD_S:
            self._drops["position without attitude"] += 1
            return [] if newest is None else list(self._with_heading_of(newest))
        if place.time_s > newest.time_s:
            self._waiting.append(place)
            return []
        return list(self._between(self._joined_to(newest), newest, place))

    def attitude(self, reading: Attitude) -> list[PoseSample]:
        """Takes an attitude; gives out the samples that it completes, oldest first."""
        before = self._newest
        if before is not None and reading.time_s <= before.time_s:
            self._drops["attitude time ran backwards"] += 1
            return []
        self._before, self._newest = before, reading
        return [] if before is None else list(self._completed(before, reading))

    def restart(self) -> None:
        """The autopilot restarted."""
        self._before = self._newest = self._place = None
        self._waiting.clear()

    def _joined_to(self, newest: Attitude) -> Attitude:
        """The attitude before the newest, or that one itself where there is a gap."""
        before = self._before
        return newest if before is None or newest.time_s - before.time_s > HOLD_S else before

    def _completed(self, before: Attitude, now: Attitude) -> Iterator[PoseSample]:
        yield from self._heading_sample(before)
        if now.time_s - before.time_s > HOLD_S:
            yield from self._with_heading_of(before)
        while self._waiting and self._waiting[0].time_s <= now.time_s:
            yield from self._between(before, now, self._waiting.popleft())

    def _heading_sample(self, attitude: Attitude) -> Iterator[PoseSample]:
        """The last place once more, with a newer heading."""
        place = self._place
        due = attitude.time_s - self._sample_s >= HEADING_PERIOD_S
        if place is not None and due and attitude.time_s - place.time_s <= SILENT_S:
            yield self._sample(attitude.time_s, place, attitude.yaw_rad, attitude.pitch_rad)

    def _with_heading_of(self, attitude: Attitude) -> Iterator[PoseSample]:
        while self._waiting:
            yield from self._between(attitude, attitude, self._waiting.popleft())

    def _between(self, earlier: Attitude, later: Attitude, place: Place) -> Iterator[PoseSample]:
        if place.time_s < earlier.time_s or place.time_s <= self._sample_s:
            self._drops["position late"] += 1
            return
        span_s = later.time_s - earlier.time_s
        share = (place.time_s - earlier.time_s) / span_s if span_s else 0.0
        turn_rad = math.remainder(later.yaw_rad - earlier.yaw_rad, math.tau)  # the short way round
        heading_rad = math.remainder(earlier.yaw_rad + share * turn_rad, math.tau)
        self._place = place
        pitch_rad = earlier.pitch_rad + share * (later.pitch_rad - earlier.pitch_rad)
        yield self._sample(place.time_s, place, heading_rad, pitch_rad)

    def _sample(self, time_s: float, place: Place, heading_rad: float, pitch_rad: float) -> PoseSample:
        ahead, right = self.demand.over(max(self._sample_s, time_s - HEADING_PERIOD_S), time_s)
        self._sample_s = time_s
        return PoseSample(
            time_s, place.north_m, place.east_m, heading_rad, place.down_m, pitch_rad, command=ahead, sideways=right
        )

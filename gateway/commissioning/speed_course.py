"""A dive as `SpeedFit` wants it: mean positions over some seconds, and the ways that led to them, by command.

Speed and current enter a position linearly: it moves by the current times the interval, and for each level of thrust
by the speed there times the way at 1 m/s. What the unknown speeds belong to are the `Levels`; between two of them,
and to no thrust, the speed is straight, as on the detector's own `SpeedCurve`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from detectors.speed import PoseSample

FloatArray = NDArray[np.float64]

STOPPED = 0.05  # a command below this gives no thrust that counts
PARTS = 20  # levels that the full thrust is cut into, at most
LEVEL_S = 15.0  # a level was driven for so long, altogether
BLOCK_S = 2.0
GAP_S = 20.0  # the way through a longer gap is not known
SETTLING_S = 8.0  # until the hull moves as the thrust since the beginning, or since a gap, says
SURGE_S = (0.3, 0.6, 1.2, 2.5, 5.0, 10.0)  # time constants that are tried
# A hull slips sideways in a turn: at once, or after so long; a large ship's drift follows its rudder by half a minute
SLIP_LAGS_S = (4.0, 16.0)
UNITY = 1.0  # stands for the command where there is none


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Samples of one dive, as columns.

    Attributes:
        time_s, north_m, east_m, heading_rad: (N,)
        command: (N,) since the sample before; NaN: not known, 1 throughout: the vehicle tells none.
        sideways: (N,)
    """

    time_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    heading_rad: FloatArray
    command: FloatArray
    sideways: FloatArray

    @classmethod
    def of(cls, samples: Sequence[PoseSample]) -> Track:
        """The columns of samples in the order of their times; what is not finite is left out, as the watch does."""
        told = any(one.command is not None for one in samples)
        unknown = nan if told else UNITY
        rows = [
            (
                one.time_s,
                one.north_m,
                one.east_m,
                one.heading_rad,
                unknown if one.command is None else one.command,
                one.sideways,
            )
            for one in samples
        ]
        found = np.array(rows, dtype=np.float64).reshape(-1, 6)
        return cls(*found[np.isfinite(found[:, :4]).all(axis=1)].T)

    @property
    def interval_s(self) -> FloatArray:
        """(N,) since the sample before; the first is 0."""
        return np.diff(self.time_s, prepend=self.time_s[:1])

    @property
    def told(self) -> bool:
        """Whether the command is known."""
        return bool(len(self.command) and not (self.command == UNITY).all())


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """(K,) commands at which the vehicle was driven, ascending, none of them 0; and for how long each."""

    commands: FloatArray
    seconds: FloatArray

    @classmethod
    def driven(cls, tracks: Sequence[Track]) -> Levels:
        """By twentieths of the command: its mean, where the time at it is long enough."""
        commands = np.concatenate([track.command for track in tracks] or [np.empty(0)])
        seconds = np.concatenate([track.interval_s for track in tracks] or [np.empty(0)])
        counts = np.isfinite(commands) & (np.abs(commands) >= STOPPED) & (seconds <= GAP_S)
        commands, seconds = commands[counts], seconds[counts]
        parts = np.round(PARTS * commands)
        found = []
        for part in np.unique(parts):
            at = parts == part
            total_s = float(seconds[at].sum())
            if total_s >= LEVEL_S:
                found.append((float(commands[at] @ seconds[at]) / total_s, total_s))
        return cls(*np.array(found, dtype=np.float64).reshape(-1, 2).T)

    def shares(self, command: FloatArray) -> FloatArray:
        """(N, K) how much the speed at each level counts in that at each of the (N,) commands."""
        shares = np.zeros((len(command), len(self.commands)))
        ahead = self._one_way(command, self.commands > 0.0)
        astern = self._one_way(-command, self.commands < 0.0)
        for index, share in {**ahead, **astern}.items():
            shares[:, index] = share
        if not ahead or not astern:  # driven one way only: the other way in proportion to the least of these
            least = int(np.argmin(np.abs(self.commands)))
            other = command * self.commands[least] < 0.0
            shares[other, least] = command[other] / self.commands[least]
        return shares

    def _one_way(self, size: FloatArray, which: NDArray[np.bool_]) -> dict[int, FloatArray]:
        """By the index of a level: its (N,) shares in commands of this size; commands the other way are negative."""
        indices = np.flatnonzero(which)
        indices = indices[np.argsort(np.abs(self.commands[indices]))]
        known = np.concatenate(([0.0], np.abs(self.commands[indices])))
        found = {}
        for place, index in enumerate(indices, start=1):
            peak = np.zeros(len(known))
            peak[place] = 1.0
            share = np.interp(np.maximum(size, 0.0), known, peak)
            if place == len(known) - 1:
                share = np.where(size > known[-1], size / known[-1], share)
            found[int(index)] = share
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """One dive: B mean positions and the ways to them.

    Attributes:
        time_s: (B,) of each.
        position_m: (B, 2) north, east.
        ways: (B, S, 2, K + 4) from the position before, for each of `SURGE_S`: the way at 1 m/s at each level, that
            to the right at full sideways thrust, and the turning to the right (see `detectors.speed.estimate.Step`),
            at once and later.
        begins: (B,) nothing is known of the way to this one.
    """

    time_s: FloatArray
    position_m: FloatArray
    ways: FloatArray
    begins: NDArray[np.bool_]

    @classmethod
    def of(cls, track: Track, levels: Levels) -> Course:
        """Of one dive; empty where it has no position."""
        passed, lost = _passed(track, levels)
        position_m = np.column_stack((track.north_m, track.east_m))
        if not len(position_m):
            return cls(track.time_s, position_m, passed, np.empty(0, dtype=np.bool_))
        places = np.flatnonzero(np.append(True, (np.diff(position_m, axis=0) != 0.0).any(axis=1)))
        firsts = _firsts(track.time_s[places], lost[places])
        counts = np.diff(np.append(firsts, len(places)))

        def mean(values: FloatArray) -> FloatArray:
            total = np.add.reduceat(values[places], firsts, axis=0)
            return np.asarray(total / counts.reshape(-1, *[1] * (values.ndim - 1)))

        ways = mean(passed)
        return cls(
            time_s=mean(track.time_s),
            position_m=mean(position_m),
            ways=np.diff(ways, axis=0, prepend=ways[:1]),
            begins=np.append(True, np.diff(lost[places][firsts]) != 0),
        )


def _firsts(time_s: FloatArray, lost: NDArray[np.int64]) -> NDArray[np.intp]:
    """Indices of the positions with which blocks begin; none goes over a gap."""
    firsts, begin_s, before = [], -np.inf, -1
    for index, (now_s, gap) in enumerate(zip(time_s.tolist(), lost.tolist(), strict=True)):
        if gap != before or now_s - begin_s >= BLOCK_S:
            firsts.append(index)
            begin_s, before = now_s, gap
    return np.array(firsts, dtype=np.intp)


def _passed(track: Track, levels: Levels) -> tuple[FloatArray, NDArray[np.int64]]:
    """(N, S, 2, K + 4) ways since the beginning, and (N,) how often the way was lost until then."""
    interval_s = track.interval_s
    turn_rad = np.remainder(np.diff(track.heading_rad, prepend=track.heading_rad[:1]) + np.pi, 2.0 * np.pi) - np.pi
    middle_rad = track.heading_rad - 0.5 * turn_rad
    broken = (interval_s > GAP_S) | ~np.isfinite(track.command)
    broken[:1] = True
    turn_rad[broken] = 0.0
    passed_s = np.where(broken, 0.0, interval_s)
    told = np.column_stack((levels.shares(np.nan_to_num(track.command)), track.sideways))
    followed_s = _followed(told, passed_s, SURGE_S)  # (N, S, K + 1)
    chord = np.sinc(0.5 * turn_rad / np.pi)[:, None]
    forward = chord * np.column_stack((np.cos(middle_rad), np.sin(middle_rad)))
    right = chord * np.column_stack((-np.sin(middle_rad), np.cos(middle_rad)))
    turned = _turned(turn_rad, passed_s)
    ahead = forward[:, None, :, None] * followed_s[:, :, None, :-1]
    aside = right[:, None, :, None] * followed_s[:, :, None, -1:]
    slipped = np.broadcast_to(right[:, None, :, None] * turned[:, None, None, :], (*aside.shape[:3], turned.shape[1]))
    return np.cumsum(np.concatenate((ahead, aside, slipped), axis=3), axis=0), np.cumsum(
        broken | _settling(track.time_s, broken)
    )


def _settling(time_s: FloatArray, broken: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(N,) whether the last break was a moment ago; the first sample is one."""
    last = np.maximum.accumulate(np.where(broken, np.arange(len(broken)), 0))
    return np.asarray(time_s - time_s[last] < SETTLING_S)


def _turned(turn_rad: FloatArray, interval_s: FloatArray) -> FloatArray:
    """(N, 1 + L) turning (rad) in each interval, as it is and as a hull follows it."""
    rate = np.divide(turn_rad, interval_s, out=np.zeros_like(turn_rad), where=interval_s > 0.0)
    later = _followed(rate[:, None], interval_s, SLIP_LAGS_S)[..., 0]
    return np.column_stack((turn_rad, later))


def _followed(told: FloatArray, interval_s: FloatArray, lags_s: Sequence[float]) -> FloatArray:
    """(N, L, C) integral over each interval of what was told (N, C), followed by first-order lags (L of them).

    Through an interval of no length, which is one that is not known, all lags have come to their end.
    """
    lag_s = np.array(lags_s)[:, None]
    found = np.zeros((len(told), len(lags_s), told.shape[1]))
    share = np.zeros(found.shape[1:])
    gone = -np.expm1(-interval_s[:, None, None] / lag_s)
    for index, wanted in enumerate(told):
        share = share if interval_s[index] > 0.0 else np.broadcast_to(wanted, share.shape)
        behind = (share - wanted) * gone[index]
        found[index] = wanted * interval_s[index] + behind * lag_s
        share = share - behind
    return found

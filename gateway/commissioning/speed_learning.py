"""The normal speed at each level of thrust, out of the samples of healthy dives; or what these dives lack for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.speed import PoseSample, SpeedCurve
from gateway.commissioning.speed_course import STOPPED, Course, Levels, Track
from gateway.commissioning.speed_fit import SpeedFit, fit_speed
from gateway.commissioning.speed_tolerance import Normal

FloatArray: TypeAlias = NDArray[np.float64]

UNDER_WAY_S = 180.0
ERROR_MAX = 0.1  # a speed that is known less well than this, as a share of it, is no normal one
COVERED = 0.8  # of the time under way must be at thrust that the speed is known for
SQUARE = "drive a square at {}, 30 s a side"
USUAL_THRUST = "the usual thrust"


@dataclass(frozen=True, slots=True, eq=False)
class Learnt:
    """What dives have taught.

    Attributes:
        tracks: of them. fit: of all levels. known: (K,) those levels whose speed is known well enough.
        normal: by them.
    """

    tracks: Sequence[Track]
    fit: SpeedFit
    known: NDArray[np.bool_]
    normal: Normal

    @property
    def error(self) -> float:
        """Standard deviation of the normal speed, as a share of it: the median over its levels."""
        return float(np.median(self.fit.error[self.known]))


class MissingError(ValueError):
    """The dives do not teach enough; each argument says what is missing, and the way out."""


def learn(dives: Sequence[Sequence[PoseSample]]) -> Learnt:
    """The normal speed.

    Raises:
        MissingError: what the dives lack.
    """
    tracks = [Track.of(samples) for samples in dives if len(samples) > 1]
    under_way_s = sum(float(track.interval_s[_under_way(track)].sum()) for track in tracks)
    if not tracks:
        raise MissingError("no position that moves was heard with a heading: see [speed] position")
    if under_way_s < UNDER_WAY_S:
        square = SQUARE.format(USUAL_THRUST)
        raise MissingError(f"{under_way_s:.0f} s under way: want {UNDER_WAY_S:.0f} s: {square}")
    levels = Levels.driven(tracks)
    courses = [Course.of(track, levels) for track in tracks]
    fit = fit_speed(courses, levels, _scale_mps(courses))
    known = (fit.error <= ERROR_MAX) & (fit.speed_mps * levels.commands > 0.0)
    _refuse(tracks, fit, known)
    return Learnt(tracks, fit, known, _normal(fit, known, told=any(track.told for track in tracks)))


def _under_way(track: Track) -> NDArray[np.bool_]:
    return np.asarray(np.abs(track.command) >= STOPPED)  # NaN is not


def _scale_mps(courses: Sequence[Course]) -> float:
    """About the vehicle's speed: the median over ground."""
    speeds = [
        np.hypot(*np.diff(course.position_m, axis=0).T) / np.diff(course.time_s)
        for course in courses
        if len(course.time_s) > 1
    ]
    return max(float(np.median(np.concatenate(speeds or [np.ones(1)]))), 0.05)


def _refuse(tracks: Sequence[Track], fit: SpeedFit, known: NDArray[np.bool_]) -> None:
    told = any(track.told for track in tracks)
    backwards = fit.speed_mps * fit.levels.commands < -3.0 * fit.error_mps * np.abs(fit.levels.commands)
    if told and (backwards & (fit.error_mps < 0.2 * np.abs(fit.speed_mps))).any():
        worst = int(np.argmax(backwards))
        raise MissingError(
            f"at {percent(fit.levels.commands[worst])} thrust the vehicle goes {fit.speed_mps[worst]:+.2f} m/s: the "
            "signs of `ahead` of the thrusters, or the heading, are the wrong way round: mend them first"
        )
    covered = _covered(tracks, fit, known)
    if covered >= COVERED:
        return
    where = _worst(fit, known) if told else USUAL_THRUST
    raise MissingError(
        f"too few turns to tell speed from current at {where}: the speed is known for {percent(covered)} of the time "
        f"under way, want {percent(COVERED)}: {SQUARE.format(where)}"
    )


def _covered(tracks: Sequence[Track], fit: SpeedFit, known: NDArray[np.bool_]) -> float:
    """Share of the time under way at thrust that the speed is known for."""
    if not known.any():
        return 0.0
    curve = _curve(fit, known)
    total_s = covered_s = 0.0
    for track in tracks:
        going = _under_way(track)
        commands, seconds = np.round(track.command[going], 2), track.interval_s[going]
        total_s += float(seconds.sum())
        covered_s += sum(float(seconds[commands == one].sum()) for one in np.unique(commands) if curve.covers(one))
    return covered_s / max(total_s, 1e-9)


def _worst(fit: SpeedFit, known: NDArray[np.bool_]) -> str:
    """The thrust that was driven longest of those whose speed is not known, in words."""
    unknown = np.where(known, 0.0, fit.levels.seconds)
    if not unknown.any():
        return USUAL_THRUST
    command = float(fit.levels.commands[int(np.argmax(unknown))])
    return f"{percent(abs(command))} thrust {'ahead' if command > 0.0 else 'astern'}"


def percent(share: float) -> str:
    """Such as 60 %."""
    return f"{100.0 * share:.0f} %"


def _normal(fit: SpeedFit, known: NDArray[np.bool_], *, told: bool) -> Normal:
    several = told and int(known.sum()) > 1
    surge_time_s = fit.surge_time_s if several else 1.0
    return Normal(_curve(fit, known) if told else float(fit.speed_mps[0]), surge_time_s)


def _curve(fit: SpeedFit, known: NDArray[np.bool_]) -> SpeedCurve:
    """The speeds that are known, none of them falling with rising thrust: those that do are one."""
    groups: list[list[tuple[float, float, float]]] = []  # command, speed, weight
    rows = zip(fit.levels.commands, fit.speed_mps, 1.0 / fit.error_mps**2, known, strict=True)
    for command, speed_mps, weight, well in rows:
        if not well:
            continue
        groups.append([(float(command), float(speed_mps), float(weight))])
        while len(groups) > 1 and _mean(groups[-2]) >= _mean(groups[-1]):
            groups[-2:] = [groups[-2] + groups[-1]]
    points = [(command, _mean(group)) for group in groups for command, _, _ in group]
    return SpeedCurve(*zip(*((round(one, 3), round(speed, 3)) for one, speed in points), strict=True))


def _mean(group: Sequence[tuple[float, float, float]]) -> float:
    return sum(speed * weight for _, speed, weight in group) / sum(weight for _, _, weight in group)

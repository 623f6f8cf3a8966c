"""The course of the navigation watch, collected while it is judged."""

from __future__ import annotations

from math import isfinite, nan

import numpy as np

from detectors.navigation import DepthSample, DvlSample, NavigationState, NavigationVerdict
from gateway.channel import NavigationJudgement
from gateway.local_frame import LocalFrame
from gateway.report.dive import NavigationCourse
from gateway.report.thinning import Thinning
from gateway.sensor_observations import SUBJECTS

INNOVATIONS = ("forward_mps", "right_mps", "down_mps", "innovation_m")
METHODS = ("ratio", "chi_square", "cusum", "lstm")
PLACE = ("north_m", "east_m", "depth_m", "position_error_m")
LEVELS = tuple(f"level of {subject}" for subject in SUBJECTS.values())
ISOLATED = tuple(f"{subject} isolated" for subject in SUBJECTS.values())
VALUES = (*INNOVATIONS, *METHODS, *PLACE, *LEVELS, *ISOLATED)
PEAKS = (*INNOVATIONS, *METHODS, "north_m", "east_m", "depth_m", *LEVELS, *ISOLATED)
GAP_S = 5.0
# Samples of the inertial unit alone move the position, and nothing else: so often is enough
INERTIAL_PERIOD_S = 1.0


class NavigationCollecting:
    """Takes judgements of navigation samples, in order."""

    def __init__(self) -> None:
        self._thinning = Thinning(VALUES, PEAKS, GAP_S)
        self._taken_s = nan
        self._frame: LocalFrame | None = None

    def take(self, judged: NavigationJudgement) -> None:
        """The next one."""
        said = judged.verdict
        # not far enough from the last one, or of no use: in this way NaN is far
        if said.time_s - self._taken_s < INERTIAL_PERIOD_S and not _tells(judged):
            return
        self._taken_s = said.time_s
        self._thinning.append(
            said.time_s,
            *said.innovation,
            *(said.statistics.get(method, nan) for method in METHODS),
            *self._place(said.state),
            said.position_error_m if isfinite(said.position_error_m) else nan,
            *_sensors(said),
        )

    def course(self, begin_s: float) -> NavigationCourse | None:
        """All of it, times since `begin_s`; None where there was none."""
        time_s, values = self._thinning.columns()
        if not len(time_s):
            return None
        known = [method for method in METHODS if np.isfinite(values[method]).any()]
        subjects = SUBJECTS.values()
        return NavigationCourse(
            time_s=time_s - begin_s,
            innovation=np.column_stack([values[name] for name in INNOVATIONS]),
            statistics={method: values[method] for method in known},
            **{name: values[name] for name in PLACE},
            levels={
                one: np.nan_to_num(values[name]).astype(np.int64) for one, name in zip(subjects, LEVELS, strict=True)
            },
            isolated={one: np.nan_to_num(values[name]) > 0 for one, name in zip(subjects, ISOLATED, strict=True)},
        )

    def _place(self, state: NavigationState) -> tuple[float, float, float]:
        """North and east of where it began, and depth."""
        if not (isfinite(state.latitude_rad) and isfinite(state.longitude_rad)):
            return nan, nan, state.depth_m
        if self._frame is None:
            self._frame = LocalFrame(state.latitude_rad, state.longitude_rad)
        return *self._frame.metres(state.latitude_rad, state.longitude_rad), state.depth_m


def _tells(judged: NavigationJudgement) -> bool:
    return judged.changed or isinstance(judged.sample, DvlSample | DepthSample)


def _sensors(said: NavigationVerdict) -> tuple[float, ...]:
    """Levels of the sensors, and whether each is left out."""
    told = [said.of(sensor) for sensor in SUBJECTS]
    return *(float(one.level) for one in told), *(float(one.isolated) for one in told)

"""The course of speed, flow and track, collected while it is judged."""

from __future__ import annotations

from math import isfinite, nan

import numpy as np

from gateway.channel import SpeedJudgement
from gateway.report.dive import SpeedCourse
from gateway.report.thinning import Thinning

VALUES = (
    "north_m",
    "east_m",
    "down_m",
    "heading_rad",
    "speed_mps",
    "speed_error_mps",
    "speed_min_mps",
    "speed_max_mps",
    "flow_north_mps",
    "flow_east_mps",
    "score",
    "level",
)
PEAKS = ("north_m", "east_m", "down_m", "speed_mps", "score", "level")
# Positions of an acoustic system come once in some seconds
GAP_S = 15.0


class SpeedCollecting:
    """Takes judgements of the vehicle's speed, in order."""

    def __init__(self) -> None:
        self._thinning = Thinning(VALUES, PEAKS, GAP_S)
        self._heard = False

    def take(self, judged: SpeedJudgement) -> None:
        """The next one."""
        pose, said = judged.sample, judged.verdict
        self._heard = True
        north_mps, east_mps = (*said.flow_mps, nan, nan)[:2]
        self._thinning.append(
            pose.time_s,
            pose.north_m,
            pose.east_m,
            pose.down_m,
            pose.heading_rad,
            said.speed_mps,
            said.speed_error_mps if isfinite(said.speed_error_mps) else nan,
            said.speed_min_mps,
            said.speed_max_mps,
            north_mps,
            east_mps,
            said.score,
            float(said.level),
        )

    def course(self, begin_s: float) -> SpeedCourse | None:
        """All of it, times since `begin_s`; None where there was none."""
        if not self._heard:
            return None
        time_s, values = self._thinning.columns()
        return SpeedCourse(
            time_s=time_s - begin_s,
            **{name: values[name] for name in VALUES if name != "level" and not name.startswith("flow")},
            flow_mps=np.column_stack([values["flow_north_mps"], values["flow_east_mps"]]),
            level=np.nan_to_num(values["level"]).astype(np.int64),
        )

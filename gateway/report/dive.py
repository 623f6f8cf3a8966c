"""What a report is drawn from: the course of a dive, as a replay has shown it. Arrays are (N,) but where noted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.config import Config
from gateway.findings import Finding
from gateway.replay.result import ReplayResult

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Curve:
    """A learnt steady speed (rpm) over the command (-1 to 1). `error_rpm`: its standard deviation, NaN: not known."""

    command: FloatArray
    speed_rpm: FloatArray
    error_rpm: FloatArray


@dataclass(frozen=True, slots=True)
class ThrusterCourse:
    """A thruster over the dive; `time_s` is since `Dive.begin_s`, reduced to what can be seen, with all peaks.

    Attributes:
        number, name: as configured.
        time_s, command, speed_rpm, predicted_rpm, residual_rpm, threshold_rpm, score: of its samples and verdicts.
        level: `detectors.verdict.Level` of them.
        refit_s: (M,) when the model was learnt anew.
        curve, commissioned: what was learnt of it at the end, and what it is held against; None: nothing.
    """

    number: int
    name: str
    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    predicted_rpm: FloatArray
    residual_rpm: FloatArray
    threshold_rpm: FloatArray
    score: FloatArray
    level: NDArray[np.int64]
    refit_s: FloatArray
    curve: Curve | None = None
    commissioned: Curve | None = None


@dataclass(frozen=True, slots=True)
class SpeedCourse:
    """Speed through the water, flow and track.

    Attributes:
        time_s: since `Dive.begin_s`.
        north_m, east_m, down_m, heading_rad: pose.
        speed_mps, speed_error_mps, speed_min_mps, speed_max_mps: learnt, and what is normal then.
        flow_mps: (N, 2) north, east.
        score, level: of the verdicts.
    """

    time_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    down_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    speed_error_mps: FloatArray
    speed_min_mps: FloatArray
    speed_max_mps: FloatArray
    flow_mps: FloatArray
    score: FloatArray
    level: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class NavigationCourse:
    """The navigation watch.

    Attributes:
        time_s: since `Dive.begin_s`.
        innovation: (N, 4) forward, right, down in m/s, depth in m.
        statistics: by method, as shares of the threshold.
        north_m, east_m, depth_m: the filter's position, from where it began.
        position_error_m: its standard deviation.
        levels: by sensor ("dvl", "depth sensor", ...), `Level` of each.
        isolated: by sensor, whether its measurements were not used.
    """

    time_s: FloatArray
    innovation: FloatArray
    statistics: Mapping[str, FloatArray]
    north_m: FloatArray
    east_m: FloatArray
    depth_m: FloatArray
    position_error_m: FloatArray
    levels: Mapping[str, NDArray[np.int64]]
    isolated: Mapping[str, NDArray[np.bool_]]


@dataclass(frozen=True, slots=True)
class LinkCourse:
    """A link, second by second.

    Attributes:
        name: of it.
        time_s: since `Dive.begin_s`.
        readings_per_s: how many it gave.
        load: of a bus, 0 to 1; NaN: not known.
        lost: frames that were lost in that second, as far as it was told.
        down: (M, 2) from and to, when it was not there.
    """

    name: str
    time_s: FloatArray
    readings_per_s: FloatArray
    load: FloatArray
    lost: FloatArray
    down: FloatArray


@dataclass(frozen=True, slots=True)
class Dive:
    """See the module's text.

    Attributes:
        config: that it was judged by; config_text: the file.
        result: counts, and what was lost.
        begin_s, end_s: unix seconds, or those of the log.
        from_s: since `begin_s`, from when on it is told: what was before was only learnt from.
        findings: all, in order.
        logs: names of the files.
        versions: of this program and what it stands on, by name.
        armed: (M, 2) from and to, since begin_s.
        modes: from when, since begin_s, and the mode's name.
    """

    config: Config
    config_text: str
    result: ReplayResult
    begin_s: float
    end_s: float
    findings: tuple[Finding, ...]
    logs: tuple[str, ...]
    versions: Mapping[str, str]
    thrusters: tuple[ThrusterCourse, ...] = ()
    speed: SpeedCourse | None = None
    navigation: NavigationCourse | None = None
    links: tuple[LinkCourse, ...] = ()
    armed: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    modes: tuple[tuple[float, str], ...] = ()
    from_s: float = 0.0

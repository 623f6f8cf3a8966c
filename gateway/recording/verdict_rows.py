"""What the detectors said, as flat values that viewers plot."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import ClassVar

from detectors.navigation import NavigationVerdict
from detectors.navigation.sample import Sensor
from detectors.verdict import Level
from gateway.channel import NavigationJudgement, SpeedJudgement, ThrusterJudgement


@dataclass(frozen=True, slots=True)
class ThrusterRow:
    """Of one thruster; attributes as in `ThrusterSample` and `ThrusterVerdict`."""

    MESSAGE: ClassVar = "ThrusterVerdict"
    time_s: float
    command: float
    speed_rpm: float
    predicted_rpm: float
    residual_rpm: float
    threshold_rpm: float
    score: float
    level: Level
    voltage_v: float | None
    current_a: float | None
    order: int
    window: int
    delay: int
    lag_s: float
    refitted: bool
    wear: float
    kind: str
    reason: str

    @classmethod
    def of(cls, judgement: ThrusterJudgement) -> ThrusterRow:
        """The row of a judgement."""
        sample, verdict = judgement.sample, judgement.verdict
        return cls(
            sample.time_s,
            sample.command,
            sample.speed_rpm,
            verdict.predicted_rpm,
            verdict.residual_rpm,
            verdict.threshold_rpm,
            verdict.score,
            verdict.level,
            sample.voltage_v,
            sample.current_a,
            verdict.order,
            verdict.window,
            verdict.delay,
            verdict.lag_s,
            verdict.refitted,
            verdict.wear,
            str(verdict.kind),
            verdict.reason,
        )


@dataclass(frozen=True, slots=True)
class SpeedRow:
    """Of the vehicle's speed; attributes as in `PoseSample` and `SpeedVerdict`."""

    MESSAGE: ClassVar = "SpeedVerdict"
    time_s: float
    north_m: float
    east_m: float
    down_m: float
    heading_rad: float
    command: float | None
    speed_mps: float
    speed_error_mps: float
    speed_min_mps: float
    speed_max_mps: float
    flow_mps: tuple[float, float, float]
    flow_error: float
    score: float
    level: Level
    flag: int
    reason: str

    @classmethod
    def of(cls, judgement: SpeedJudgement) -> SpeedRow:
        """The row of a judgement. A flow without a vertical part has 0 there."""
        sample, verdict = judgement.sample, judgement.verdict
        north, east, *down = verdict.flow_mps
        return cls(
            sample.time_s,
            sample.north_m,
            sample.east_m,
            sample.down_m,
            sample.heading_rad,
            sample.command,
            verdict.speed_mps,
            verdict.speed_error_mps,
            verdict.speed_min_mps,
            verdict.speed_max_mps,
            (north, east, down[0] if down else 0.0),
            verdict.flow_error,
            verdict.score,
            verdict.level,
            verdict.flag,
            verdict.reason,
        )


@dataclass(frozen=True, slots=True)
class NavigationRow:
    """Of the navigation sensors; attributes as in `NavigationVerdict`, statistics and sensors one by one.

    Of a sensor that was not heard the level is UNKNOWN and the score 0; a statistic that is not computed is NaN.
    """

    MESSAGE: ClassVar = "NavigationVerdict"
    time_s: float
    latitude_rad: float
    longitude_rad: float
    depth_m: float
    velocity_mps: tuple[float, float, float]
    attitude_rad: tuple[float, float, float]
    position_error_m: float
    innovation: tuple[float, float, float, float]
    chi_square: float
    cusum: float
    lstm: float
    ratio: float
    score: float
    level: Level
    dvl_score: float
    dvl_level: Level
    dvl_isolated: bool
    depth_score: float
    depth_level: Level
    depth_isolated: bool
    gyroscope_score: float
    gyroscope_level: Level
    accelerometer_score: float
    accelerometer_level: Level
    sample: str
    reason: str

    @classmethod
    def of(cls, judgement: NavigationJudgement) -> NavigationRow:
        """The row of a judgement."""
        verdict = judgement.verdict
        state, statistics = verdict.state, verdict.statistics
        dvl, depth = verdict.of(Sensor.DVL), verdict.of(Sensor.DEPTH)
        gyroscope, accelerometer = verdict.of(Sensor.GYROSCOPE), verdict.of(Sensor.ACCELEROMETER)
        return cls(
            time_s=verdict.time_s,
            latitude_rad=state.latitude_rad,
            longitude_rad=state.longitude_rad,
            depth_m=state.depth_m,
            velocity_mps=state.velocity_mps,
            attitude_rad=state.attitude_rad,
            position_error_m=verdict.position_error_m,
            innovation=_four(verdict),
            chi_square=statistics.get("chi_square", nan),
            cusum=statistics.get("cusum", nan),
            lstm=statistics.get("lstm", nan),
            ratio=statistics.get("ratio", nan),
            score=verdict.score,
            level=verdict.level,
            dvl_score=dvl.score,
            dvl_level=dvl.level,
            dvl_isolated=dvl.isolated,
            depth_score=depth.score,
            depth_level=depth.level,
            depth_isolated=depth.isolated,
            gyroscope_score=gyroscope.score,
            gyroscope_level=gyroscope.level,
            accelerometer_score=accelerometer.score,
            accelerometer_level=accelerometer.level,
            sample=type(judgement.sample).__name__.removesuffix("Sample").lower(),
            reason=verdict.reason,
        )


def _four(verdict: NavigationVerdict) -> tuple[float, float, float, float]:
    ahead, right, down, depth = verdict.innovation
    return float(ahead), float(right), float(down), float(depth)

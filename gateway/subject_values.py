"""What a judgement says of its subjects, in numbers: score, values by name with unit, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import degrees, isfinite

from detectors.navigation import NavigationVerdict, Sensor, SensorVerdict
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.navigation_channel import SUBJECT as NAVIGATION
from gateway.sensor_observations import SUBJECTS
from gateway.speed_channel import SUBJECT as VEHICLE

FLOW = ("flow_north_mps", "flow_east_mps", "flow_down_mps")
AXES = ("forward", "right", "down")


@dataclass(frozen=True, slots=True)
class SubjectValues:
    """One subject, as its detector sees it.

    Attributes:
        subject: as in the findings.
        score: 1.0 = the threshold.
        values: what is known beside, by name with unit; what is not known or infinite is left out.
        reason: of the level, in a few words; empty where it is well.
    """

    subject: str
    score: float
    values: Mapping[str, float]
    reason: str


def values_of(judgement: Judgement) -> Iterator[SubjectValues]:
    """Of each subject that the judgement is of: one, but of navigation all its sensors."""
    match judgement:
        case ThrusterJudgement():
            yield _thruster(judgement)
        case SpeedJudgement():
            yield _speed(judgement)
        case NavigationJudgement(verdict=verdict):
            yield SubjectValues(NAVIGATION, verdict.score, _known(_navigation(verdict)), verdict.reason)
            for one in verdict.sensors:
                yield SubjectValues(SUBJECTS[one.sensor], one.score, _known(_sensor(one, judgement)), "")


def _thruster(judgement: ThrusterJudgement) -> SubjectValues:
    sample, verdict = judgement.sample, judgement.verdict
    values = {
        "command": sample.command,
        "speed_rpm": sample.speed_rpm,
        "predicted_rpm": verdict.predicted_rpm,
        "residual_rpm": verdict.residual_rpm,
        "threshold_rpm": verdict.threshold_rpm,
        "lag_s": verdict.lag_s,
        "wear": verdict.wear,
        "voltage_v": sample.voltage_v,
        "current_a": sample.current_a,
    }
    return SubjectValues(f"thruster {judgement.thruster}", verdict.score, _known(values), verdict.reason)


def _speed(judgement: SpeedJudgement) -> SubjectValues:
    verdict = judgement.verdict
    values = {
        "command": judgement.sample.command,
        "speed_mps": verdict.speed_mps,
        "speed_error_mps": verdict.speed_error_mps,
        "speed_min_mps": verdict.speed_min_mps,
        "speed_max_mps": verdict.speed_max_mps,
        **dict(zip(FLOW, verdict.flow_mps, strict=False)),
    }
    return SubjectValues(VEHICLE, verdict.score, _known(values), verdict.reason)


def _navigation(verdict: NavigationVerdict) -> Mapping[str, float]:
    state = verdict.state
    angles = zip(("roll_deg", "pitch_deg", "heading_deg"), map(degrees, state.attitude_rad), strict=True)
    return {
        "latitude_deg": degrees(state.latitude_rad),
        "longitude_deg": degrees(state.longitude_rad),
        "position_error_m": verdict.position_error_m,
        "depth_m": state.depth_m,
        **{f"velocity_{axis}_mps": v for axis, v in zip(("north", "east", "down"), state.velocity_mps, strict=True)},
        **dict(angles),
    }


def _sensor(one: SensorVerdict, judgement: NavigationJudgement) -> Mapping[str, float | None]:
    values: dict[str, float | None] = {"isolated": float(one.isolated)}
    *velocity, depth = judgement.verdict.innovation
    match one.sensor:
        case Sensor.DVL:
            values |= {f"innovation_{axis}_mps": value for axis, value in zip(AXES, velocity, strict=True)}
            if judgement.dvl is not None:
                values |= dict(zip((f"{axis}_mps" for axis in AXES), judgement.dvl.velocity_mps, strict=True))
        case Sensor.DEPTH:
            values |= {"innovation_depth_m": depth}
            if judgement.depth is not None:
                values |= {"depth_m": judgement.depth.depth_m}
    return values


def _known(values: Mapping[str, float | None]) -> dict[str, float]:
    return {name: value for name, value in values.items() if value is not None and isfinite(value)}

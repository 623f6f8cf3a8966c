"""What the pilot is told of navigation sensors: one subject for each, and one for what none can be blamed for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import degrees, hypot, nan

from detectors.navigation import DepthSample, DvlSample, FaultKind, Sensor, SensorVerdict
from detectors.verdict import Level
from gateway.channel import NavigationJudgement
from gateway.observation import Observation

SUBJECTS: Mapping[Sensor, str] = {
    Sensor.DVL: "dvl",
    Sensor.DEPTH: "depth sensor",
    Sensor.GYROSCOPE: "gyroscope",
    Sensor.ACCELEROMETER: "accelerometer",
}
LABELS: Mapping[Sensor, str] = {
    Sensor.DVL: "DVL",
    Sensor.DEPTH: "Depth",
    Sensor.GYROSCOPE: "Gyro",
    Sensor.ACCELEROMETER: "Accel",
}
UNITS: Mapping[Sensor, str] = {
    Sensor.DVL: "m/s",
    Sensor.DEPTH: "m",
    Sensor.GYROSCOPE: "deg/s",
    Sensor.ACCELEROMETER: "m/s/s",
}
# More of them than this have no room in a text by their full names.
FULL_WORDS = 3
# Shown with two decimals; of a scale, less says nothing.
LEAST = 0.00995
# Names of the axes, forward, right, down: of a positive and of a negative error.
_ALONG = (("forward", "backward"), ("right", "left"), ("down", "up"))
_ABOUT = ("roll", "pitch", "yaw")


def navigation_observations(judgement: NavigationJudgement) -> Iterator[Observation]:
    """What the supervisor is told of a judgement: nothing new of most inertial samples."""
    if not (judgement.changed or isinstance(judgement.sample, DvlSample | DepthSample)):
        return
    verdict = judgement.verdict
    for one in verdict.sensors:
        yield Observation(
            time_s=verdict.time_s,
            detector="navigation",
            subject=SUBJECTS[one.sensor],
            label=LABELS[one.sensor],
            level=one.level,
            score=one.score,
            trouble=trouble(one, _measured(judgement, one.sensor)),
            details=(verdict.reason,) if one.level is Level.UNKNOWN and verdict.reason else (),
        )
    yield _whole(judgement)


def _whole(judgement: NavigationJudgement) -> Observation:
    """Something is wrong, and it could be one sensor or another."""
    verdict = judgement.verdict
    blamed = [one.sensor for one in verdict.sensors if one.level >= Level.SUSPECT]
    return Observation(
        time_s=verdict.time_s,
        detector="navigation",
        subject="navigation",
        label="Nav",
        level=Level.NORMAL if blamed else verdict.level,
        score=nan if blamed else verdict.score,
        trouble=_either(verdict.reason),
        details=(verdict.reason,) if verdict.level is Level.UNKNOWN and verdict.reason else (),
        colon=True,
        over=f"it is the {_words(blamed)[0]}" if blamed else "",
    )


def _either(reason: str) -> str:
    """Which sensors it could be, e.g. `DVL or accelerometer off`, of a reason such as `dvl or accelerometer`."""
    names = reason.split(" or ")
    if not set(names) <= set(Sensor):
        return reason or "abnormal"
    return f"{' or '.join(_words([Sensor(name) for name in names]))} off"


def _words(sensors: Sequence[Sensor]) -> list[str]:
    if len(sensors) > FULL_WORDS:
        return [LABELS[sensor] for sensor in sensors]
    return [LABELS[sensor] if sensor is Sensor.DVL else sensor.value for sensor in sensors]


def trouble(verdict: SensorVerdict, measured: float | None = None) -> str:
    """What is wrong with a sensor, e.g. `drifting 0.04 m/s/s, isolated`; what is not sure yet is a question.

    Args:
        verdict: on the sensor.
        measured: what it says, for one that is stuck at it.
    """
    unit = UNITS[verdict.sensor]
    shown = degrees if verdict.sensor is Sensor.GYROSCOPE else float
    match verdict.kind:
        case FaultKind.DRIFT:
            what = f"drifting {_number(abs(shown(verdict.rate)))} {unit}/s"
        case FaultKind.STUCK:
            what = "stuck" if measured is None else f"stuck at {_number(measured)} {unit}"
        case FaultKind.STEP:
            what = f"off by {_error(verdict)}"
        case FaultKind.SCALE:
            what = f"scale off by {_error(verdict)}" if any(map(_shown, verdict.size)) else "scale off"
        case FaultKind.NOISE:
            what = "noisy"
        case FaultKind.INTERMITTENT:
            what = "intermittent"
        case _:
            what = "abnormal"
    sure = "" if verdict.level is Level.FAULT else "?"
    return f"{what}{sure}{', isolated' if verdict.isolated else ''}"


def _shown(part: float) -> bool:
    return abs(part) >= LEAST


def _error(verdict: SensorVerdict) -> str:
    """Along or about the axis where it is largest."""
    unit = UNITS[verdict.sensor]
    axis = max(range(3), key=lambda place: abs(verdict.size[place]))
    size = verdict.size[axis]
    if verdict.sensor is Sensor.DEPTH:
        return f"{_number(verdict.size[2])} {unit}"
    if verdict.sensor is Sensor.GYROSCOPE:
        return f"{_number(degrees(size))} {unit} {_ABOUT[axis]}"
    return f"{_number(abs(size))} {unit} {_ALONG[axis][size < 0.0]}"


def _measured(judgement: NavigationJudgement, sensor: Sensor) -> float | None:
    if sensor is Sensor.DVL and judgement.dvl is not None:
        return hypot(*judgement.dvl.velocity_mps)
    if sensor is Sensor.DEPTH and judgement.depth is not None:
        return judgement.depth.depth_m
    return None


def _number(value: float) -> str:
    """Two digits or so, and none that says nothing."""
    if abs(value) >= 0.995:
        return f"{value:.1f}"
    return f"{value:z.2f}" if value == 0.0 or abs(value) >= LEAST else f"{value:.1g}"

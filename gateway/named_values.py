"""What ground stations can plot: the newest scores, residuals and learnt speeds as NAMED_VALUE_FLOAT.

| name | what | unit |
|---|---|---|
| `T3` | score of thruster 3; a detector says FAULT of what stays above 1 | 1 |
| `T3RES` | its speed less the one that a healthy thruster would have | rpm |
| `SPDF` | score of the vehicle's speed | 1 |
| `STW` | speed through the water along the bow | m/s |
| `FLOWN`, `FLOWE` | velocity of the water to the north and to the east | m/s |
| `NAVF` | score of navigation: the worst of its sensors' | 1 |
| `DVLF`, `DEPTHF`, `GYROF`, `ACCELF` | score of a navigation sensor | 1 |

What is not known, infinite, or older than 5 s is left out: a plot then ends, where a 0 would look like good news.
None of the names is one that ArduSub gives to values of its own (CamTilt, TetherTrn, PilotGain, RollPitch...).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf

from detectors.navigation import Sensor
from drivers.mavlink.messages import FLOAT32_MAX, NamedValue
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.timeline import TICK_TOLERANCE_S

FRESH_S = 5.0

SENSORS: Mapping[Sensor, str] = {
    Sensor.DVL: "DVLF",
    Sensor.DEPTH: "DEPTHF",
    Sensor.GYROSCOPE: "GYROF",
    Sensor.ACCELEROMETER: "ACCELF",
}


class Plots:
    """The values at even intervals, of what was judged until then.

    Args:
        period_s: from one time to the next; 0 = never.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._newest: dict[str, Judgement] = {}
        self._began_s: float | None = None
        self._next_s = -inf

    def take(self, subject: str, judgement: Judgement) -> None:
        """Takes the newest judgement of a subject."""
        self._newest[subject] = judgement

    def advance(self, time_s: float) -> Iterator[NamedValue]:
        """Takes a tick; gives the values where they are due."""
        if not self._period_s or time_s < self._next_s - TICK_TOLERANCE_S:
            return
        self._next_s = time_s + self._period_s
        self._began_s = time_s if self._began_s is None else self._began_s
        yield from named_values(self._newest, time_s, self._began_s)


def named_values(newest: Mapping[str, Judgement], time_s: float, began_s: float = 0.0) -> Iterator[NamedValue]:
    """The values of a moment, at most twice as many as there are thrusters, and nine.

    Args:
        newest: newest judgement by subject.
        time_s: now.
        began_s: when the gateway began; the values' own time counts from then.
    """
    for judgement in newest.values():
        if time_s - judgement.verdict.time_s > FRESH_S:
            continue
        for name, value in _values(judgement):
            if abs(value) <= FLOAT32_MAX:  # False for NaN
                yield NamedValue(name, value, time_s - began_s)


def _values(judgement: Judgement) -> Iterator[tuple[str, float]]:
    match judgement:
        case ThrusterJudgement(thruster=number, verdict=thruster):
            yield f"T{number}", thruster.score
            yield f"T{number}RES", thruster.residual_rpm
        case SpeedJudgement(verdict=speed):
            yield "SPDF", speed.score
            yield "STW", speed.speed_mps
            yield from zip(("FLOWN", "FLOWE"), speed.flow_mps, strict=False)
        case NavigationJudgement(verdict=navigation):
            yield "NAVF", navigation.score
            yield from ((SENSORS[one.sensor], one.score) for one in navigation.sensors)

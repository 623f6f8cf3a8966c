"""What the thruster detector wants, and what it says."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from detectors.verdict import Verdict


@dataclass(frozen=True, slots=True)
class ThrusterSample:
    """One instant of one thruster, evenly spaced in time from sample to sample.

    Attributes:
        time_s: instant of the sample.
        command: the command in any fixed linear unit (fraction, percent, volt ...) with 0 as neutral, or a servo
            pulse width in microseconds, whose neutral is 1500.
        speed_rpm: measured propeller speed. Signed where the sensor has a sign, else the magnitude.
        voltage_v: supply voltage, None where it is not measured.
        current_a: motor or ESC current, None where it is not measured.
    """

    time_s: float
    command: float
    speed_rpm: float
    voltage_v: float | None = None
    current_a: float | None = None


class FaultKind(StrEnum):
    """What kind of fault the signals point at, in the words of a pilot."""

    NONE = ""
    ENTANGLED = "entangled"  # too slow (and too much current, where it is measured)
    PROPELLER_LOST = "propeller lost"  # too fast (and too little current, where it is measured)
    BLOCKED = "blocked"  # no speed at a command, current high
    DEAD = "dead"  # no speed at a command, no current
    REVERSED = "reversed"  # turns against its command
    STOPPED = "blocked or dead"  # no speed at a command, current not measured
    SENSOR = "RPM sensor"  # frozen or impossible speed
    WORN = "worn or fouled"  # drifted slowly away from the commissioned curve


@dataclass(frozen=True, slots=True, kw_only=True)
class ThrusterVerdict(Verdict):
    """What the thruster detector says of one sample.

    Attributes:
        residual_rpm: measured minus predicted speed (paper 000, equations 18-20); NaN while there is no prediction.
        predicted_rpm: speed that a healthy thruster would show now; NaN while there is no model.
        threshold_rpm: |residual_rpm| beyond which a single sample counts as too far off; NaN while there is no model.
        order: polynomial order of the model in use, 0 while there is none.
        window: number of samples that the model was fitted to.
        delay: transport delay from command to speed, in samples.
        lag_s: first-order motor lag in seconds, 0.0 for a static model.
        refitted: True on the sample at which the model was learnt anew.
        kind: what sort of fault the signals point at.
        wear: relative drift of today's learnt curve from the commissioned one, negative = slower; NaN while unknown.
        reason: why the level is UNKNOWN, SUSPECT or FAULT, in a few words; empty when NORMAL.
    """

    residual_rpm: float
    predicted_rpm: float
    threshold_rpm: float
    order: int
    window: int
    delay: int
    lag_s: float
    refitted: bool
    kind: FaultKind = FaultKind.NONE
    wear: float = float("nan")
    reason: str = ""

"""Texts for the pilot: complete within the 50 characters of a STATUSTEXT, the key fact first."""

from __future__ import annotations

import math
from collections.abc import Sequence

from detectors.speed.sample import SpeedVerdict
from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from drivers.mavlink.messages import TEXT_MAX

# below this a percentage of the wanted speed says nothing
PERCENT_FLOOR_RPM = 1.0
# below this a speed needs its centimetres
SLOW_MPS = 0.5


def fitted(head: str, details: Sequence[str] = (), separator: str = " ") -> str:
    """`head` and as many of `details`, in their order, as fit; printable ASCII, never empty.

    Args:
        head: what must be said; cut at 50 characters if need be.
        details: each is appended whole or, with all after it, not at all.
        separator: between head and details.
    """
    text = _printable(head)[:TEXT_MAX].strip() or "?"
    for index, detail in enumerate(details):
        longer = text + (separator if index == 0 else "") + _printable(detail)
        if len(longer) > TEXT_MAX:
            break
        text = longer
    return text


def _printable(text: str) -> str:
    return "".join(character if character.isascii() and character.isprintable() else "?" for character in text)


def thruster_trouble(verdict: ThrusterVerdict) -> str:
    """What seems to be wrong, e.g. `entangled?`: it is inferred, so it is a question."""
    if verdict.kind is not FaultKind.NONE:
        return f"{verdict.kind}?"
    return f"{verdict.reason}?" if verdict.reason else "abnormal?"


def thruster_details(sample: ThrusterSample, verdict: ThrusterVerdict) -> tuple[str, ...]:
    """Evidence, in pieces that can be left out from the end: `812 rpm`, `, want 1043`, ` (-22%)`."""
    if verdict.kind is FaultKind.WORN and math.isfinite(verdict.wear):
        return (_percent(verdict.wear), " since commissioned")
    measured = f"{sample.speed_rpm:z.0f} rpm"
    wanted = verdict.predicted_rpm
    if not math.isfinite(wanted):
        return (measured,)
    if abs(wanted) < PERCENT_FLOOR_RPM:
        return measured, f", want {wanted:z.0f}"
    return measured, f", want {wanted:z.0f}", f" ({_percent(sample.speed_rpm / wanted - 1.0)})"


def speed_trouble(verdict: SpeedVerdict) -> str:
    """How fast it is and should be, e.g. `0.52 m/s, want 0.9-1.2`; without a number, why it is not trusted."""
    if not math.isfinite(verdict.speed_mps):
        return f"{verdict.reason}?" if verdict.reason else "abnormal?"
    low, high = verdict.speed_min_mps, verdict.speed_max_mps
    if not (math.isfinite(low) and math.isfinite(high)):
        return _speed(verdict.speed_mps)
    digits = 1 if max(abs(low), abs(high)) >= SLOW_MPS else 2
    between = "-" if low >= 0.0 else " to "
    return f"{_speed(verdict.speed_mps)}, want {low:z.{digits}f}{between}{high:z.{digits}f}"


def speed_details(verdict: SpeedVerdict) -> tuple[str, ...]:
    """Evidence: the flow where something is wrong (`(flow 0.4 @ 085)`, where the water goes to), else the speed."""
    if verdict.level is Level.UNKNOWN:
        return (verdict.reason,) if verdict.reason else ()
    if verdict.level is Level.NORMAL:
        return (_speed(verdict.speed_mps),) if math.isfinite(verdict.speed_mps) else ()
    north, east = verdict.flow_mps[:2]
    if not (math.isfinite(north) and math.isfinite(east)):
        return ()
    towards_deg = round(math.degrees(math.atan2(east, north))) % 360
    return (f"(flow {math.hypot(north, east):.1f} @ {towards_deg:03d})",)


def _speed(speed_mps: float) -> str:
    return f"{speed_mps:z.2f} m/s"


def _percent(share: float) -> str:
    return f"{share:+z.0%}"  # z: what rounds to nothing is +0%, never -0%

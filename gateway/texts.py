"""Texts for the pilot: complete within the 50 characters of a STATUSTEXT, the key fact first."""

from __future__ import annotations

import math
from collections.abc import Sequence

from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from drivers.mavlink.messages import TEXT_MAX

# below this a percentage of the wanted speed says nothing
PERCENT_FLOOR_RPM = 1.0


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


def _percent(share: float) -> str:
    return f"{share:+z.0%}"  # z: what rounds to nothing is +0%, never -0%

"""How soon a fault that is in the frames of a bus is a text at the autopilot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hil_tests.live.autopilot import Text
from hil_tests.live.measure import Run
from hil_tests.live.traffic import FAULT_EVERY_S, Fault


@dataclass(frozen=True, slots=True)
class Latency:
    """Milliseconds; NaN where nothing was told."""

    median_ms: float
    p99_ms: float
    max_ms: float


@dataclass(frozen=True, slots=True)
class Told:
    """A fault that reached the autopilot; unix times of its first frame, of the sample that decided, of its text."""

    fault: Fault
    shown_s: float
    decided_s: float
    told_s: float


def told(run: Run) -> list[Told]:
    """The faults that were told while they were there, or soon after."""
    return [one for fault, shown_s in run.onsets for one in _told(fault, shown_s, run)]


def _told(fault: Fault, shown_s: float, run: Run) -> Iterator[Told]:
    text = _first_text(fault, shown_s, run.texts)
    decided_s = _first_finding(fault, shown_s, run.findings)
    if text is not None and decided_s is not None:
        yield Told(fault, shown_s, decided_s, text.time_s)


def _first_text(fault: Fault, shown_s: float, texts: Sequence[Text]) -> Text | None:
    words = f"T{fault.thruster} "
    mine = (one for one in texts if shown_s < one.time_s < shown_s + FAULT_EVERY_S and one.text.startswith(words))
    return next(mine, None)


def _first_finding(fault: Fault, shown_s: float, findings: Sequence[dict[str, object]]) -> float | None:
    for finding in findings:
        if finding["level"] == "FAULT" and finding["subject"] == f"thruster {fault.thruster}":
            time_s = finding["time_s"]
            if isinstance(time_s, float) and shown_s < time_s < shown_s + FAULT_EVERY_S:
                return time_s
    return None


def latency(taken_s: Sequence[float]) -> Latency:
    """Of many."""
    if not taken_s:
        return Latency(*[float("nan")] * 3)
    return Latency(*(1000.0 * np.percentile(taken_s, [50.0, 99.0, 100.0])).tolist())

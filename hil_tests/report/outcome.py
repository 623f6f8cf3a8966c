"""What came of playing one scenario: all that expectations are held against and a report is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gateway.findings import Finding
from hil_tests.rig.notes import ReceivedCommand, ReceivedText
from hil_tests.rig.truth import ModeChange, Truth
from hil_tests.scenario.document import Scenario

FloatArray = NDArray[np.float64]
__all__ = ["ModeChange", "Outcome", "Series", "Truth"]


@dataclass(frozen=True, slots=True)
class Series:
    """Values over time, as a NAMED_VALUE_FLOAT of the gateway tells them: (N,) each."""

    time_s: FloatArray
    value: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One play. All times are unix seconds; since the start they are `time_s - start_s`.

    Attributes:
        scenario: as it was played.
        path: of its file.
        way: how it was played, in words: "virtual time", "real time on vcan0", ...
        start_s, end_s: of the play.
        wall_s: what it took.
        findings: of the gateway, in their order.
        texts, commands: that reached the autopilot from the gateway.
        modes: of the autopilot; the first is that of the start.
        scores: what the gateway plots, by name: "T3", "T3RES", "STW", ...
        truth: None where nothing was simulated.
        wire_counts: what faults have done to frames and packets, by wire.
        gateway_lines: the gateway's own account at its end.
        broken: why the play came to no end; None: it did.
        folder: where all of it was recorded.
    """

    scenario: Scenario
    path: Path
    way: str
    start_s: float
    end_s: float
    wall_s: float
    findings: Sequence[Finding] = ()
    texts: Sequence[ReceivedText] = ()
    commands: Sequence[ReceivedCommand] = ()
    modes: Sequence[ModeChange] = ()
    scores: Mapping[str, Series] = field(default_factory=dict)
    truth: Truth | None = None
    wire_counts: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    gateway_lines: Sequence[str] = ()
    broken: str | None = None
    folder: Path | None = None

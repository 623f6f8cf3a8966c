"""What a method says of a run of samples, on its way to verdicts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.learnt import LearntCurve
from detectors.thruster.wear import CommissionedCurve

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """N samples judged with one model: arrays (N,); what is the same for all stands alone.

    Attributes as in `ThrusterVerdict`; `refitted` is of the first of the samples.
    """

    level: NDArray[np.int64]
    score: FloatArray
    residual_rpm: FloatArray
    predicted_rpm: FloatArray
    threshold_rpm: FloatArray
    kind: NDArray[np.str_]
    reason: NDArray[np.str_]
    order: int
    window: int
    delay: int
    lag_s: float
    refitted: bool
    wear: float

    def __len__(self) -> int:
        return len(self.level)


class Method(Protocol):
    """A way to detect faults. Picklable between calls, and then goes on bit for bit."""

    commissioned: CommissionedCurve | None

    @property
    def learnt(self) -> LearntCurve | None:
        """The present steady curve; None while there is no model."""

    def judge(self, block: FloatArray) -> Iterator[Judgement]:
        """Judge (5, N) samples: time, command, speed, voltage, current (NaN: not measured); in order of time.

        Yields judgements that together hold N samples. Blocks of any length give the same.
        """

    def accept(self) -> None:
        """Take the thruster as it is now for healthy."""

    def begin_dive(self) -> None:
        """Learn from what comes now alone, and judge by what was learnt until then."""

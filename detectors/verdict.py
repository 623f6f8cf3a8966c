"""The one thing that every detector says."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """How bad it is. Ordered: the worst of several verdicts is their maximum."""

    UNKNOWN = 0  # learning, or the input is not trusted
    NORMAL = 1
    SUSPECT = 2
    FAULT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a detector says of one sample.

    Attributes:
        time_s: the time of the sample that is judged.
        level: how bad it is.
        score: dimensionless evidence; 1.0 is the threshold of a FAULT.
    """

    time_s: float
    level: Level
    score: float

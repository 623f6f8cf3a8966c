"""What a predictor is trained on: innovations of the fault-free filter, beside the motion that they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.lstm import INPUTS, OUTPUTS

FloatArray = NDArray[np.float64]

FIFTHS = 5  # four to train on, one to validate with: paper 003, section 5.2


@dataclass(frozen=True, slots=True, eq=False)
class InnovationRecord:
    """One healthy dive as the filter saw it, at each sample of the DVL.

    Attributes:
        name: of the dive.
        time_s: (T,)
        features: (T, 12), see `detectors.navigation.features`.
        innovation: (T, 4) of the DVL, forward, right, down in m/s, and of the depth in m.
        variance: (T, 4) of each, as the filter expects it.

    Raises:
        ValueError: shapes that do not fit together, no samples, values that are not finite, variances not above 0.
    """

    name: str
    time_s: FloatArray
    features: FloatArray
    innovation: FloatArray
    variance: FloatArray

    def __post_init__(self) -> None:
        count = len(self.time_s)
        wanted = {"features": (count, INPUTS), "innovation": (count, OUTPUTS), "variance": (count, OUTPUTS)}
        for name, shape in wanted.items():
            values = getattr(self, name)
            if values.shape != shape or not count or not np.isfinite(values).all():
                raise ValueError(f"{self.name}: {name}: shape {values.shape}: want {shape}, all finite, one or more")
        if not (self.variance > 0).all():
            raise ValueError(f"{self.name}: variance: want all above 0")

    @property
    def targets(self) -> FloatArray:
        """(T, 8) what the network is to say: innovations, and logarithms of their variances."""
        return np.hstack((self.innovation, np.log(self.variance)))

    def part(self, rows: slice) -> InnovationRecord:
        """Some of the samples."""
        return replace(
            self,
            time_s=self.time_s[rows],
            features=self.features[rows],
            innovation=self.innovation[rows],
            variance=self.variance[rows],
        )


class Split(NamedTuple):
    """What is trained on, and what the result is validated with."""

    training: list[InnovationRecord]
    validation: list[InnovationRecord]


def interval_s(records: Sequence[InnovationRecord]) -> float:
    """The median time between two samples.

    Raises:
        ValueError: no record has two.
    """
    intervals = np.concatenate([np.diff(record.time_s) for record in records])
    if not len(intervals):
        raise ValueError("every recording has but one sample of the DVL that can be used: want more")
    return float(np.median(intervals))


def splits(records: Sequence[InnovationRecord], seed: int, count: int) -> list[Split]:
    """Ways to part the records: four fifths to train on, and one to validate with (paper 003, section 5.2).

    Whole dives where there are five or more, drawn by the seed: neighbouring seconds of one dive are so much alike
    that parts of it would tell little of dives not seen. With fewer, one way: the last fifth of each.

    Args:
        records: healthy dives.
        seed: of the draw.
        count: how many ways, 0 to 5; in five, each dive is left out once.

    Raises:
        ValueError: no records, or one too short to be cut.
    """
    if not records:
        raise ValueError("no recordings: want one or more")
    if len(records) < FIFTHS:
        return [_cut(records)] if count else []
    fifths = np.array_split(np.random.default_rng(seed).permutation(len(records)), FIFTHS)[::-1]
    return [_without(records, set(fifth.tolist())) for fifth in fifths[:count]]


def _without(records: Sequence[InnovationRecord], left_out: set[int]) -> Split:
    training = [record for number, record in enumerate(records) if number not in left_out]
    return Split(training, [records[number] for number in sorted(left_out)])


def _cut(records: Sequence[InnovationRecord]) -> Split:
    ends = [len(record.time_s) - round(len(record.time_s) / FIFTHS) for record in records]
    for record, end in zip(records, ends, strict=True):
        if not 0 < end < len(record.time_s):
            raise ValueError(f"{record.name}: {len(record.time_s)} samples of the DVL: want 3 or more")
    training = [record.part(slice(end)) for record, end in zip(records, ends, strict=True)]
    return Split(training, [record.part(slice(end, None)) for record, end in zip(records, ends, strict=True)])

"""What a predictor is trained on: innovations of the fault-free filter, beside the motion that they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.lstm import INPUTS, OUTPUTS

FloatArray = NDArray[np.float64]

VALIDATION_SHARE = 0.2  # paper 003, section 5.2
# As many recordings as it takes for that share to be whole ones.
WHOLE_MIN = 5


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


def interval_s(records: Sequence[InnovationRecord]) -> float:
    """The median time between two samples.

    Raises:
        ValueError: no record has two.
    """
    intervals = np.concatenate([np.diff(record.time_s) for record in records])
    if not len(intervals):
        raise ValueError("every recording has but one sample of the DVL that can be used: want more")
    return float(np.median(intervals))


def split(records: Sequence[InnovationRecord], seed: int) -> tuple[list[InnovationRecord], list[InnovationRecord]]:
    """Four fifths to train on, and one to validate with (paper 003, section 5.2).

    Whole dives where there are five or more, drawn by the seed: neighbouring seconds of one dive are so much alike
    that parts of it would tell little of dives not seen. With fewer, the last fifth of each.

    Raises:
        ValueError: no records, or one too short to be cut.
    """
    if not records:
        raise ValueError("no recordings: want one or more")
    if len(records) < WHOLE_MIN:
        return _cut(records)
    order = np.random.default_rng(seed).permutation(len(records))
    held_out = set(order[: round(VALIDATION_SHARE * len(records))].tolist())
    training = [record for number, record in enumerate(records) if number not in held_out]
    return training, [records[number] for number in sorted(held_out)]


def _cut(records: Sequence[InnovationRecord]) -> tuple[list[InnovationRecord], list[InnovationRecord]]:
    ends = [round((1.0 - VALIDATION_SHARE) * len(record.time_s)) for record in records]
    for record, end in zip(records, ends, strict=True):
        if not 0 < end < len(record.time_s):
            raise ValueError(f"{record.name}: {len(record.time_s)} samples of the DVL: want 3 or more")
    training = [record.part(slice(end)) for record, end in zip(records, ends, strict=True)]
    return training, [record.part(slice(end, None)) for record, end in zip(records, ends, strict=True)]

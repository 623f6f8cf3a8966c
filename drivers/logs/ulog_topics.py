"""Topics of a PX4 log as columns: damage left out by `ulog_segments`, the rest read by pyulog."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

FloatArray: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

TIMESTAMP = "timestamp"


@dataclass(frozen=True, slots=True)
class Topic:
    """N messages of one instance of a topic, in the order of the log.

    Attributes:
        name: of the topic.
        instance: which of several with that name, from 0.
        fields: (N,) each, by their names; those of an array are `name[0]`, ..., those of a nested type `name.field`.
    """

    name: str
    instance: int
    fields: dict[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(self.fields[TIMESTAMP])

    def part(self, rows: Mask) -> Topic:
        """Some of the messages."""
        return Topic(self.name, self.instance, {name: column[rows] for name, column in self.fields.items()})

    def has(self, *names: str) -> bool:
        """Whether it has all these fields."""
        return all(name in self.fields for name in names)

    def numbers(self, name: str) -> FloatArray:
        """(N,) a field."""
        with np.errstate(invalid="ignore"):  # of the many NaN, numpy warns of some
            return self.fields[name].astype(np.float64)

    def columns(self, *names: str) -> FloatArray:
        """(N, number of names) several fields."""
        return np.column_stack([self.numbers(name) for name in names])

    def vector(self, name: str, size: int) -> FloatArray:
        """(N, size) an array."""
        return self.columns(*(f"{name}[{place}]" for place in range(size)))

    @property
    def boot_s(self) -> FloatArray:
        """(N,) when each was published, since the autopilot's start."""
        return self.numbers(TIMESTAMP) / 1e6


def read_topics(segment: bytes) -> list[Topic]:
    """Topics of a part of a log as `SegmentReader` gives it."""
    log = ULog(io.BytesIO(segment), disable_str_exceptions=True)
    return [Topic(one.name, one.multi_id, one.data) for one in log.data_list if TIMESTAMP in one.data]

"""What a bridge has done, and how long it took."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

STEP_S = 1e-5
STEPS = 10_000  # up to 100 ms


@dataclass(frozen=True, slots=True)
class Transit:
    """From the kernel's reception to the other bus's socket; milliseconds, to 0.01; NaN where nothing has passed."""

    median_ms: float
    p99_ms: float
    max_ms: float


class TransitTimes:
    """A histogram in steps of 10 us: its size does not grow with the number of frames."""

    def __init__(self) -> None:
        self._counts = [0] * (STEPS + 1)
        self._total = 0
        self._max_s = 0.0

    def add(self, taken_s: float) -> None:
        """Takes one."""
        self._counts[min(STEPS, int(taken_s / STEP_S))] += 1
        self._total += 1
        self._max_s = max(self._max_s, taken_s)

    def figures(self) -> Transit:
        """Of all so far."""
        if not self._total:
            return Transit(*[float("nan")] * 3)
        longest_ms = 1000.0 * self._max_s
        return Transit(min(longest_ms, self._quantile_ms(0.5)), min(longest_ms, self._quantile_ms(0.99)), longest_ms)

    def _quantile_ms(self, share: float) -> float:
        """Upper end of the step in which it lies."""
        rank, reached = share * self._total, 0
        for step, count in enumerate(self._counts):
            reached += count
            if reached >= rank:
                return 1000.0 * STEP_S * (step + 1)
        raise AssertionError("all are counted in some step")


@dataclass(frozen=True, slots=True)
class WayFigures:
    """One way through a bridge.

    Attributes:
        received: frames or packets that came in.
        sent: that went out, with those that faults have added.
        dropped: those that never went out though no fault wanted that, by cause: "queue full", "can1 is away",
            "malformed frame", "receive buffer overflow", ...
        transit: of those that no fault has held.
    """

    received: int
    sent: int
    dropped: Mapping[str, int] = field(default_factory=dict)
    transit: Transit = field(default_factory=lambda: TransitTimes().figures())


@dataclass(frozen=True, slots=True)
class BridgeFigures:
    """Both ways of a bridge.

    Attributes:
        ways: by their names: "can0 to can1", "can1 to can0".
        changed: what faults have done, by cause.
        away: how often an end was lost, by its name.
    """

    ways: Mapping[str, WayFigures]
    changed: Mapping[str, int] = field(default_factory=dict)
    away: Mapping[str, int] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """For the terminal."""
        told = [_line(name, way) for name, way in self.ways.items()]
        told += [f"{cause}: {count}" for cause, count in sorted(self.changed.items()) if count]
        return told + [f"{name} was away {count} times" for name, count in sorted(self.away.items()) if count]


def _line(name: str, way: WayFigures) -> str:
    line = f"{name}: {way.received} in, {way.sent} out"
    if way.sent:
        took = way.transit
        line += f", within {took.median_ms:.2f} ms (99 %: {took.p99_ms:.2f}, longest {took.max_ms:.2f})"
    lost = ", ".join(f"{count} {cause}" for cause, count in sorted(way.dropped.items()) if count)
    return f"{line}; dropped: {lost}" if lost else line


def counted(counts: Counter[str]) -> dict[str, int]:
    """What was counted at all; also while another thread counts on, for the copy takes no steps in between."""
    return {cause: count for cause, count in dict(counts).items() if count}

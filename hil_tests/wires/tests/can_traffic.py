"""A wire under test, and what goes through it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf

from drivers.can.frame import CanFrame
from hil_tests.scenario.fault import Fault, subject_named
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.way import Passed, Towards

START_S = 1_700_000_000.0
BUS = "can0"


def fault(
    failure: str, subject: str = BUS, *, at_s: float = 0.0, until_s: float = inf, ramp_s: float = 0.0, **values: float
) -> Fault:
    """A fault of a subject by its name in a scenario file."""
    return Fault(
        subject=subject_named(subject), failure=failure, at_s=at_s, until_s=until_s, ramp_s=ramp_s, values=values
    )


def wire(*faults: Fault, signals: CanSignals | None = None, seed: int = 0) -> CanWire:
    """A wire of `BUS` that starts at `START_S`."""
    return CanWire(BUS, CanSignals() if signals is None else signals, faults, START_S, seed)


def passed(
    through: CanWire, frames: Iterable[CanFrame], towards: Towards = Towards.AUTOPILOT, rest_s: float = 1.0
) -> list[CanFrame]:
    """What arrives at one end of frames that enter at their own times, and of what comes in `rest_s` after them."""
    arrived: list[Passed[CanFrame]] = []
    time_s = START_S
    for frame in frames:
        arrived += until(through, frame.time_s)
        time_s = frame.time_s
        through.put(time_s, frame, towards)
        arrived += through.due(time_s)
    arrived += until(through, time_s + rest_s)
    return [one.item for one in arrived if one.towards is towards]


def until(through: CanWire, time_s: float) -> list[Passed[CanFrame]]:
    """What arrives by a time, each thing when it is due."""
    arrived: list[Passed[CanFrame]] = []
    while (next_s := through.next_s()) <= time_s:
        arrived += through.due(next_s)
    return arrived


def every(interval_s: float, count: int, identifier: int = 0x1234, data: bytes = b"abcdefgh") -> list[CanFrame]:
    """Frames at equal intervals, each with its number in its first two bytes, where it has as many."""
    return [
        CanFrame(START_S + n * interval_s, identifier, (n.to_bytes(2, "big") + data[2:])[: len(data)])
        for n in range(count)
    ]


def since_s(frames: Sequence[CanFrame]) -> list[float]:
    """The stamps of frames, since the start."""
    return [frame.time_s - START_S for frame in frames]

"""One scripted fault: what, on whom, when, and how badly. The value that rig and wires act on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from hil_tests.scenario.failures import Target

AXES = ("forward", "right", "down")


@dataclass(frozen=True, slots=True)
class Subject:
    """Whom it befalls.

    Attributes:
        target: what kind of thing.
        thruster: its number from 1; None: no thruster's.
        name: as in the scenario file: "thruster 3 rpm", "dvl", "can0", ...
    """

    target: Target
    name: str
    thruster: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault on the time line; checked against the table of `hil_tests.scenario.failures`.

    Attributes:
        subject: whom it befalls.
        failure: what happens, as in the table.
        at_s: onset, seconds since the start.
        until_s: when it is over; infinity: never.
        ramp_s: how long it takes to its full size, rising linearly; 0: at once.
        values: all quantities of the table's row, by their names; those that the file leaves out have their defaults.
        axis: 0 forward, 1 right, 2 down: the component of a vector that it is of; None: all of them.
    """

    subject: Subject
    failure: str
    at_s: float
    until_s: float = inf
    ramp_s: float = 0.0
    values: Mapping[str, float] = field(default_factory=dict)
    axis: int | None = None

    def active(self, since_s: float) -> bool:
        """Whether it is there at an instant, in seconds since the start."""
        return self.at_s <= since_s < self.until_s

    def grown(self, since_s: float) -> float:
        """How much of its size it has reached: 0 before the onset and after the end, 1 after the ramp."""
        if not self.active(since_s):
            return 0.0
        passed_s = since_s - self.at_s
        return 1.0 if passed_s >= self.ramp_s else passed_s / self.ramp_s

    @property
    def words(self) -> str:
        """For reports: "thruster 3 entangled"."""
        return f"{self.subject.name} {self.failure.replace('_', ' ')}"

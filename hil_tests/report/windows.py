"""When something is expected."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

from gateway.plotting.clock import clock, lasting
from hil_tests.report.outcome import Outcome
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.expectations import Expectation

TIME_DIGITS = 6  # as findings have them: a time of 1.8e9 s has no more in a float


def since_start_s(outcome: Outcome, time_s: float) -> float:
    """Unix seconds as seconds since the start of the play, to the microsecond."""
    return round(time_s - outcome.start_s, TIME_DIGITS)


@dataclass(frozen=True, slots=True)
class Window:
    """When something is expected, in seconds since the start.

    Attributes:
        after_s: from when on it counts.
        first_s: before that it is too early.
        last_s: after that it is too late; infinity: until the end.
    """

    after_s: float
    first_s: float
    last_s: float

    @classmethod
    def of(cls, expectation: Expectation, scenario: Scenario) -> Window:
        """See `Expectation`."""
        after_s = scenario.first_fault_s if expectation.after_s is None else expectation.after_s
        within_s = inf if expectation.within_s is None else expectation.within_s
        return cls(
            after_s, round(after_s + expectation.not_before_s, TIME_DIGITS), round(after_s + within_s, TIME_DIGITS)
        )

    @property
    def words(self) -> str:
        """For people: "within 2 s of 0:25"."""
        origin = clock(self.after_s)
        if self.first_s > self.after_s:
            last = f" to {lasting(self.last_s - self.after_s)}" if isfinite(self.last_s) else " or more"
            return f"{lasting(self.first_s - self.after_s).removesuffix(' s')}{last} after {origin}"
        if isfinite(self.last_s):
            return f"within {lasting(self.last_s - self.after_s)} of {origin}"
        return f"after {origin}" if self.after_s else "at any time"

    def verdict(self, since_s: float) -> str:
        """What is wrong with an instant, "" = nothing."""
        if since_s < self.first_s:
            return f", {lasting(self.first_s - since_s)} too early"
        if since_s > self.last_s:
            return f", {lasting(since_s - self.last_s)} too late"
        return ""

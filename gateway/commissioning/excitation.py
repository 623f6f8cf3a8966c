"""How a thruster was driven: whether that is enough to learn it from, and which manoeuvre is missing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.commissioning.dive import ThrusterSamples

FloatArray: TypeAlias = NDArray[np.float64]

IDLE = 0.05  # command up to which a thruster does not count as driven
DRIVEN_MIN_S = 60.0
REACH_MIN = 0.4  # command that is to be reached in a direction which is driven at all
HELD_S = 0.5  # a command counts as reached when it was held for so long, all together
STEP = 0.1  # change of command that shows delay and lag ...
STEP_S = 0.5  # ... within this time
STEPS_MIN = 12
HOLE_MAX = 0.25  # between neighbouring commands that were held
DEMANDED = 0.6  # what the pilot is asked to go up to


@dataclass(frozen=True, slots=True)
class Excitation:
    """How a thruster was driven.

    Attributes:
        driven_s: time beyond idle.
        ahead, astern: greatest command that was held in each direction, 0 where it was not driven that way.
        steps: number of fast changes of command.
        holes: commands (from, to) between which nothing was held.
    """

    driven_s: float
    ahead: float
    astern: float
    steps: int
    holes: tuple[tuple[float, float], ...]

    def missing(self) -> Iterator[str]:
        """Each manoeuvre that is missing."""
        if self.driven_s < DRIVEN_MIN_S:
            yield (
                f"it was driven for {self.driven_s:.0f} s, {DRIVEN_MIN_S:.0f} s are wanted: drive back and forth for"
                f" {max(DRIVEN_MIN_S - self.driven_s, 30.0):.0f} s more"
            )
        for way, sign, reach in (("ahead", "+", self.ahead), ("astern", "-", self.astern)):
            if 0.0 < reach < REACH_MIN:
                yield (
                    f"{way} was never commanded beyond {sign}{reach:.0%}: drive back and forth for 30 s, up to"
                    f" {sign}{DEMANDED:.0%}"
                )
        if self.steps < STEPS_MIN:
            yield (
                f"its command changed quickly {self.steps} times, {STEPS_MIN} are wanted to see delay and lag: push"
                " the stick to and fro for 30 s"
            )
        for low, high in self.holes:
            middle = (low + high) / 2.0
            yield f"nothing was commanded between {low:+.0%} and {high:+.0%}: drive at {middle:+.0%} for 10 s"


def excitation(dives: Sequence[ThrusterSamples]) -> Excitation:
    """How a thruster was driven in these dives, one or more."""
    driven_s = sum(float((np.abs(one.command) > IDLE).sum()) / one.rate_hz for one in dives)
    command = np.concatenate([one.command for one in dives])
    held = max(1, round(HELD_S * max(one.rate_hz for one in dives)))
    ahead, astern = _reached(command, held), _reached(-command, held)
    return Excitation(
        driven_s=driven_s,
        ahead=ahead,
        astern=astern,
        steps=sum(_steps(one) for one in dives),
        holes=tuple(_holes(command, -astern, ahead, held)),
    )


def _reached(command: FloatArray, held: int) -> float:
    """Greatest positive command that as many samples have, or more; 0 where that is idle."""
    if len(command) < held:
        return 0.0
    reached = float(np.partition(command, -held)[-held])
    return reached if reached > IDLE else 0.0


def _steps(samples: ThrusterSamples) -> int:
    """Fast changes of command; one that goes on is one."""
    apart = max(1, round(STEP_S * samples.rate_hz))
    if len(samples) <= apart:
        return 0
    whole = samples.time_s[apart:] - samples.time_s[:-apart] < 1.5 * STEP_S
    fast = (np.abs(samples.command[apart:] - samples.command[:-apart]) > STEP) & whole
    return int(fast[0]) + int((fast[1:] & ~fast[:-1]).sum())


def _holes(command: FloatArray, low: float, high: float, held: int) -> Iterator[tuple[float, float]]:
    """Between what was held: stretches of command within the range driven where there is next to nothing."""
    within = np.sort(command[(command >= low) & (command <= high)])
    known = within[held - 1 :: held]  # each stands for as many samples
    for before, after in pairwise(known.tolist()):
        if after - before > HOLE_MAX:
            yield before, after

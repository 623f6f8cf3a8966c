"""Keeps what the pipeline knows over restarts; a file that cannot be used is set aside, never fatal.

What was learnt does not age: curves, normal speed, installation of sensors. What the supervisor knew of the moment
(levels, acknowledgements, mutes, what was asked of the autopilot) is taken up only where it is young.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any, Protocol

from gateway import moment, state
from gateway.channel import Learnt
from gateway.moment import Moment

log = logging.getLogger("gateway")

# Two runs' clocks that differ by more were set in between: the times in the supervisor's memory mean nothing then
CLOCKS_DIFFER_S = 5.0


class Knowing(Protocol):
    """What this needs of the pipeline."""

    def learnt(self) -> dict[str, Learnt]:
        """What does not age, by subject."""
        ...

    def recall(self, learnt: Mapping[str, Learnt]) -> list[str]:
        """Takes that; returns the subjects that are now others, or no more there."""
        ...

    def remember(self) -> Any:
        """What is of the moment."""
        ...

    def resume(self, memory: Any) -> None:
        """Takes that."""
        ...


@dataclass(frozen=True, slots=True)
class Recalled:
    """What an earlier run has left: as in its state file, empty = nothing, and whether levels were taken up, too."""

    state: bytes = b""
    resumed: bool = False


class Memory:
    """The state file of a run.

    Args:
        path: where it lies, or will lie.
        young_s: so old at most may be what is taken up of the moment.
        clock: of this run, in unix seconds.
        present: tells when that is on this machine.
    """

    def __init__(
        self,
        path: Path,
        young_s: float,
        clock: Callable[[], float],
        present: Callable[[], Moment] = moment.present,
    ) -> None:
        self._path, self._young_s, self._clock, self._present = path, young_s, clock, present
        self._failing = False

    def recall(self, pipeline: Knowing) -> Recalled:
        """Gives the pipeline what an earlier run has left."""
        try:
            data = self._path.read_bytes()
            found = state.unpack(data)
        except FileNotFoundError:
            pass
        except state.StateError as error:
            self._set_aside(f"state {self._path} {error}")
        except OSError as error:
            log.warning("state %s cannot be read, all is learnt anew: %s", self._path, error)
        else:
            return Recalled(data, self._take(found, pipeline))
        return Recalled()

    def store(self, pipeline: Knowing) -> bytes:
        """Writes what the pipeline knows, and returns that; a failure is logged once, until it works again."""
        known = state.State(self._present(), self._clock(), pipeline.learnt(), pipeline.remember())
        data = state.pack(known)
        try:
            state.write(self._path, data)
        except OSError as error:
            if not self._failing:
                log.error("state %s cannot be saved: %s", self._path, error)
            self._failing = True
        else:
            self._failing = False
        return data

    def _take(self, found: state.State, pipeline: Knowing) -> bool:
        """Whether what was of the moment was taken up, too."""
        foreign = pipeline.recall(found.learnt)
        if foreign:
            self._set_aside(f"state {self._path} is of others: {', '.join(foreign)}", keep=True)
        why_not, age_s = self._obstacle(found)
        if why_not:
            log.info("%s: levels start anew, what was learnt holds", why_not)
        else:
            pipeline.resume(found.passing)
            log.info("state is %s old: levels go on as they were", _words(age_s))
        return not why_not

    def _obstacle(self, found: state.State) -> tuple[str, float]:
        """Why what was of the moment is not taken up, and how old it is; empty where nothing speaks against it."""
        age_s = found.saved.age_s(self._present())
        if age_s is None:
            return f"state is of an earlier boot ({found.saved.date()} by its clock)", nan
        if age_s > self._young_s:
            return f"state is {_words(age_s)} old", age_s
        ahead_s = self._clock() - age_s - found.clock_s
        if not abs(ahead_s) <= CLOCKS_DIFFER_S:
            return f"state is {_words(age_s)} old, and the clock was set by {ahead_s:+.0f} s since", age_s
        return "", age_s

    def _set_aside(self, reason: str, keep: bool = False) -> None:
        aside = self._path.with_name(self._path.name + ".aside")
        try:
            aside.write_bytes(self._path.read_bytes()) if keep else self._path.replace(aside)
        except OSError as error:
            log.warning("%s, and cannot be set aside (%s): what it had is learnt anew", reason, error)
        else:
            log.warning("%s: kept as %s, what it had is learnt anew", reason, aside.name)


def _words(age_s: float) -> str:
    """E.g. `34 s`, `12 min`, `3.5 h`, `2 d`."""
    if age_s < 120.0:
        return f"{age_s:.0f} s"
    if age_s < 7200.0:
        return f"{age_s / 60.0:.0f} min"
    return f"{age_s / 3600.0:.1f} h" if age_s < 172_800.0 else f"{age_s / 86_400.0:.0f} d"

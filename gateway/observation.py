"""What a detector or a watch says of a subject, in the terms of the supervisor."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from detectors.verdict import Level
from gateway import texts


@dataclass(frozen=True, slots=True)
class Observation:
    """What a detector or a watch says of a subject at one instant.

    Attributes:
        time_s: instant.
        detector: who says so: "thruster", "speed", "navigation", "link", "signal".
        subject: of what, as in the findings: "thruster 3", "vehicle", "dvl", "link can0".
        label: the same for a text: "T3", "Speed", "can0".
        level: how bad it is.
        score: dimensionless evidence, NaN where there is none.
        trouble: what is wrong, e.g. "entangled?"; used only where the level is SUSPECT or FAULT.
        details: evidence in pieces that can be left out from the end.
        colon: the trouble is none of what the label says, and is set off from it.
        over: in words, how it ended, where that is not by being ok again.
        confirms: it bears out what another kind of evidence says: a vehicle that is slow, not one that is too fast.
        relies_on: subjects whose FAULT makes this one UNKNOWN, whatever its detector says.
    """

    time_s: float
    detector: str
    subject: str
    label: str
    level: Level
    score: float
    trouble: str
    details: tuple[str, ...] = ()
    colon: bool = False
    over: str = ""
    confirms: bool = True
    relies_on: tuple[str, ...] = ()

    def text(self) -> str:
        """The state in words."""
        if self.level >= Level.SUSPECT:
            return texts.fitted(f"{self.label}{':' if self.colon else ''} {self.trouble}", self.details)
        word = "ok" if self.level is Level.NORMAL else "unknown"
        return texts.fitted(f"{self.label} {word}", self.details, separator=": ")

    def over_text(self) -> str:
        """That it is over, in words."""
        ended = f"{self.label}: {self.over}" if self.over else f"{self.label} ok again"
        return texts.fitted(ended, self.details, separator=": ")

    def unknown(self, why: str) -> Observation:
        """The same subject, of which nothing can be said."""
        return replace(self, level=Level.UNKNOWN, score=math.nan, details=(why,))

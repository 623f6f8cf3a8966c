"""What holds for all subjects of the supervisor."""

from __future__ import annotations

from dataclasses import dataclass, field

from gateway.supervision.announcements import RateLimit
from gateway.supervision.evidence import Geometry


@dataclass(frozen=True, slots=True)
class Settings:
    """See the module's text.

    Attributes:
        repeat_s: a lasting FAULT is said again this often.
        suspect_repeat_s: a lasting SUSPECT.
        limit: of all texts.
        delay_s: in which the pilot can prevent an announced action.
        interval_s: an action is never asked again sooner than this.
        geometry: which thruster drives the vehicle where.
        watching: what is watched, in words, for the pilot; "" = that is not said.
    """

    repeat_s: float = 30.0
    suspect_repeat_s: float = 300.0
    limit: RateLimit = field(default_factory=RateLimit)
    delay_s: float = 5.0
    interval_s: float = 60.0
    geometry: Geometry = field(default_factory=Geometry)
    watching: str = ""

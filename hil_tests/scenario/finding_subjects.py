"""Of whom findings can be, and patterns for them: what is of nobody is never found, and never missed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from typing import Annotated

from pydantic import AfterValidator, Field

FIXED = (
    *("vehicle", "vehicle heading", "vehicle position", "autopilot", "commands", "gateway", "all"),
    *("navigation", "dvl", "depth sensor", "gyroscope", "accelerometer"),
    *("dvl signal", "depth signal", "imu signal"),
)
OF_THRUSTER = ("", " command", " rpm", " esc", " node", " esc index")
LINK = "link "  # with a name behind it, and what of it
THRUSTERS = range(1, 100)


def subject_matches(pattern: str, subject: str) -> bool:
    """Whether a subject fits: `*` stands for any letters, capitals are as small ones."""
    return re.fullmatch(".*".join(map(re.escape, pattern.split("*"))), subject, re.IGNORECASE) is not None


def finding_subjects() -> Iterator[str]:
    """All that there are, but for those of links."""
    yield from FIXED
    for number in THRUSTERS:
        yield from (f"thruster {number}{part}" for part in OF_THRUSTER)


def _of_somebody(pattern: str) -> str:
    known = list(finding_subjects())
    if pattern.lower().startswith(LINK) or any(subject_matches(pattern, subject) for subject in known):
        return pattern
    longer = [subject for subject in known if subject.startswith(f"{pattern.lower()} ")]
    nearest = longer or get_close_matches(pattern.lower(), known, n=1, cutoff=0.6)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known: thruster 3, {', '.join(FIXED)}, link can0"
    raise ValueError(f"no finding has this subject, {hint}")


SubjectPattern = Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_ *-]+$"), AfterValidator(_of_somebody)]

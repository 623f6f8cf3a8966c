"""Colours by level and urgency; without colour, the same picture in bold, reverse and dim."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from detectors.verdict import Level
from gateway.severity import Severity


@dataclass(frozen=True, slots=True)
class Palette:
    """Styles, in the terms of rich.

    Attributes:
        levels: of a subject's level.
        bars: of its bar: on no ground, on which it might not be seen.
        severities: of a text to the pilot; what is not in it is plain.
        heading: of a group of lines.
        faint: what matters least.
    """

    levels: Mapping[Level, str]
    bars: Mapping[Level, str]
    severities: Mapping[int, str]
    heading: str = "bold"
    faint: str = "dim"


# the sixteen colours of the terminal itself: what its owner can read in the sun, he has set there
COLOURED = Palette(
    {Level.UNKNOWN: "dim", Level.NORMAL: "green", Level.SUSPECT: "bold yellow", Level.FAULT: "bold white on red"},
    {Level.UNKNOWN: "dim", Level.NORMAL: "green", Level.SUSPECT: "yellow", Level.FAULT: "red"},
    {Severity.CRITICAL: "bold red", Severity.ERROR: "red", Severity.WARNING: "yellow"},
)
PLAIN = Palette(
    {Level.UNKNOWN: "dim", Level.NORMAL: "", Level.SUSPECT: "bold", Level.FAULT: "bold reverse"},
    {Level.UNKNOWN: "dim", Level.NORMAL: "", Level.SUSPECT: "", Level.FAULT: "bold"},
    {Severity.CRITICAL: "bold", Severity.ERROR: "bold"},
)

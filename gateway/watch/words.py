"""Numbers, times and subjects in the words of a terminal: short, and the same everywhere."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from math import atan2, degrees, hypot, isfinite

from gateway.severity import Severity

UNKNOWN = "-"
# of ages: beyond it, seconds say nothing any more
MINUTES_FROM_S, HOURS_FROM_S = 120.0, 7200.0


def printable(text: str) -> str:
    """The same, and nothing in it that a terminal obeys: what is shown comes from logs as well."""
    return text if text.isprintable() else "".join(one if one.isprintable() else "?" for one in text)


def clock(seconds: float) -> str:
    """A time since some beginning: "0:12:03"."""
    minutes, second = divmod(int(max(seconds, 0.0)), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{second:02}"


def ago(age_s: float) -> str:
    """How long ago something was: "3 s", "12 min", "5 h"."""
    if age_s < MINUTES_FROM_S:
        return f"{max(age_s, 0.0):.0f} s"
    return f"{age_s / 60.0:.0f} min" if age_s < HOURS_FROM_S else f"{age_s / 3600.0:.0f} h"


def number(value: float, form: str = "z.0f") -> str:
    """A number by its format; "-" where it is not known."""
    return format(value, form) if isfinite(value) else UNKNOWN


def flow_words(flow_mps: Sequence[float]) -> str:
    """A flow, north and east, by its speed in m/s and where it sets to in degrees: "0.40 @ 085"."""
    north_mps, east_mps = flow_mps[:2]
    if not (isfinite(north_mps) and isfinite(east_mps)):
        return UNKNOWN
    return f"{hypot(north_mps, east_mps):.2f} @ {round(degrees(atan2(east_mps, north_mps))) % 360:03d}"


_OF_THRUSTER = re.compile(r"thruster (?P<number>\d+)(?P<part>| .*)")
_SHORT: Mapping[str, str] = {
    "dvl": "DVL",
    "depth sensor": "depth",
    "gyroscope": "gyro",
    "accelerometer": "accel",
}


def short(subject: str) -> str:
    """A subject of the findings as pilots call it: "T3" for "thruster 3", "T3 esc" for "thruster 3 esc"."""
    thruster = _OF_THRUSTER.fullmatch(subject)
    return f"T{thruster['number']}{thruster['part']}" if thruster else _SHORT.get(subject, subject)


def listed(subjects: Iterable[str]) -> str:
    """Subjects in short; what is the same of several thrusters, together: "T1-T3 T5 esc, link can0"."""
    parts: dict[str, list[int]] = {}
    for subject in subjects:
        thruster = _OF_THRUSTER.fullmatch(subject)
        parts.setdefault(thruster["part"] if thruster else subject, []).extend(
            [int(thruster["number"])] if thruster else []
        )
    return ", ".join(f"{_ranges(numbers)}{part}" if numbers else short(part) for part, numbers in parts.items())


def _ranges(numbers: Iterable[int]) -> str:
    """Thrusters by their numbers: "T1-T3 T5"."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return " ".join(f"T{run[0]}" if len(run) == 1 else f"T{run[0]}-T{run[-1]}" for run in runs)


def severity_word(severity: int) -> str:
    """Name of a MAV_SEVERITY; of one that there is none of, its number."""
    try:
        return Severity(severity).name
    except ValueError:
        return str(severity)


def counted(counts: Mapping[str, int]) -> str:
    """What was counted, most first: "overrun 3, bad CRC 1"; empty where nothing was."""
    most_first = sorted(counts.items(), key=lambda one: (-one[1], one[0]))
    return ", ".join(f"{name} {count}" for name, count in most_first if count)

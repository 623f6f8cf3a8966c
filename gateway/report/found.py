"""What a pilot wants to know first: what was found, when, for how long; and what was watched."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from detectors.verdict import Level
from gateway.report.dive import Dive, FloatArray
from gateway.report.episodes import Episode, episodes

# what tells a thruster from another in a name and in a text
_THRUSTER = re.compile(r"^Thruster (\d+)(?: \([^)]*\))?")
_LABEL = re.compile(r"^T\d+ ")
# as people write them; all else begins with a capital letter
WRITTEN: Mapping[str, str] = {"dvl": "DVL", "imu": "IMU", "esc": "ESC", "rpm": "RPM", "mavlink": "MAVLink"}


@dataclass(frozen=True, slots=True)
class Trouble:
    """Something was wrong with a subject, or seemed to be.

    Attributes:
        subject: as in the findings.
        name: for people.
        level: the worst.
        text: what the pilot was told when it became that bad.
        first_s: when it began for the first time, since the beginning of the dive.
        times: how often it began.
        total_s: how long it was so, all times together.
        lasts: it was so at the end of the dive.
    """

    subject: str
    name: str
    level: Level
    text: str
    first_s: float
    times: int
    total_s: float
    lasts: bool


@dataclass(frozen=True, slots=True)
class Watched:
    """A subject of the detectors.

    Attributes:
        name: for people.
        judged_s: how long it could be judged.
        level: the worst that was said; UNKNOWN: it was never judged.
        remark: what is worth saying beside.
        heard: there was something to judge by, if too little.
    """

    name: str
    judged_s: float
    level: Level
    remark: str
    heard: bool


def troubles(dive: Dive) -> list[Trouble]:
    """The worst first."""
    several = (_trouble(dive, subject, found) for subject, found in episodes(dive).items())
    return [one for one in several if one is not None]


def as_one(several: Sequence[Trouble]) -> list[Trouble]:
    """Thrusters of which the same is told from the same time on are told of together."""
    alike: dict[Hashable, list[Trouble]] = {}
    for one in several:
        alike.setdefault(_told(one), []).append(one)
    return [group[0] if len(group) == 1 else _together(group) for group in alike.values()]


def _told(one: Trouble) -> Hashable:
    """What is told of it, whichever thruster it is of; of what is no thruster, its name."""
    rest = _THRUSTER.sub("", one.name)
    if rest == one.name:
        return one.name
    return rest, _LABEL.sub("", one.text), one.level, one.times, one.lasts, round(one.first_s), round(one.total_s)


def _together(group: Sequence[Trouble]) -> Trouble:
    numbers = ", ".join(_THRUSTER.findall(one.name)[0] for one in group)
    first = group[0]
    text = _LABEL.sub("", first.text)
    return replace(
        first, name=f"Thrusters {numbers}{_THRUSTER.sub('', first.name)}", text=text[:1].upper() + text[1:]
    )


def watched(dive: Dive) -> list[Watched]:
    """Thrusters, speed and sensors, whether something was found or not."""
    judged = dict(_judged(dive))
    missing = dict.fromkeys(dive.result.unjudged, (0.0, Level.UNKNOWN))
    return [
        Watched(name_of(subject, dive), seconds, level, dive.result.remarks.get(subject, ""), subject in judged)
        for subject, (seconds, level) in {**judged, **missing}.items()
    ]


def headline(dive: Dive) -> tuple[str, str]:
    """How it went in one line, and how bad that is: "bad", "warn", "good" or "quiet"."""
    found = troubles(dive)
    faults = sum(one.level is Level.FAULT for one in found)
    if faults:
        return f"{_counted(faults, 'fault')} found", "bad"
    if not dive.result.judged:
        return "Nothing could be judged", "warn"
    if found:
        return f"No fault, {_counted(len(found), 'suspicion')}", "warn"
    return "Nothing found", "good"


def name_of(subject: str, dive: Dive) -> str:
    """ "thruster 3 esc" as "Thruster 3 (front left) ESC"."""
    words = [WRITTEN.get(word, word) for word in subject.split()]
    if len(words) > 1 and words[0] == "thruster":
        named = {str(one.number): one.name for one in dive.config.thruster if one.name}
        words[1] += f" ({named[words[1]]})" if words[1] in named else ""
    text = " ".join(words)
    return text[:1].upper() + text[1:]


def _trouble(dive: Dive, subject: str, found: Sequence[Episode]) -> Trouble | None:
    bad = [list(group) for wrong, group in groupby(found, lambda one: one.level >= Level.SUSPECT) if wrong]
    if not bad:
        return None
    worst = max((one for group in bad for one in group), key=lambda one: one.level)  # the first of them
    return Trouble(
        subject=subject,
        name=name_of(subject, dive),
        level=worst.level,
        text=worst.text,
        first_s=bad[0][0].from_s,
        times=len(bad),
        total_s=sum(group[-1].to_s - group[0].from_s for group in bad),
        lasts=found[-1] is bad[-1][-1],
    )


def _judged(dive: Dive) -> Iterator[tuple[str, tuple[float, Level]]]:
    """Each subject that there is a course of: how long it was judged, and the worst level."""
    for thruster in dive.thrusters:
        yield f"thruster {thruster.number}", _known(thruster.time_s, thruster.level)
    if dive.speed is not None:
        yield "vehicle", _known(dive.speed.time_s, dive.speed.level)
    if dive.navigation is not None:
        for sensor, level in dive.navigation.levels.items():
            yield sensor, _known(dive.navigation.time_s, level)


def _known(time_s: FloatArray, level: NDArray[np.int64]) -> tuple[float, Level]:
    known = level > Level.UNKNOWN
    return float(np.diff(time_s)[known[:-1] & known[1:]].sum()), Level(int(level.max(initial=0)))


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"

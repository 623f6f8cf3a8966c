"""What operators call the subjects on a command line: `T3`, `thruster 3`, `speed`, `depth sensor`, `all`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from gateway.config import Config
from gateway.navigation_channel import SUBJECT as NAVIGATION
from gateway.operator import ALL, THRUSTER
from gateway.sensor_observations import SUBJECTS
from gateway.speed_channel import SUBJECT as VEHICLE

ALSO: Mapping[str, str] = {
    "speed": VEHICLE,
    "nav": NAVIGATION,
    "depth": "depth sensor",
    "gyro": "gyroscope",
    "accel": "accelerometer",
}
_NUMBER = re.compile(r"(?:thruster|t)?\s*(\d{1,2})(?!\S)")


def watched_subjects(config: Config) -> tuple[str, ...]:
    """All that an operator can speak of in this configuration."""
    subjects = [f"{THRUSTER}{one.number}" for one in config.thruster]
    subjects += [VEHICLE] if config.speed is not None else []
    subjects += [*SUBJECTS.values(), NAVIGATION] if config.navigation is not None else []
    return tuple(subjects)


def subjects_named(words: Sequence[str], watched: Sequence[str]) -> list[str]:
    """The subjects that words name, as the findings call them, or "all".

    Args:
        words: one or several subjects, of one word or of two.
        watched: what there is.

    Raises:
        ValueError: a word that names none of these.
    """
    text = " ".join(words).replace(",", " ").lower()
    return list(dict.fromkeys(_named(" ".join(text.split()), watched)))


def _named(text: str, watched: Sequence[str]) -> Iterator[str]:
    known = {subject: subject for subject in (*watched, ALL)}
    known |= {word: subject for word, subject in ALSO.items() if subject in watched}
    words = sorted(known, key=len, reverse=True)  # "depth sensor" before "depth"
    while text:
        number = _NUMBER.match(text)
        found = next((word for word in words if f"{text} ".startswith(f"{word} ")), None)
        if number is not None and (subject := f"{THRUSTER}{int(number[1])}") in watched:
            yield subject
            text = text[number.end() :].lstrip()
        elif found is not None:
            yield known[found]
            text = text[len(found) :].lstrip()
        else:
            raise ValueError(f"subject {text!r}: want {wanted(watched)}")


def wanted(watched: Sequence[str]) -> str:
    """What could be said, in words."""
    return ", ".join([_short(subject) for subject in watched] + [f"or {ALL}"])


def _short(subject: str) -> str:
    if subject.startswith(THRUSTER):
        return f"T{subject.removeprefix(THRUSTER)}"
    return "speed" if subject == VEHICLE else subject

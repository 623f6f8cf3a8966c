"""`--offset LOG=SECONDS`: what a user says of the clocks of logs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path

from gateway.replay.log_input import LogInput


def offsets_s(offsets: Sequence[str], logs: Sequence[LogInput]) -> dict[Path, float]:
    """What the user gave, by log.

    Raises:
        ValueError: no number, or a log that is not among them.
    """
    given_s: dict[Path, float] = {}
    for text in offsets:
        name, _, number = text.rpartition("=")
        named = {log.path for log in logs if name in (str(log.path), log.path.name)}
        if len(named) != 1:
            raise ValueError(f"--offset {text}: want LOG=SECONDS, of {', '.join(str(log.path) for log in logs)}")
        given_s[named.pop()] = _seconds(text, number)
    return given_s


def _seconds(text: str, number: str) -> float:
    with suppress(ValueError):
        if isfinite(seconds := float(number)):
            return seconds
    raise ValueError(f"--offset {text}: {number!r} is no number of seconds")

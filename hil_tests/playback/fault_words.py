"""A fault as it is given on the command line: "thruster 3 rpm scale factor=0.9 at_s=20"."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from hil_tests.scenario.entry import faults_of
from hil_tests.scenario.fault import Fault

EXAMPLE = '"thruster 3 rpm scale factor=0.9 at_s=20 duration_s=10"'


def parse_fault(text: str) -> list[Fault]:
    """The fault that the words name: subject, failure, and keys as a scenario file has them; `at_s` is 0 if left out.

    Raises:
        ValueError: there is no such subject or failure, or a key that it has not or lacks.
    """
    words = text.split()
    keys = dict(word.split("=", 1) for word in words if "=" in word)
    named = [word for word in words if "=" not in word]
    if len(named) < 2:
        raise ValueError(f"--fault {text!r}: want a subject, a failure, and its quantities: {EXAMPLE}")
    entry: dict[str, Any] = {"at_s": 0.0, "subject": " ".join(named[:-1]), "failure": named[-1]}
    entry |= {key: _value(value) for key, value in keys.items()}
    try:
        faults: Any = faults_of([entry])
    except ValidationError as error:
        raise ValueError(f"--fault {text!r}: {_problems(error)}") from error
    return list(faults)


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _problems(error: ValidationError) -> str:
    found = error.errors(include_url=False)
    return "; ".join(f"{'.'.join(map(str, one['loc'][1:]))}: {one['msg']}" for one in found)

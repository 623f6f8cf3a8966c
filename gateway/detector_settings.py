"""A detector's own settings, out of a table of the configuration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from detectors.thruster import ThrusterConfig
from gateway.problems import Problem, unknown_key


def thruster_settings(table: object, path: str) -> tuple[ThrusterConfig | None, list[Problem]]:
    """The settings that a table gives, or everything that is wrong with it.

    Args:
        table: keys and values of `ThrusterConfig`; what is left out has its default.
        path: key path of the table.
    """
    if not isinstance(table, dict):
        return None, [Problem(path, table, "should be a table")]
    hints = get_type_hints(ThrusterConfig)
    problems = [unknown_key(f"{path}.{key}", value, hints) for key, value in table.items() if key not in hints]
    known = {key: value for key, value in table.items() if key in hints}
    mistyped = {key: problem for key, value in known.items() for problem in _mistyped(path, key, value, hints[key])}
    problems += mistyped.values()
    config, refused = _refused(path, {key: value for key, value in known.items() if key not in mistyped})
    return (None if problems or refused else config), [*problems, *refused]


def _mistyped(path: str, key: str, value: object, hint: Any) -> Iterator[Problem]:
    try:
        TypeAdapter(hint, config=ConfigDict(strict=True)).validate_python(value)
    except ValidationError as error:
        wanted = " or ".join(dict.fromkeys(item["msg"].replace("Input should", "should") for item in error.errors()))
        yield Problem(f"{path}.{key}", value, wanted)


def _refused(path: str, settings: Mapping[str, Any]) -> tuple[ThrusterConfig | None, list[Problem]]:
    """What the detector itself refuses: it names one key at a time, so the rest is tried without that key."""
    problems: list[Problem] = []
    left = dict(settings)
    while True:
        try:
            return ThrusterConfig(**left), problems
        except ValueError as error:
            culprit = next((key for key in left if str(error).startswith(key)), None)
            if culprit is None:
                return None, [*problems, Problem(path, dict(left), str(error))]
            problems.append(Problem(f"{path}.{culprit}", left.pop(culprit), str(error)))

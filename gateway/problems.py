"""What is wrong with a configuration: each problem with its key path, the value, and what would be right."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

VALUE_LENGTH = 60


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong.

    Attributes:
        key: path of the key, e.g. `thruster[number=3].command.link`.
        value: what the file says, None where it says nothing.
        wanted: what would be right.
    """

    key: str
    value: object
    wanted: str

    def __str__(self) -> str:
        if self.value is None:
            return f"{self.key}: {self.wanted}"
        return f"{self.key} = {_shown(self.value)}: {self.wanted}"


class ConfigError(ValueError):
    """A configuration that cannot be used. `problems` has all of them, the text one a line."""

    def __init__(self, source: str, problems: Sequence[Problem]) -> None:
        self.source = source
        self.problems = tuple(problems)
        count = f"{len(problems)} problem{'s' if len(problems) != 1 else ''}"
        super().__init__("\n  ".join([f"{source}: {count}", *map(str, problems)]))

    def __reduce__(self) -> tuple[type[ConfigError], tuple[str, Sequence[Problem]]]:
        """From process to process, with all that it says."""
        return type(self), (self.source, self.problems)


def _shown(value: object) -> str:
    if isinstance(value, Path):  # its end is what tells it from others
        return str(value)
    text = f"a {type(value).__name__} too large to show"
    for write in (str, partial(json.dumps, ensure_ascii=False)):  # the latter as the file has it, where it can be
        with suppress(TypeError, ValueError, RecursionError):
            text = write(value)
    return text if len(text) <= VALUE_LENGTH else text[: VALUE_LENGTH - 3] + "..."


def is_file(path: Path) -> bool:
    """Whether there is such a file; none has a name that is too long for one."""
    try:
        return path.is_file()
    except OSError:
        return False


def unknown_key(path: str, value: object, known: Iterable[str]) -> Problem:
    """The problem of a key that nothing reads, with the known one that it resembles."""
    names = sorted(known)
    key = path.rpartition(".")[2]
    nearest = get_close_matches(key, names, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known here: {', '.join(names)}"
    return Problem(path, value, f"unknown key, {hint}")


def from_validation(error: ValidationError, model: type[BaseModel], path: str) -> list[Problem]:
    """The problems that pydantic found in the table at `path`."""
    return [
        problem_in(item, model, ".".join([path, *map(str, item["loc"])])) for item in error.errors(include_url=False)
    ]


def problem_in(item: Any, model: type[BaseModel], full_path: str) -> Problem:
    """The problem of one item of a `ValidationError` of `model`, which stands at `full_path`."""
    owner, key = _owner(model, item["loc"])
    if item["type"] == "extra_forbidden":
        return unknown_key(full_path, item["input"], owner.model_fields)
    if item["type"] == "unexpected_keyword_argument":  # of a dataclass in the model
        return unknown_key(full_path, item["input"], _names(owner, item["loc"]))
    field = owner.model_fields.get(key)
    description = f" ({field.description})" if field is not None and field.description else ""
    if item["type"] == "missing":
        return Problem(full_path, None, "missing" + description)
    wanted = (
        item["msg"].removeprefix("Value error, ").replace("Input should", "should").replace("String should", "should")
    )
    return Problem(full_path, item["input"], wanted + description)


def _owner(model: type[BaseModel], location: Sequence[str | int]) -> tuple[type[BaseModel], str]:
    """The model that the last key of `location` belongs to, and that key; of a place in a list, the list's."""
    while location and isinstance(location[-1], int):
        location = location[:-1]
    for key in location[:-1]:
        if isinstance(key, int):  # place in a list of tables
            continue
        inner = _table(model.model_fields[key].annotation)
        if inner is None:
            break
        model = inner
    return model, str(location[-1]) if location else ""


def _names(owner: type[BaseModel], location: Sequence[str | int]) -> list[str]:
    """The fields of the dataclass that is a field of `owner` and that the last key of `location` should be one of."""
    field = next(field for key, field in owner.model_fields.items() if key in location)
    kind = _dataclass(field.annotation)
    return [] if kind is None else [one.name for one in fields(kind)]


def _dataclass(annotation: object) -> type[Any] | None:
    """The one in an annotation, as `_table`."""
    if isinstance(annotation, type) and is_dataclass(annotation):
        return annotation
    return next(filter(None, map(_dataclass, get_args(annotation))), None)


def _table(annotation: object) -> type[BaseModel] | None:
    """The model in an annotation: `Flow`, `Flow | None`, `list[Flow]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_table, get_args(annotation))), None)

"""YAML files for people: read as YAML 1.2, and whatever is wrong with them is told with its line.

YAML 1.2, so that `off` and `no` are words and no booleans. A key with nothing behind it is as one that is left out;
one with a `null` behind it says that there is none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from re import sub
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from gateway.problems import ConfigError, Problem, problem_in

ModelT = TypeVar("ModelT", bound=BaseModel)
Location = tuple[str | int, ...]

PLAIN_TAGS = frozenset({"tag:yaml.org,2002:map", "tag:yaml.org,2002:seq"})
# aliases of aliases of aliases: a short text can stand for more than any memory holds
SIZE_MAX = 200_000


@dataclass(frozen=True, slots=True)
class ProblemAt(Problem):
    """A problem, and where to look for it.

    Attributes:
        source: the file.
        line: from 1; 0: none in particular.
    """

    source: str = ""
    line: int = 0

    def __str__(self) -> str:
        place = f"{self.source}:{self.line}" if self.line else self.source
        return f"{place}: {Problem.__str__(self)}" if self.key else f"{place}: {self.wanted}"


class DocumentError(ConfigError):
    """A file that cannot be used. `problems` has all of them, the text one a line."""


@dataclass(frozen=True, slots=True, eq=False)
class YamlDocument:
    """What a file says.

    Attributes:
        source: what error messages call it.
        data: dictionaries, lists, strings, numbers, booleans; an empty file is an empty dictionary.
        root: its nodes, which know their lines.
    """

    source: str
    data: Any
    root: Node | None

    def line(self, location: Location) -> int:
        """Line, from 1, of what is there; of what is not, the line of what it would belong to."""
        line, node = 1, self.root
        for key in location:
            found = _child(node, key)
            if found is None:
                break
            place, node = found
            line = place.start_mark.line + 1
        return line

    def problem(self, location: Location, value: object, wanted: str) -> ProblemAt:
        """A problem at a place of the file."""
        return ProblemAt(path_of(location), value, wanted, self.source, self.line(location))


def read_file(path: Path | str) -> YamlDocument:
    """As `read_text`, of a file.

    Raises:
        DocumentError: see `read_text`; or the file cannot be read.
    """
    try:
        return read_text(Path(path).read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise DocumentError(str(path), [ProblemAt("", None, f"cannot be read: {error}", str(path))]) from error


def read_text(text: str, source: str) -> YamlDocument:
    """What a YAML text says.

    Args:
        text: one document.
        source: what error messages call it.

    Raises:
        DocumentError: it is no YAML, has a key twice in one place, or things that are not for such files.
    """
    yaml = YAML(typ="safe", pure=True)
    try:
        root = yaml.compose(text)
        construction = _Construction(yaml, source)
        data = {} if root is None else construction.value(root, ())
    except YAMLError as error:
        raise DocumentError(source, [_not_yaml(error, source)]) from error
    except RecursionError as error:
        raise DocumentError(source, [ProblemAt("", None, "things in things without end", source)]) from error
    if construction.problems:
        raise DocumentError(source, construction.problems)
    return YamlDocument(source, data, root)


def validated(model: type[ModelT], document: YamlDocument) -> ModelT:
    """The model of what a file says.

    Raises:
        DocumentError: with all that pydantic finds wrong.
    """
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        raise DocumentError(document.source, validation_problems(error, model, document)) from error


def validation_problems(error: ValidationError, model: type[BaseModel], document: YamlDocument) -> list[ProblemAt]:
    """What pydantic found, each place of the file once."""
    found: dict[Location, ProblemAt] = {}
    for item in error.errors(include_url=False):
        location = _in_data(item["loc"], document.data, missing=item["type"] == "missing" or item["input"] is None)
        problem = problem_in(item, model, path_of(location))
        earlier = found.get(location)
        wanted = problem.wanted if earlier is None else f"{earlier.wanted}, or {problem.wanted}"  # of a union
        found[location] = document.problem(location, problem.value, _in_words_of_yaml(wanted))
    return sorted(found.values(), key=lambda problem: problem.line)


def _in_words_of_yaml(wanted: str) -> str:
    """Of pydantic's words for what Python has."""
    wanted = sub(
        r"a valid dictionary( or instance of \w+)?|a valid dictionary or object.*", "a table of keys", wanted
    )
    return wanted.replace("a valid tuple", "a list").replace("a valid boolean", "true or false")


def path_of(location: Location) -> str:
    """As people write it: `faults[2].share`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in location)
    return text.removeprefix(".")


def _in_data(location: Location, data: Any, missing: bool) -> Location:
    """Without what pydantic adds for the branches of a union, which is in no file."""
    for place, key in enumerate(location):
        try:
            data = data[key]
        except (LookupError, TypeError):
            return location[: place + 1] if missing else location[:place]
    return location


def _not_yaml(error: YAMLError, source: str) -> ProblemAt:
    mark = getattr(error, "problem_mark", None)
    reason = (error.problem if isinstance(error, MarkedYAMLError) else None) or str(error).splitlines()[0]
    return ProblemAt("", None, f"not valid YAML: {reason}", source, 0 if mark is None else mark.line + 1)


def _child(node: Node | None, key: str | int) -> tuple[Node, Node] | None:
    """Where a child begins, and the child."""
    if isinstance(node, MappingNode):
        return next(((name, value) for name, value in node.value if name.value == key), None)
    if isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
        return node.value[key], node.value[key]
    return None


@dataclass(slots=True)
class _Construction:
    """Makes plain values of nodes; goes on after problems, so that none hides another."""

    yaml: YAML
    source: str
    problems: list[ProblemAt] = field(default_factory=list)
    size: int = 0

    def value(self, node: Node, location: Location) -> Any:
        self.size += 1
        if self.size > SIZE_MAX:
            raise RecursionError(f"more than {SIZE_MAX} values")
        if isinstance(node, ScalarNode):
            return self._scalar(node, location)
        if node.tag not in PLAIN_TAGS:
            self._wrong(node, location, str(node.tag), "a tag of YAML that means nothing here: want none")
        if isinstance(node, MappingNode):
            return dict(self._items(node, location))
        return [self.value(item, (*location, place)) for place, item in enumerate(node.value)]

    def _items(self, node: MappingNode, location: Location) -> Iterator[tuple[str, Any]]:
        seen: set[str] = set()
        for name, node_of_value in node.value:
            key = str(name.value) if isinstance(name, ScalarNode) else "?"
            if not isinstance(name, ScalarNode):
                self._wrong(name, (*location, key), None, "a key that is no word: want one")
            elif key in seen:
                self._wrong(name, (*location, key), None, "is there twice: want one of them")
            seen.add(key)
            value = self.value(node_of_value, (*location, key))
            if value is not None or node_of_value.value:  # a null that somebody has written
                yield key, value

    def _scalar(self, node: ScalarNode, location: Location) -> Any:
        try:
            return self.yaml.constructor.construct_object(node, deep=True)
        except (YAMLError, ValueError, OverflowError):  # tags of other programs, numbers of thousands of digits
            self._wrong(node, location, node.value, "cannot be read: want a plain number or text")
            return None

    def _wrong(self, node: Node, location: Sequence[str | int], value: object, wanted: str) -> None:
        path = path_of(tuple(location))
        self.problems.append(ProblemAt(path, value, wanted, self.source, node.start_mark.line + 1))

"""A detector's own settings, out of a table of the configuration."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from gateway.problems import Problem, unknown_key

SettingsT = TypeVar("SettingsT")


@dataclass(frozen=True, slots=True)
class Setting:
    """A value of a setting, and the key path that it stands at in the file."""

    path: str
    value: Any


@dataclass(frozen=True, slots=True)
class DetectorSettings(Generic[SettingsT]):
    """How a detector's settings are found.

    Attributes:
        kind: class of the settings, a dataclass that raises ValueError with the name of the setting in front.
        path: key path of the detector's own table.
        elsewhere: settings that stand at other places of the file, by their names; in the table they are unknown.
        left_out: settings that no file can give.
    """

    kind: type[SettingsT]
    path: str
    elsewhere: Mapping[str, Setting]
    left_out: Collection[str] = ()

    def read(self, table: object) -> tuple[SettingsT | None, list[Problem]]:
        """The settings that a table gives, or everything that is wrong with it; what is left out has its default."""
        if not isinstance(table, dict):
            return None, [Problem(self.path, table, "should be a table")]
        hints = {name: hint for name, hint in get_type_hints(self.kind).items() if self._belongs(name)}
        unknown = {key: value for key, value in table.items() if key not in hints}
        problems = [unknown_key(f"{self.path}.{key}", value, hints) for key, value in unknown.items()]
        known = {key: Setting(f"{self.path}.{key}", value) for key, value in table.items() if key in hints}
        mistyped = {key: problem for key, one in known.items() for problem in _mistyped(one, hints[key])}
        problems += mistyped.values()
        sound = {key: one for key, one in known.items() if key not in mistyped}
        settings, refused = self._refused({**sound, **self.elsewhere})
        return (None if problems or refused else settings), [*problems, *refused]

    def _belongs(self, name: str) -> bool:
        return name not in self.elsewhere and name not in self.left_out

    def _refused(self, settings: Mapping[str, Setting]) -> tuple[SettingsT | None, list[Problem]]:
        """What the detector itself refuses: it names one key at a time, so the rest is tried without that key."""
        problems: list[Problem] = []
        left = dict(settings)
        while True:
            values = {key: setting.value for key, setting in left.items()}
            try:
                return self.kind(**values), problems
            except ValueError as error:
                culprit = next((key for key in left if str(error).startswith(key)), None)
                if culprit is None:  # of what is left: it may be what was taken out that is missing now
                    return None, problems or [Problem(self.path, values, str(error))]
                refused = left.pop(culprit)
                wanted = str(error).removeprefix(f"{culprit} = {refused.value!r}: ")
                problems.append(Problem(refused.path, refused.value, wanted))


def _mistyped(setting: Setting, hint: Any) -> Iterator[Problem]:
    try:
        TypeAdapter(hint, config=ConfigDict(strict=True)).validate_python(setting.value)
    except ValidationError as error:
        wanted = " or ".join(dict.fromkeys(item["msg"].replace("Input should", "should") for item in error.errors()))
        yield Problem(setting.path, setting.value, wanted)

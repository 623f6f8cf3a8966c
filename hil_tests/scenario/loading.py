"""Scenario files: read, checked, found, and written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from hil_tests.scenario.consistency import contradictions
from hil_tests.scenario.document import Scenario
from hil_tests.yaml_document import DocumentError, YamlDocument, read_file, read_text, validated

SUFFIXES = (".yaml", ".yml")


def load_scenario(path: Path | str) -> Scenario:
    """Reads and checks a scenario file.

    Raises:
        DocumentError: it cannot be read, is no YAML, or has problems; it lists all of them, each with its line.
    """
    return loaded(read_file(path), Path(path))


def parse_scenario(text: str, folder: Path, source: str = "scenario.yaml") -> Scenario:
    """Checks the text of a scenario file.

    Args:
        text: YAML.
        folder: what relative paths in it are relative to.
        source: what error messages call it; its stem is the scenario's name where the text gives none.

    Raises:
        DocumentError: see `load_scenario`.
    """
    return loaded(read_text(text, source), folder / Path(source).name)


def find_scenarios(paths: Iterable[Path | str]) -> list[Path]:
    """The scenario files among files and folders, with all folders in them: sorted, each once.

    Raises:
        ValueError: a path that is not there, or a folder without any.
    """
    return sorted({found for path in map(Path, paths) for found in _found(path)})


def dump_scenario(scenario: Scenario) -> str:
    """The text of a file that loads to the same scenario."""
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None  # what is small is on one line
    yaml.width = 118
    yaml.sort_base_mapping_type_on_output = False
    stream = StringIO()
    yaml.dump(scenario.model_dump(mode="json", exclude_defaults=True), stream)
    return stream.getvalue()


def loaded(document: YamlDocument, path: Path) -> Scenario:
    """The scenario of a file that has been read.

    Raises:
        DocumentError: it has problems.
    """
    scenario = validated(Scenario, document)
    found = contradictions(scenario, entries_in(document))
    problems = [document.problem(location, value, wanted) for location, value, wanted in found]
    if problems:
        raise DocumentError(document.source, problems)
    return scenario if scenario.name else scenario.model_copy(update={"name": path.stem})


def entries_in(document: YamlDocument) -> Sequence[Mapping[str, Any]]:
    """The faults as the file has them."""
    entries: Sequence[Mapping[str, Any]] = document.data.get("faults", ())
    return entries


def _found(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise ValueError(f"{path}: no such file or folder; want scenario files, or folders with some")
    found = [file for suffix in SUFFIXES for file in path.rglob(f"*{suffix}")]
    if not found:
        raise ValueError(f"{path}: no scenario in this folder; want files that end with {' or '.join(SUFFIXES)}")
    return found

"""The scenarios that ship; scenarios are named by file, by folder, or by the name of one of these."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path

from hil_tests.scenario.loading import SUFFIXES, find_scenarios

SHELF = Path(str(files("hil_tests") / "scenarios"))


def scenario_files(named: Sequence[str | Path] = ()) -> list[Path]:
    """The files that are meant, each once.

    Args:
        named: files, folders, or names of scenarios that ship; none: all that ship.

    Raises:
        ValueError: one of them is none of these, or a folder without scenarios.
    """
    return find_scenarios([_path(name) for name in named] or [SHELF])


def _path(name: str | Path) -> Path:
    path = Path(name)
    if path.exists() or path.suffix in SUFFIXES or len(path.parts) != 1:
        return path
    shipped = {file.stem: file for file in find_scenarios([SHELF])}
    if path.name in shipped:
        return shipped[path.name]
    nearest = get_close_matches(path.name, shipped, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]}?" if nearest else "gateway hil list shows those that ship"
    raise ValueError(f"{name}: no file, no folder, and no scenario that ships, {hint}")

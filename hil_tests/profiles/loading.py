"""Reads profiles: those that come along by name, a user's own by the path of its file."""

from __future__ import annotations

from pathlib import Path

from ruamel.yaml import YAML

from hil_tests.rig.profile import Profile

FOLDER = Path(__file__).parent
SUFFIX = ".yaml"


def profile_names() -> list[str]:
    """Those that come along."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def load_profile(name_or_path: str | Path, relative_to: Path = Path()) -> Profile:
    """A profile by its name, or by the path of its file."""
    path = FOLDER / f"{name_or_path}{SUFFIX}"
    if str(name_or_path) not in profile_names():
        path = relative_to / name_or_path
    return parse_profile(path.read_text(encoding="utf-8"), path.parent, str(path))


def parse_profile(text: str, folder: Path, source: str = "profile") -> Profile:
    """Checks a profile's text."""
    return Profile.model_validate(YAML(typ="safe").load(text) | {"folder": folder})

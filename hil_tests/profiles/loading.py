"""Reads profiles: those that come along by name, a user's own by the path of its file."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from hil_tests.rig.profile import Profile
from hil_tests.yaml_document import DocumentError, ProblemAt, YamlDocument, read_file, read_text, validated

FOLDER = Path(__file__).parent
SUFFIX = ".yaml"


def profile_names() -> list[str]:
    """Those that come along."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def load_profile(name_or_path: str | Path, relative_to: Path = Path()) -> Profile:
    """Reads and checks a profile.

    Args:
        name_or_path: of one that comes along, or of one's own file.
        relative_to: the folder that a path is relative to.

    Raises:
        DocumentError: there is none, it cannot be read, or has problems; it lists all of them, each with its line.
    """
    if str(name_or_path) in profile_names():
        path = FOLDER / f"{name_or_path}{SUFFIX}"
    else:
        path = relative_to / name_or_path
        if not path.is_file():
            raise DocumentError(str(name_or_path), [_unknown(str(name_or_path))])
    return _loaded(read_file(path), path.parent)


def parse_profile(text: str, folder: Path, source: str = "profile.yaml") -> Profile:
    """Checks the text of a profile's file.

    Args:
        text: YAML.
        folder: what relative paths in it are relative to.
        source: what error messages call it.

    Raises:
        DocumentError: see `load_profile`.
    """
    return _loaded(read_text(text, source), folder)


def _loaded(document: YamlDocument, folder: Path) -> Profile:
    profile = validated(Profile, document).model_copy(update={"folder": folder})
    if profile.database is not None and not profile.database.is_file():
        problem = document.problem(("bus", "database"), profile.bus.database, "there is no such file")
        raise DocumentError(document.source, [problem])
    return profile


def _unknown(name: str) -> ProblemAt:
    names = profile_names()
    nearest = get_close_matches(name, names, n=1)
    hint = f"did you mean {nearest[0]}?" if nearest else f"want the path of a file, or one of {', '.join(names)}"
    return ProblemAt("", None, f"no such vehicle profile, {hint}", name)

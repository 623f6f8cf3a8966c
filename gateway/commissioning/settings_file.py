"""The user's own configuration file with what was learnt put in: order, comments and all else stay as they are."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import Item, Table

from gateway.commissioning.part import Setting

MARK, BEFORE_THEIRS = "commissioned: ", " | "
# what the gateway reads, by keys; what it writes is left to lie beside the new file
READ = (("mavlink", "signing_key"), ("navigation", "lstm_model"), ("speed", "flow", "file"))


def with_settings(
    text: str, settings: Iterable[Setting], removed: Iterable[str], folder: Path, new_folder: Path
) -> str:
    """The text of a configuration file with these settings, for a file in another folder.

    Behind each that is set stands what commissioning says of it, what it was before, and the user's own comment.

    Args:
        text: valid configuration.
        settings: what to set.
        removed: paths of keys to take out, where they are in it.
        folder: that the file lies in.
        new_folder: that the new one will lie in: paths of files that are read are changed accordingly.
    """
    document = tomlkit.parse(text)
    for path in removed:
        *tables, key = path.split(".")
        if (table := _found(document, tables)) is not None:
            table.pop(key, None)
    for one in settings:
        *tables, key = one.key.split(".")
        _set(_table(document, tables), key, tomlkit.item(one.value), one.comment)
    if folder.resolve() != new_folder.resolve():
        _move(document, folder, new_folder)
    return tomlkit.dumps(document).rstrip("\n") + "\n"


def _table(document: Any, names: Sequence[str]) -> Any:
    """The table of that path, made where there is none."""
    table, made = document, False
    for name in names:
        made = name not in table
        if made:
            table.add(name, tomlkit.table())
        table = table[name]
    if made:
        table.add(tomlkit.nl())
    return table


def _set(table: Any, key: str, value: Item, said: str) -> None:
    old = table.get(key)
    if old is None:
        _add(table, key, value)
    elif old != value:
        table[key] = value
    before = f"was {_in_toml(old)}" if old is not None and old != value else ""
    ours = " ".join(", ".join(filter(None, (said, before))).split())
    theirs = "" if old is None else _theirs(old)
    if ours:
        table[key].comment(BEFORE_THEIRS.join(filter(None, (MARK + ours, theirs))))


def _add(table: Any, key: str, value: Item) -> None:
    """Behind the last key of a table: comments that follow are of what comes next."""
    body, trailing = table.value.body, []
    while body and body[-1][0] is None:
        trailing.append(body.pop()[1])
    table.add(key, value)
    for item in reversed(trailing):
        table.add(item)


def _in_toml(value: Item) -> str:
    return value.as_string().strip()


def _theirs(old: Item) -> str:
    """The user's own comment behind a value, without what an earlier commissioning said."""
    comment = old.trivia.comment.removeprefix("#").strip()
    return comment.partition(BEFORE_THEIRS)[2] if comment.startswith(MARK.strip()) else comment


def _move(document: Any, folder: Path, new_folder: Path) -> None:
    for table, key in _paths(document):
        path = Path(str(table[key]))
        if not path.is_absolute():
            moved = os.path.relpath(folder.resolve() / path, new_folder.resolve())
            _set(table, key, tomlkit.item(Path(moved).as_posix()), "moved")


def _paths(document: Any) -> Iterator[tuple[Any, str]]:
    """Tables and keys of paths that are read."""
    buses = ((bus, "database") for bus in document.get("can", []))
    others = ((table, keys[-1]) for keys in READ if (table := _found(document, keys[:-1])) is not None)
    yield from ((table, key) for table, key in chain(buses, others) if key in table)


def _found(document: Any, names: Iterable[str]) -> Any:
    table = document
    for name in names:
        table = table.get(name) if isinstance(table, Table | dict) else None
        if table is None:
            return None
    return table

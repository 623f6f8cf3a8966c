"""What commissioning leaves in its folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from gateway import state
from gateway.commissioning.page import page
from gateway.commissioning.session import PAGE, STATE, Commissioning


def write(found: Commissioning, vehicle: str, source: Path, out: Path) -> Iterator[Path]:
    """Writes configuration, state and page, each whole or not at all; gives the paths of those that there are.

    Args:
        found: what was learnt; without a new configuration, only the page is written.
        vehicle: its name.
        source: the old configuration, for its name.
        out: folder, which exists.

    Raises:
        OSError: one cannot be written.
    """
    files = {
        source.name: None if found.text is None else found.text.encode(),
        STATE: found.state,
        PAGE: page(found, vehicle, source).encode(),
    }
    for name, data in files.items():
        if data is not None:
            state.write(out / name, data)
            yield out / name

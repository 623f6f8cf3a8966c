"""The recorder that a configuration wants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from uuid import uuid4

from gateway.config import Config
from gateway.recording.entries import About
from gateway.recording.journal import Journal, NoJournal

DISTRIBUTION = "thruster-gateway"


def journal_of(config: Config, now: Callable[[], float]) -> Journal:
    """Of a run that begins now, in unix seconds; one that writes nothing where nothing is to be recorded."""
    if not config.recording.enabled:
        return NoJournal()
    from gateway.recording.recorder import Recorder

    return Recorder(config.recording, _about(config, now()), now)


def _about(config: Config, started_s: float) -> About:
    return About(
        run=uuid4().hex,
        part=1,
        started_s=started_s,
        vehicle=config.vehicle.name,
        version=version(DISTRIBUTION),
        config=config.text,
        files=dict(_files(config)),
        state=b"",
        resumed=False,
    )


def _files(config: Config) -> Iterator[tuple[str, bytes]]:
    """What the configuration names and the buses cannot be decoded without; no keys, which are secret."""
    databases = {bus.database for bus in config.can if bus.database is not None}
    for path in sorted(map(Path, databases)):
        with suppress(OSError):  # whoever opens the bus says so
            yield path.name, path.read_bytes()

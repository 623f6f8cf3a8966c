"""Logs to dives: replayed as they are by `gateway replay`, keeping what the detectors were given.

Logs in one folder are of one dive, or of dives one after the other; logs in different folders are different dives.
Recordings of ours are as many dives as they have runs.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

from gateway.commissioning.dive import RecordedDive
from gateway.commissioning.keeping import Keeping
from gateway.config import Config
from gateway.replay.log_input import LogInput
from gateway.replay.reels import reels
from gateway.replay.session import Progress, replay


def by_dive(logs: Iterable[LogInput]) -> dict[Path, list[LogInput]]:
    """The logs of each folder, in the order in which they were named."""
    dives: dict[Path, list[LogInput]] = {}
    for log in logs:
        dives.setdefault(log.path.resolve().parent, []).append(log)
    return dives


def named(folders: Collection[Path]) -> dict[Path, str]:
    """What dives are called by their folders: what tells these apart."""
    if len(folders) == 1:
        return {folder: folder.name for folder in folders}
    common = Path(os.path.commonpath(folders))
    return {folder: folder.relative_to(common).as_posix() for folder in folders}


def read_dives(
    config: Config,
    logs: Sequence[LogInput],
    name: str,
    given_s: Mapping[Path, float] = MappingProxyType({}),
    progress: Callable[[float], None] = lambda _: None,
    jobs: int = 1,
) -> list[RecordedDive]:
    """What the logs of one folder hold for the detectors; a dive without a single reading is left out.

    Args:
        config: where everything is read, and with which settings it is judged.
        logs: of one folder.
        name: of the dive.
        given_s: by log, what is to be added to its times; of other dives' logs as well.
        progress: hears how many seconds of it were read.
        jobs: processes for the detectors of thrusters.

    Raises:
        OSError: a log cannot be read.
        ValueError: a log is not what its name says, or the logs do not go together.
    """
    keeping = Keeping(name)
    own_s = {log.path: given_s[log.path] for log in logs if log.path in given_s}

    def show(place: Progress) -> None:
        keeping.found(place.findings)
        progress(place.dive_s)

    with TemporaryDirectory() as folder:
        replay(config, reels(logs, config, own_s), Path(folder) / "findings", show, jobs=jobs, onlooker=keeping)
    return [one for one in keeping.dives if one.duration_s > 0.0]

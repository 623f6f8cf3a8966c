"""What a recording of ours holds, as it is read back: the arguments of `Journal`, each with its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame_block import FrameBlock
from drivers.readings import Reading
from gateway.findings import Finding


@dataclass(frozen=True, slots=True)
class Frames:
    """Frames of a bus, in order. `place`: (N,) ascending, of each."""

    bus: str
    frames: FrameBlock
    place: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Heard:
    """Bytes that came over MAVLink."""

    place: int
    time_s: float
    data: bytes


@dataclass(frozen=True, slots=True)
class Spoken:
    """A MAVLink packet of ours."""

    place: int
    time_s: float
    data: bytes


@dataclass(frozen=True, slots=True)
class Told:
    """A reading that no decoder has made. `before`: the place in front of which it was judged; None: its own."""

    place: int
    link: str
    reading: Reading
    before: int | None = None


@dataclass(frozen=True, slots=True)
class Tick:
    """The pipeline was told the time."""

    place: int
    time_s: float


@dataclass(frozen=True, slots=True)
class Found:
    """A finding of the run itself. `place`: of what was written down last before it."""

    place: int
    finding: Finding


Entry: TypeAlias = Frames | Heard | Spoken | Told | Tick | Found


@dataclass(frozen=True, slots=True)
class About:
    """What a recording says of itself.

    Attributes:
        run: identifies the run: the same in all its files.
        part: number of the file in the run, from 1.
        started_s: when the run began, unix seconds.
        vehicle: name of it.
        version: of this program.
        config: text of the configuration file; empty where there was none.
        files: what the configuration names, by its file name: databases of CAN, say.
        state: what an earlier run had learnt, as in the state file (`gateway.state`), when this file was begun;
            empty: nothing.
        resumed: whether levels and the like were taken up from that, too.
    """

    run: str
    part: int
    started_s: float
    vehicle: str
    version: str
    config: str
    files: Mapping[str, bytes]
    state: bytes
    resumed: bool
    path: Path | None = None

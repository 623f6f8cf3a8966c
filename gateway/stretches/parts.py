"""What a stretch of readings goes through, and the terms that its ways through have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.readings import Reading
from gateway.channel import Aligned, Channel, Judgement, Source
from gateway.silence import SilenceWatch
from gateway.supervisor import Supervisor
from gateway.thruster_channel import JudgedColumns
from gateway.timeline import Timeline

IndexArray: TypeAlias = NDArray[np.intp]
FloatArray: TypeAlias = NDArray[np.float64]
Taken: TypeAlias = tuple[tuple[Channel[Any], Aligned], ...]
Said: TypeAlias = Iterable[Any]
Seen: TypeAlias = Callable[[JudgedColumns | Judgement], object]  # is shown what detectors say, each judgement once
Happening: TypeAlias = tuple[int, Callable[[], Said]]  # rank of the reading, what then happens


@dataclass(frozen=True, slots=True)
class Parts:
    """What a stretch goes through: the pipeline's own parts.

    Attributes:
        timeline, silence, supervisor: see there.
        channels: all of them; routes: those of each source, in the same order.
        hear: takes a reading, and what it did to the channels; judged: a judgement; tick: the time of a tick.
        seen: is shown every judgement, before anything comes of it.
        drops: counted here by cause.
    """

    timeline: Timeline
    silence: SilenceWatch
    supervisor: Supervisor
    channels: Sequence[Channel[Any]]
    routes: Mapping[Source, Sequence[Channel[Any]]]
    hear: Callable[[str, Reading, Taken], Said]
    judged: Callable[[Judgement], Said]
    tick: Callable[[float], Said]
    drops: Counter[str]
    seen: Seen

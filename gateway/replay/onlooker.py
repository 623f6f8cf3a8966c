"""Who looks on while logs are replayed: what the detectors say is much, and a replay itself keeps none of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from gateway.channel import Judgement
from gateway.pipeline import Pipeline
from gateway.stretches.stretch import BlockArrival
from gateway.thruster_channel import JudgedColumns


class Onlooker(Protocol):
    """Is told everything in order."""

    def stretch(self, arrivals: Sequence[BlockArrival]) -> None:
        """These readings come next; what is shown until the next stretch is from them."""
        ...

    def seen(self, shown: JudgedColumns | Judgement) -> None:
        """What the detectors say: see `gateway.stretches.parts.Seen`."""
        ...

    def end(self, pipeline: Pipeline) -> None:
        """All is judged, and the detectors are still there."""
        ...


class Nobody:
    """Nobody looks on."""

    def stretch(self, arrivals: Sequence[BlockArrival]) -> None:
        """Nothing."""

    def seen(self, shown: JudgedColumns | Judgement) -> None:
        """Nothing."""

    def end(self, pipeline: Pipeline) -> None:
        """Nothing."""

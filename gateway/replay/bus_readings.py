"""A CAN bus of the vehicle in a log: its decoder, and the state that its frames tell."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from operator import itemgetter

from drivers.can.bus_state import BusState
from drivers.can.frame_block import FrameBlock
from drivers.reading_block import ReadingBlock
from drivers.readings import LinkState
from gateway.config import Config
from gateway.config_sections import CanBus
from gateway.wiring import can_decoder


class BusReadings:
    """Frames in, readings out: what `gateway.can_source` is to a live bus.

    Args:
        bus: of the configuration.
        config: the rest of it.
    """

    def __init__(self, bus: CanBus, config: Config) -> None:
        self._name = bus.name
        self._decoder = can_decoder(bus, config.thruster)
        self._told: Counter[str] = Counter()
        self._state = BusState(self._told)

    def decode(self, frames: FrameBlock) -> ReadingBlock:
        """What was sent, and what became of the bus, in the order of the frames."""
        block = self._decoder.decode_block(frames)
        states = [
            (change.row, LinkState(float(frames.time_s[change.row]), self._name, change.up, change.detail))
            for change in self._state.changes(frames)
        ]
        if not states:
            return block
        return replace(block, others=tuple(sorted([*block.others, *states], key=itemgetter(0))))

    def drops(self) -> Counter[str]:
        """What was thrown away, and what was wrong with the bus, by cause."""
        return self._decoder.drops + self._told

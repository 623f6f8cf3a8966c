"""A CAN bus of the vehicle: its link, its decoder, and how much it has to carry."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

from drivers.can.bus import CanLink
from drivers.can.error_frame import BusCondition
from drivers.can.frame_block import FrameBlock
from drivers.can.interface import LISTEN_ONLY, SOCKETCAN, PortOpener
from drivers.can.load import BitRates, BusLoadMeter
from drivers.can.network_interface import bit_rates, traffic
from drivers.can.packets import OVERFLOW
from drivers.clock import Clock
from drivers.readings import BusLoad, FrameLoss, LinkState
from gateway.config import Config
from gateway.config_sections import CanBus
from gateway.intake import Intake
from gateway.wiring import can_decoder

PortOf = Callable[[CanBus], PortOpener]

LOAD_PERIOD_S = 1.0
# from so many frames on a block is decoded faster as a whole: they have waited, and there is something to catch up
BLOCK_MIN = 300


class CanSource:
    """A CAN bus and its decoder.

    Args:
        bus: of the configuration.
        config: the rest of it.
        clock: stamps what is received.
        intake: gets frames and readings.
        open_port: opens the bus; None: as it is configured.
    """

    def __init__(
        self, bus: CanBus, config: Config, clock: Clock, intake: Intake, open_port: PortOpener | None = None
    ) -> None:
        self._bus, self._clock, self._intake = bus, clock, intake
        self._decoder = can_decoder(bus, config.thruster)
        filters = self._decoder.filters()
        self._link = CanLink(
            bus.name, bus.interface, bus.channel, filters, clock, open_port=open_port, **options_of(bus)
        )
        self._meter: BusLoadMeter | None = None
        self._losses = (0, 0)

    @property
    def name(self) -> str:
        """Of the bus, in the configuration."""
        return self._bus.name

    @property
    def received(self) -> int:
        """Frames so far."""
        return self._link.counters["frames"]

    async def run(self, on_state: Callable[[LinkState], None]) -> None:
        """Keeps the link alive until it is cancelled."""
        await self._link.run(self._on_frames, on_state, partial(self._intake.frames, self.name))

    async def watch_load(self) -> None:
        """Says once a second how busy the bus is, where its bit rate is known, and what was lost of it.

        Until it is cancelled.
        """
        connections = 0
        while True:
            await asyncio.sleep(LOAD_PERIOD_S)
            if self._link.counters["connections"] != connections:  # it may have been set to another rate meanwhile
                connections = self._link.counters["connections"]
                rates = await rates_of(self._bus)
                self._meter = None if rates is None else BusLoadMeter(rates)
            self._measure()
            self._tell_losses()

    def drops(self) -> Counter[str]:
        """What was thrown away, and what was wrong with the bus, by cause."""
        trouble = {name: n for name, n in self._link.counters.items() if name not in ("frames", "connections")}
        return self._decoder.drops + Counter(trouble)

    def decode_errors(self) -> Counter[str]:
        """That of it which the decoder threw away."""
        return Counter(self._decoder.drops)

    def _on_frames(self, frames: FrameBlock) -> None:
        self._intake.frames(self.name, frames)
        if self._meter is not None:
            self._meter.read(frames)
        if len(frames) >= BLOCK_MIN:
            readings = self._decoder.decode_block(frames).readings()
        else:
            readings = [reading for frame in frames.frames() for reading in self._decoder.decode(frame)]
        self._intake.decoded(self.name, readings)

    def _measure(self) -> None:
        if self._meter is None:
            return
        counted = traffic(self._bus.channel) if self._bus.interface == SOCKETCAN else None
        time_s = self._clock.now()
        share = self._meter.share(time_s, counted)
        if share is not None:
            self._intake.reading(self.name, BusLoad(time_s, self.name, share))

    def _tell_losses(self) -> None:
        before = self._losses
        self._losses = self._link.counters[OVERFLOW], self._link.counters[BusCondition.OVERFLOW.value]
        if any(self._losses):
            frames, overruns = (now - earlier for now, earlier in zip(self._losses, before, strict=True))
            self._intake.reading(self.name, FrameLoss(self._clock.now(), self.name, frames, overruns))


def options_of(bus: CanBus) -> dict[str, Any]:
    """What python-can is told of a bus, beside its channel."""
    options: dict[str, Any] = {} if bus.bitrate is None else {"bitrate": bus.bitrate}
    return {**options, **LISTEN_ONLY[bus.interface]} if bus.listen_only else options


async def rates_of(bus: CanBus) -> BitRates | None:
    """As its interface is set, else as configured; of a bus with neither, the load is not known."""
    found = await bit_rates(bus.channel) if bus.interface == SOCKETCAN else None
    if found is None and bus.bitrate is not None:
        return BitRates(bus.bitrate)
    return found

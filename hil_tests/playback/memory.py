"""A CAN bus and a MAVLink link in memory, for a gateway and a vehicle in one event loop."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from drivers.can.frame import CanFilter, CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.interface import PortOpener
from drivers.can.port import CanPort
from drivers.clock import Clock
from drivers.mavlink.endpoint import Endpoint
from drivers.mavlink.transports import LostCallback, ReceiveCallback, Transport


class MemoryPort:
    """The gateway's end of a bus: see `drivers.can.port.CanPort`. It is told the frames with their own times,
    in whole microseconds; all of them, whatever it would have filtered, for nobody else counts what the bus carries.
    """

    def __init__(self) -> None:
        self._waiting: list[CanFrame] = []
        self._arrived = asyncio.Event()

    def put(self, frames: Sequence[CanFrame]) -> None:
        """Frames are on the bus."""
        if frames:
            self._waiting += frames
            self._arrived.set()

    async def receive(self) -> FrameBlock:
        """See CanPort."""
        await self._arrived.wait()
        self._arrived.clear()
        frames, self._waiting = sorted(self._waiting, key=lambda frame: frame.time_s), []
        # as the log of the play has them: what is replayed from it is then judged as it was here
        microseconds = np.array([round(frame.time_s, 6) for frame in frames])
        return replace(FrameBlock.of(frames), time_s=microseconds)

    def send(self, frame: CanFrame) -> None:
        """The gateway only listens.

        Raises:
            RuntimeError: always.
        """
        raise RuntimeError("the gateway has sent a CAN frame: it never should")

    def close(self) -> None:
        """See CanPort."""


class MemoryBus:
    """A bus between a vehicle and a gateway that opens it as often as it likes. Everybody hears all others."""

    def __init__(self) -> None:
        self._ports: list[MemoryPort] = []
        self._for_devices: list[CanFrame] = []

    def opener(self) -> PortOpener:
        """How the gateway opens it."""

        def open_port(_: Sequence[CanFilter], __: Clock, ___: Counter[str]) -> CanPort:
            self._ports.append(MemoryPort())
            return self._ports[-1]

        return open_port

    def send(self, from_autopilot: Sequence[CanFrame], from_devices: Sequence[CanFrame]) -> None:
        """Autopilot and ESCs transmit."""
        self._for_devices += from_autopilot
        for port in self._ports[-1:]:
            port.put([*from_autopilot, *from_devices])

    def heard_by_devices(self) -> list[CanFrame]:
        """What others have sent since this was last asked."""
        frames, self._for_devices = self._for_devices, []
        return frames

    def close(self) -> None:
        """Nothing to let go of."""


class MemoryLink:
    """A MAVLink link between an autopilot and a gateway: datagrams, as UDP would carry them."""

    def __init__(self) -> None:
        self._on_bytes: ReceiveCallback | None = None
        self._for_autopilot: list[bytes] = []

    async def connect(self, _: Endpoint, on_bytes: ReceiveCallback, __: LostCallback, ___: Counter[str]) -> Transport:
        """How the gateway opens it: see `drivers.mavlink.transports.Connect`."""
        self._on_bytes = on_bytes
        return _GatewayEnd(self._for_autopilot.append, self._close)

    def send(self, datagram: bytes) -> None:
        """To the gateway, after the frames that were on the bus before, for which a task of it has to wake up."""
        if self._on_bytes is not None:
            loop = asyncio.get_running_loop()
            loop.call_soon(loop.call_soon, self._deliver, datagram)

    def heard(self) -> list[bytes]:
        """What the gateway has sent since this was last asked."""
        datagrams = self._for_autopilot[:]
        self._for_autopilot.clear()
        return datagrams

    def close(self) -> None:
        """Nothing to let go of."""

    def _deliver(self, datagram: bytes) -> None:
        if self._on_bytes is not None:
            self._on_bytes(datagram)

    def _close(self) -> None:
        self._on_bytes = None


class _GatewayEnd:
    """See `drivers.mavlink.transports.Transport`."""

    def __init__(self, put: Callable[[bytes], None], closed: Callable[[], None]) -> None:
        self._put, self._closed = put, closed

    def send(self, data: bytes) -> None:
        """See Transport."""
        self._put(data)

    def close(self) -> None:
        """See Transport."""
        self._closed()

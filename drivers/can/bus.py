"""A CAN bus that is always wanted: opened, read in batches, and opened again for as long as it takes."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NoReturn

from drivers.can.bus_state import BusState
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.frame_block import ERROR, FrameBlock
from drivers.can.hanging import in_thread
from drivers.can.interface import PortOpener, port_opener
from drivers.can.port import CanPort, CanPortError
from drivers.clock import Clock
from drivers.readings import LinkState

BACK_OFF_FIRST_S = 0.1
BACK_OFF_MAX_S = 2.0
# an adapter that no longer answers is not waited for
CLOSE_S = 0.5

OnFrames = Callable[[FrameBlock], None]
OnState = Callable[[LinkState], None]


class CanLink:
    """One CAN bus, read until it is cancelled.

    It only listens: nothing is ever put on the bus but by `send`, and that takes only what `may_send` names.

    An interface that is missing, down, deleted or unplugged is tried again after 0.1 s, 0.2 s, ... 2 s. A controller
    that went bus-off is brought back by the kernel where the interface has a `restart-ms`, and is reported as down
    until then. It is not restarted from here: who only listens does not go bus-off, so it was another program that
    sends on this interface, and to try again and again would hide a fault in the wiring. An adapter that hangs while
    it is opened or closed keeps nobody else waiting: that is done in a thread.

    Args:
        name: of the link in the configuration.
        interface: python-can's name: "socketcan", "virtual", ...
        channel: its channel, such as "can0".
        filters: frames that are wanted, for the kernel to discard the rest; none: all frames.
        clock: stamps frames and states.
        may_send: frames that `send` takes; none: it takes nothing.
        open_port: how the bus is opened; None: by python-can.
        options: passed on to python-can, such as `fd=True`.

    Attributes:
        counters: "frames", "connections", "remote frame", "malformed frame", "receive buffer overflow" (frames that
            the kernel lost because this program was too slow), "send failed", and error frames by what they said
            ("bus-off", "error passive", "controller overflow", ...).

    Raises:
        ValueError: python-can has no such interface.
    """

    def __init__(
        self,
        name: str,
        interface: str,
        channel: str,
        filters: Sequence[CanFilter],
        clock: Clock,
        *,
        may_send: Sequence[CanFilter] = (),
        open_port: PortOpener | None = None,
        **options: Any,
    ) -> None:
        self.name = name
        self.counters: Counter[str] = Counter()
        self._filters = tuple(filters)
        self._may_send = tuple(may_send)
        self._clock = clock
        self._open_port = open_port or port_opener(interface, channel, **options)
        self._port: CanPort | None = None
        self._state = BusState(self.counters)

    async def run(self, on_frames: OnFrames, on_state: OnState, on_errors: OnFrames | None = None) -> NoReturn:
        """Read for ever; all callbacks are called in the event loop's thread.

        Args:
            on_frames: gets every block of data frames, in the order of the bus.
            on_state: gets the state whenever it changes, and once after the first attempt to open the bus.
            on_errors: gets the controller's error frames, which are none of the bus.
        """
        back_off_s = BACK_OFF_FIRST_S
        while True:
            received = self.counters["frames"]
            try:
                await self._serve(on_frames, on_state, on_errors)
            except CanPortError as error:
                self._report(on_state, False, str(error))
            finally:
                await self._close()
            if self.counters["frames"] > received:
                back_off_s = BACK_OFF_FIRST_S
            await asyncio.sleep(back_off_s)
            back_off_s = min(2.0 * back_off_s, BACK_OFF_MAX_S)

    def send(self, frame: CanFrame) -> bool:
        """Put a frame on the bus; False, and counted, if the bus is not there or does not take it.

        Raises:
            ValueError: it is none of the frames that this link may send.
        """
        if not any(allowed.matches(frame) for allowed in self._may_send):
            raise ValueError(f"identifier {frame.identifier:#x} may not be sent on {self.name}: {self._allowed()}")
        try:
            if self._port is None:
                raise CanPortError("not connected")
            self._port.send(frame)
        except CanPortError:  # whether the bus is gone, the reading side finds out
            self.counters["send failed"] += 1
            return False
        return True

    async def _serve(self, on_frames: OnFrames, on_state: OnState, on_errors: OnFrames | None) -> NoReturn:
        """Open the bus and read it until it fails."""
        self._port = port = await in_thread(self._open, abandon=lambda late: late.close())
        self.counters["connections"] += 1
        self._report(on_state, True, "")
        while True:
            frames = self._data_frames(await port.receive(), on_state, on_errors)
            if len(frames):
                self.counters["frames"] += len(frames)
                on_frames(frames)

    def _open(self) -> CanPort:
        return self._open_port(self._filters, self._clock, self.counters)

    def _data_frames(self, frames: FrameBlock, on_state: OnState, on_errors: OnFrames | None) -> FrameBlock:
        """The block without its error frames; what they say is counted and reported."""
        errors = frames.kind & ERROR != 0
        if on_errors is not None and errors.any():
            on_errors(frames.part(errors))
        for change in self._state.changes(frames):
            on_state(LinkState(self._clock.now(), self.name, change.up, change.detail))
        return frames.part(~errors) if errors.any() else frames

    def _allowed(self) -> str:
        if not self._may_send:
            return "it only listens"
        return "want " + ", ".join(f"{one.identifier:#x} under mask {one.mask:#x}" for one in self._may_send)

    def _report(self, on_state: OnState, up: bool, detail: str) -> None:
        if self._state.becomes(up, detail):
            on_state(LinkState(self._clock.now(), self.name, up, detail))

    async def _close(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            with suppress(TimeoutError):
                async with asyncio.timeout(CLOSE_S):
                    await in_thread(port.close)

"""An opened CAN interface: frames come out in batches, and whatever fails is one exception."""

from __future__ import annotations

import asyncio
import errno
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import can

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.clock import Clock

# Waiting this long after the first frame costs no accuracy, for frames are stamped when they arrive, and saves most
# of the wake-ups of a busy bus, which cost more than the frames: less than half of its reading with 0.005 s.
GATHER_S = 0.02
# python-can's interfaces have nothing to wait on; some have buffers for a few milliseconds only
POLL_S = 0.005
BATCH_MAX = 1000

_REASONS = {
    errno.ENETDOWN: "interface is down",
    errno.ENODEV: "no such CAN interface",
    errno.ENXIO: "no such CAN interface",
    errno.EAFNOSUPPORT: "the kernel has no SocketCAN",
}


class CanPortError(Exception):
    """The interface failed or does not open: close the port, wait, open another. The text says why."""


class CanPort(Protocol):
    """An interface that is open: the small contract that the link's reconnecting is built on."""

    async def receive(self) -> FrameBlock:
        """The next frames, at least one, error frames among them; CanPortError if the interface failed."""
        ...

    def send(self, frame: CanFrame) -> None:
        """Hand a frame to the interface; CanPortError if it does not take it."""
        ...

    def close(self) -> None:
        """Give the interface up. Never raises."""
        ...


@contextmanager
def port_errors() -> Iterator[None]:
    """Everything that an interface may raise becomes a CanPortError that says why."""
    try:
        yield
    except (OSError, can.CanError) as error:
        code = error.errno if isinstance(error, OSError) else error.error_code
        raise CanPortError(_REASONS.get(code or 0) or getattr(error, "strerror", None) or str(error)) from error


class PollingPort:
    """Any bus of python-can, asked for frames every few milliseconds: there is no thread that could die.

    Args:
        bus: owned by the port from now on.
        clock: stamps the frames.
        counters: gets "remote frame" and "malformed frame".
    """

    def __init__(self, bus: can.BusABC, clock: Clock, counters: Counter[str]) -> None:
        self._bus = bus
        self._clock = clock
        self._counters = counters

    async def receive(self) -> FrameBlock:
        """See CanPort."""
        while not (frames := self._drain()):  # noqa: ASYNC110  python-can has nothing to wait on
            await asyncio.sleep(POLL_S)
        return FrameBlock.of(frames)

    def _drain(self) -> list[CanFrame]:
        frames: list[CanFrame] = []
        with port_errors():
            while len(frames) < BATCH_MAX and (message := self._bus.recv(timeout=0.0)) is not None:
                frame = self._frame(message)
                if frame is not None:
                    frames.append(frame)
        return frames

    def _frame(self, message: can.Message) -> CanFrame | None:
        if message.is_remote_frame:
            self._counters["remote frame"] += 1
            return None
        try:
            return CanFrame(
                self._clock.stamp(message.timestamp),
                message.arbitration_id,
                bytes(message.data),
                extended=message.is_extended_id,
                fd=message.is_fd,
                error=message.is_error_frame,
            )
        except ValueError:  # an adapter on a serial line may garble frames
            self._counters["malformed frame"] += 1
            return None

    def send(self, frame: CanFrame) -> None:
        """See CanPort."""
        message = can.Message(
            arbitration_id=frame.identifier,
            is_extended_id=frame.extended,
            is_fd=frame.fd,
            is_error_frame=frame.error,
            data=frame.data,
        )
        with port_errors():
            self._bus.send(message)

    def close(self) -> None:
        """See CanPort."""
        self._bus.shutdown()

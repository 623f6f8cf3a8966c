"""A MAVLink link that keeps itself alive: opens, listens, sends, and opens again when it was lost."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable

from drivers.clock import Clock
from drivers.mavlink.endpoint import parse_endpoint
from drivers.mavlink.transports import Connect, Transport, open_transport
from drivers.readings import LinkState

# Everything that speaks MAVLink beats once a second; conventions call it lost after four to five.
SILENCE_S = 5.0
WATCH_S = 1.0
RETRY_FIRST_S = 0.25
RETRY_MAX_S = 5.0


class MavlinkLink:
    """One link to a vehicle.

    The link is *up* while bytes arrive: a UDP socket without a sender and a serial port without a vehicle open just
    as well.

    Args:
        name: the link's name in the configuration.
        endpoint: `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT` or `serial:DEVICE:BAUD`.
        clock: stamps what is received.
        connect: opens the endpoint.

    Attributes:
        unsent: messages that could not be sent, counted by cause.
        received_bytes, sent_bytes: since the start.

    Raises:
        ValueError: the endpoint cannot be read.
    """

    def __init__(self, name: str, endpoint: str, clock: Clock, connect: Connect = open_transport) -> None:
        self.name = name
        self.endpoint = parse_endpoint(endpoint)
        self.unsent: Counter[str] = Counter()
        self.received_bytes = 0
        self.sent_bytes = 0
        self._text = endpoint
        self._clock = clock
        self._connect = connect
        self._transport: Transport | None = None
        self._up: bool | None = None  # None: nothing was reported yet
        self._heard_s = 0.0

    async def run(self, on_bytes: Callable[[bytes, float], None], on_state: Callable[[LinkState], None]) -> None:
        """Keep the link open until cancelled.

        Args:
            on_bytes: called from the event loop with what was received, and its time on the clock.
            on_state: called when the link goes up or down, and once at the start.

        Raises:
            Exception: what a callback raised.
        """
        retry_s = RETRY_FIRST_S
        self._up = None
        while True:
            heard_before = self.received_bytes
            reason = await self._session(on_bytes, on_state)
            self._report(False, reason, on_state)
            if self.received_bytes > heard_before:
                retry_s = RETRY_FIRST_S
            await asyncio.sleep(retry_s)
            retry_s = min(2.0 * retry_s, RETRY_MAX_S)

    def send(self, data: bytes) -> None:
        """Send without waiting; what cannot go out is dropped and counted in `unsent`."""
        if self._transport is None:
            self.unsent["not connected"] += 1
            return
        self.sent_bytes += len(data)
        self._transport.send(data)

    async def _session(self, on_bytes: Callable[[bytes, float], None], on_state: Callable[[LinkState], None]) -> str:
        """From opening to losing the connection; returns why it ended."""
        lost: asyncio.Future[str] = asyncio.get_running_loop().create_future()

        def receive(data: bytes) -> None:
            try:
                self._heard_s = self._clock.now()
                self.received_bytes += len(data)
                self._report(True, "", on_state)
                on_bytes(data, self._heard_s)
            except Exception as error:  # the caller's: it must end `run`, where asyncio would only log it
                if not lost.done():
                    lost.set_exception(error)

        def lose(reason: str) -> None:
            if not lost.done():
                lost.set_result(reason)

        try:
            self._transport = await self._connect(self.endpoint, receive, lose, self.unsent)
        except OSError as error:
            return f"cannot open {self._text}: {error or 'no answer'}"
        try:
            return await self._watch(lost, on_state)
        finally:
            self._transport.close()
            self._transport = None

    async def _watch(self, lost: asyncio.Future[str], on_state: Callable[[LinkState], None]) -> str:
        """Report silence while the connection lasts; returns why it ended."""
        if self._up is None:
            self._report(False, "nothing received yet", on_state)
        while not lost.done():
            await asyncio.wait([lost], timeout=WATCH_S)
            silent_s = self._clock.now() - self._heard_s
            if self._up and silent_s > SILENCE_S:
                self._report(False, f"silent for {silent_s:.0f} s", on_state)
        return lost.result()

    def _report(self, up: bool, detail: str, on_state: Callable[[LinkState], None]) -> None:
        if up != self._up:
            self._up = up
            on_state(LinkState(self._clock.now(), self.name, up, detail))

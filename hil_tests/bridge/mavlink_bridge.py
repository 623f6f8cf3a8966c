"""MAVLink between two endpoints, both ways, through a wire: UDP, TCP or a serial line at either end.

Whatever comes at once at one end (a datagram, or some bytes of a stream) goes through the wire and out at the other.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from functools import partial
from math import inf
from typing import Self

from drivers.clock import Clock
from drivers.mavlink.link import MavlinkLink
from drivers.readings import LinkState
from hil_tests.bridge.bus_end import OnState, unheard
from hil_tests.bridge.figures import BridgeFigures, TransitTimes, WayFigures, counted
from hil_tests.wires.way import Towards, Wire

OPEN_S, JOIN_S = 6.0, 5.0

OnBytes = Callable[[bytes, float], None]


class MavlinkBridge:
    """See the module's text. It has a thread of its own, with an event loop of its own.

    Args:
        autopilot: endpoint at which the autopilot is: `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT` or
            `serial:DEVICE:BAUD`.
        gateway: the one at which the gateway is, and all others who listen.
        wire: what lies between them; asked from the bridge's thread only.
        clock: tells the time.
        on_state: gets the state of an endpoint whenever it changes; called from the bridge's thread.
        hear: gets what the autopilot's side says, as it has come, with its time; called from there, too.

    Raises:
        ValueError: an endpoint cannot be read, or both are the same.
    """

    def __init__(
        self,
        autopilot: str,
        gateway: str,
        wire: Wire[bytes],
        clock: Clock,
        on_state: OnState = unheard,
        hear: OnBytes | None = None,
    ) -> None:
        if autopilot == gateway:
            raise ValueError(f"a bridge must have two endpoints, got {autopilot} twice")
        self._links = {
            Towards.AUTOPILOT: MavlinkLink(autopilot, autopilot, clock),
            Towards.GATEWAY: MavlinkLink(gateway, gateway, clock),
        }
        self._received, self._sent = dict.fromkeys(self._links, 0), dict.fromkeys(self._links, 0)
        self._transit = {towards: TransitTimes() for towards in self._links}
        self._away = {link.name: 0 for link in self._links.values()}
        self._states: dict[str, LinkState] = {}
        self._wire, self._clock, self._on_state, self._hear = wire, clock, on_state, hear
        self._opened = threading.Event()
        self._over: asyncio.Future[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._guarded, name="MAVLink bridge", daemon=True)

    def __enter__(self) -> Self:
        """Starts."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stops."""
        self.stop()

    def start(self) -> None:
        """Open both endpoints, and begin. One that is lost later is opened again and again.

        Raises:
            OSError: one of them does not open.
        """
        self._thread.start()
        self._opened.wait(OPEN_S)
        for link in self._links.values():
            state = self._states.get(link.name)
            if state is None or state.detail.startswith("cannot open"):
                self.stop()
                raise OSError("no answer" if state is None else state.detail)

    def stop(self) -> None:
        """End it; both endpoints are closed then. Another stop does nothing.

        Raises:
            Exception: what the wire raised, which had ended the bridge.
        """
        over = self._over
        if self._thread.is_alive() and over is not None:
            over.get_loop().call_soon_threadsafe(self._end, None)
            self._thread.join(JOIN_S)
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    @property
    def running(self) -> bool:
        """Whether packets pass; False before the start, after the stop, and when the wire has failed."""
        return self._thread.is_alive()

    def figures(self) -> BridgeFigures:
        """What has passed so far; may be asked at any time."""
        autopilot, gateway = self._links[Towards.AUTOPILOT].name, self._links[Towards.GATEWAY].name
        return BridgeFigures(
            ways={
                f"{autopilot} to {gateway}": self._way(Towards.GATEWAY),
                f"{gateway} to {autopilot}": self._way(Towards.AUTOPILOT),
            },
            changed=counted(self._wire.counts),
            away=dict(self._away),
        )

    def _way(self, towards: Towards) -> WayFigures:
        return WayFigures(
            received=self._received[towards],
            sent=self._sent[towards],
            dropped=counted(self._links[towards].unsent),
            transit=self._transit[towards].figures(),
        )

    def _guarded(self) -> None:
        try:
            asyncio.run(self._run())
        except BaseException as failure:  # told by `stop`, in the caller's thread
            self._failure = failure
        finally:
            self._opened.set()

    async def _run(self) -> None:
        self._over = asyncio.get_running_loop().create_future()
        listening = [
            asyncio.create_task(link.run(partial(self._take, towards=_opposite(towards)), self._note))
            for towards, link in self._links.items()
        ]
        try:
            done, _ = await asyncio.wait([self._over, *listening], return_when=asyncio.FIRST_COMPLETED)
            for one in done:
                one.result()
        finally:
            if self._timer is not None:
                self._timer.cancel()
            for task in listening:
                task.cancel()
            await asyncio.gather(*listening, return_exceptions=True)

    def _end(self, failure: Exception | None) -> None:
        if self._over is None or self._over.done():
            return
        if failure is None:
            self._over.set_result(None)
        else:
            self._over.set_exception(failure)

    def _note(self, state: LinkState) -> None:
        self._away[state.link] += not state.up and self._states.get(state.link, state).up
        self._states[state.link] = state
        if len(self._states) == len(self._links):
            self._opened.set()
        self._on_state(state)

    def _take(self, data: bytes, time_s: float, towards: Towards) -> None:
        """Something has come at one end; what the wire raises ends the link's `run`, and so the bridge."""
        if towards is Towards.GATEWAY and self._hear is not None:
            self._hear(data, time_s)
        self._received[towards] += 1
        self._wire.put(self._clock.now(), data, towards)
        self._deliver(data, time_s)

    def _deliver(self, fresh: bytes | None = None, time_s: float = 0.0) -> None:
        """Sends what is due.

        Args:
            fresh: has just come; what no fault has held counts for the time that it took.
            time_s: when.
        """
        for passed in self._wire.due(self._clock.now()):
            self._links[passed.towards].send(passed.item)
            self._sent[passed.towards] += 1
            if passed.item is fresh:
                self._transit[passed.towards].add(self._clock.now() - time_s)
        self._set_timer()

    def _set_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        next_s = self._wire.next_s()
        if next_s < inf:
            wait_s = max(0.0, next_s - self._clock.now())
            self._timer = asyncio.get_running_loop().call_later(wait_s, self._deliver_or_end)

    def _deliver_or_end(self) -> None:
        try:
            self._deliver()
        except Exception as failure:  # in a callback, the event loop would only log it
            self._end(failure)


def _opposite(towards: Towards) -> Towards:
    return Towards.GATEWAY if towards is Towards.AUTOPILOT else Towards.AUTOPILOT

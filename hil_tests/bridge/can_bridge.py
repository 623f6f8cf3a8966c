"""Frames between two CAN buses, both ways, through a wire: in a thread that does nothing else.

It is told of each frame by the kernel and hands it on at once; nothing is gathered, no event loop lies in between.
"""

from __future__ import annotations

import select
import socket
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import inf
from types import MappingProxyType
from typing import Self

from drivers.can.frame import CanFrame
from drivers.can.interface import SOCKETCAN
from drivers.can.port import CanPortError
from drivers.clock import Clock
from hil_tests.bridge.bus_end import BusEnd, OnState, unheard
from hil_tests.bridge.figures import BridgeFigures, WayFigures, counted
from hil_tests.bridge.holding import held
from hil_tests.bridge.network_kind import bus_of, listens_only
from hil_tests.bridge.raw_port import socketcan
from hil_tests.wires.way import Towards, Wire

# whoever waits for the end of the thread waits for the frames of one look at the buses
JOIN_S = 5.0
# so that the wait has an end that `select` knows
LONGEST_WAIT_S = 60.0


class CanBridge:
    """See the module's text.

    Between `start` (or `with`) and `stop`, every frame that comes in at one end goes through the wire and out at the
    other, in the order in which the wire gives them: standard and extended frames, CAN FD with its flags, and remote
    frames. Error frames are no frames of the bus: what they say is counted and reported. An end that is lost is
    opened again and again; what would go out there meanwhile is dropped, and counted.

    Args:
        autopilot: the bus with the autopilot, where the gateway listens.
        devices: the bus with the ESCs.
        wire: what lies between them; asked from the bridge's thread only.
        clock: tells the time; that of `autopilot` and `devices`.

    Raises:
        ValueError: both ends are the same bus.
    """

    def __init__(self, autopilot: BusEnd, devices: BusEnd, wire: Wire[CanFrame], clock: Clock) -> None:
        if autopilot.name == devices.name:
            raise ValueError(f"a bridge must have two buses, got {autopilot.name} twice")
        self._wire, self._clock = wire, clock
        self._ends: Mapping[Towards, BusEnd] = MappingProxyType(
            {Towards.AUTOPILOT: autopilot, Towards.DEVICES: devices}
        )
        self._from = {autopilot: Towards.DEVICES, devices: Towards.AUTOPILOT}
        self._waking, self._wake = socket.socketpair()
        self._waking_number = self._waking.fileno()
        self._over = False
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._guarded, name="CAN bridge", daemon=True)

    def __enter__(self) -> Self:
        """Starts."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stops."""
        self.stop()

    def start(self) -> None:
        """Open both buses, and begin.

        Raises:
            CanPortError: one of them does not open; the text says how to mend that.
        """
        try:
            for end in self._ends.values():
                end.open()
        except BaseException:
            self._close()
            self.stop()
            raise
        self._thread.start()

    def stop(self) -> None:
        """End it; both buses are closed then. Another stop does nothing.

        Raises:
            Exception: what the wire raised, which had ended the bridge.
        """
        self._over = True
        if self._thread.is_alive():
            self._wake.send(b"\0")
            self._thread.join(JOIN_S)
        if not self._thread.is_alive():
            self._wake.close()
            self._waking.close()
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    @property
    def running(self) -> bool:
        """Whether frames pass; False before the start, after the stop, and when the wire has failed."""
        return self._thread.is_alive()

    def figures(self) -> BridgeFigures:
        """What has passed so far; may be asked at any time."""
        autopilot, devices = self._ends[Towards.AUTOPILOT], self._ends[Towards.DEVICES]
        return BridgeFigures(
            ways=dict(_way(source, target) for source, target in ((autopilot, devices), (devices, autopilot))),
            changed=counted(self._wire.counts),
            away={end.name: end.away for end in (autopilot, devices)},
        )

    def _guarded(self) -> None:
        try:
            while not self._over:
                self._step()
        except BaseException as failure:  # told by `stop`, in the caller's thread
            self._failure = failure
        finally:
            self._close()

    def _step(self) -> None:
        """Wait for something to do, and do it."""
        there = [(end.port.fileno(), end) for end in self._from if end.port is not None]
        ready, _, _ = select.select([self._waking_number, *(number for number, _ in there)], [], [], self._wait_s())
        for number, end in there:
            if number in ready:
                self._carry(end)
        now_s = self._clock.now()
        if self._wire.next_s() <= now_s:
            self._deliver(now_s, ())
        for end in self._from:
            if end.next_s <= now_s:
                end.act()

    def _wait_s(self) -> float:
        next_s = self._wire.next_s()
        for end in self._from:
            next_s = min(next_s, end.next_s)
        return LONGEST_WAIT_S if next_s == inf else min(LONGEST_WAIT_S, max(0.0, next_s - self._clock.now()))

    def _carry(self, end: BusEnd) -> None:
        """What has come at one end."""
        frames, towards, now_s = end.read(), self._from[end], self._clock.now()
        for frame in frames:
            self._wire.put(now_s, frame, towards)
        self._deliver(now_s, frames)

    def _deliver(self, now_s: float, fresh: Sequence[CanFrame]) -> None:
        """Sends what is due; what of the fresh frames no fault has held counts for the time that they take."""
        prompt = frozenset(map(id, fresh))
        for passed in self._wire.due(now_s):
            self._ends[passed.towards].put(passed.item, id(passed.item) in prompt)

    def _close(self) -> None:
        for end in self._from:
            end.close()


def _way(source: BusEnd, target: BusEnd) -> tuple[str, WayFigures]:
    return f"{source.name} to {target.name}", WayFigures(
        received=source.received,
        sent=target.sent,
        dropped=counted(source.lost) | counted(target.dropped),
        transit=target.transit.figures(),
    )


def _end(name: str, clock: Clock, on_state: OnState) -> BusEnd:
    if listens_only(name):
        remedy = f"sudo ip link set {name} down; sudo ip link set {name} up type can listen-only off"
        raise CanPortError(f"{name} is set up to listen only, and would send nothing: {remedy}")
    return BusEnd(name, socketcan(name), clock, on_state, virtual=bus_of(SOCKETCAN, name).virtual)


@contextmanager
def bridged(
    autopilot: str, devices: str, wire: Wire[CanFrame], clock: Clock, on_state: OnState = unheard
) -> Iterator[CanBridge]:
    """A bridge between two interfaces of SocketCAN, that no other bridge of this machine has.

    Args:
        autopilot, devices: names of the interfaces, as "can0".
        wire, clock: as of CanBridge.
        on_state: gets the state of an end whenever it changes; called from the bridge's thread.

    Raises:
        CanPortError: an interface does not open, only listens, or is that of another bridge.
        ValueError: both are the same.
    """
    near, far = (_end(name, clock, on_state) for name in (autopilot, devices))
    with held(autopilot, devices), CanBridge(near, far, wire, clock) as bridge:
        yield bridge

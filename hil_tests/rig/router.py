"""A UDP router between simulated vehicle, gateway and ground station, with lines as bad as a test wants them.

It does what mavlink-router and BlueOS's endpoints do: what comes in at one endpoint goes out at all others, whoever
it is for. It reads no MAVLink.
"""

from __future__ import annotations

import select
import socket
import threading
from collections.abc import Callable
from types import TracebackType

from hil_tests.rig.link_conditions import IDEAL, Line, LinkConditions

HOST = "127.0.0.1"
# between two looks at what is under way and whether to stop
POLL_S = 0.005
DATAGRAM_MAX = 65_535


class Endpoint:
    """One door of a router, with a line in and a line out.

    Args:
        remote: to whom it speaks; None: it listens, and speaks to whoever spoke last.
        conditions: of both directions.
        seed: of both lines.

    Attributes:
        inward, outward: the lines, as seen from the router.
    """

    def __init__(
        self, remote: tuple[str, int] | None = None, conditions: LinkConditions = IDEAL, seed: int = 0
    ) -> None:
        self.link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.link.bind((HOST, 0))
        self.link.setblocking(False)
        self._remote = remote
        self._learns = remote is None
        self.inward = Line[bytes](conditions, 2 * seed)
        self.outward = Line[bytes](conditions, 2 * seed + 1)

    @property
    def port(self) -> int:
        """Where it can be reached."""
        return int(self.link.getsockname()[1])

    def cut(self, from_s: float) -> None:
        """Nothing goes either way from then on."""
        self.inward.cut(from_s)
        self.outward.cut(from_s)

    def mend(self) -> None:
        """All goes again."""
        self.inward.mend()
        self.outward.mend()

    def receive(self, time_s: float) -> None:
        """Put all that came in on its line."""
        while True:
            try:
                datagram, sender = self.link.recvfrom(DATAGRAM_MAX)
            except (BlockingIOError, ConnectionRefusedError):
                return
            if self._learns:
                self._remote = sender
            self.inward.put(time_s, datagram)

    def deliver(self, time_s: float) -> None:
        """Send off what has come to the end of its line."""
        for datagram in self.outward.due(time_s):
            if self._remote is None:
                continue  # nobody is there yet
            try:
                self.link.sendto(datagram, self._remote)
            except (BlockingIOError, ConnectionRefusedError):
                self.outward.counts["nobody there"] += 1


class UdpRouter:
    """Runs in a thread of its own between `with ...:` and its end.

    Args:
        endpoints: its doors.
        now: clock, in seconds, of cuts too.
        echo: what comes in at a door goes out there as well, as where two routers are wired in a circle.

    Raises:
        RuntimeError: at the end of `with`, where the thread had ended before by an error.
    """

    def __init__(self, endpoints: list[Endpoint], now: Callable[[], float], echo: bool = False) -> None:
        self._endpoints = endpoints
        self._now = now
        self._echo = echo
        self._error: Exception | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="udp router", daemon=True)

    def __enter__(self) -> UdpRouter:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._thread.join()
        for endpoint in self._endpoints:
            endpoint.link.close()
        if self._error is not None and error is None:
            raise RuntimeError("the router stopped by itself") from self._error

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                select.select([endpoint.link for endpoint in self._endpoints], [], [], POLL_S)
                self._turn(self._now())
        except Exception as error:  # __exit__ raises it, in the thread that can handle it
            self._error = error

    def _turn(self, time_s: float) -> None:
        for endpoint in self._endpoints:
            endpoint.receive(time_s)
        for source in self._endpoints:
            for datagram in source.inward.due(time_s):
                for target in self._endpoints:
                    if target is not source or self._echo:
                        target.outward.put(time_s, datagram)
        for endpoint in self._endpoints:
            endpoint.deliver(time_s)

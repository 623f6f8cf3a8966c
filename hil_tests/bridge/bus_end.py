"""One bus of a bridge: open whenever it can be, with a queue for what it does not take at once."""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Callable
from math import inf

from drivers.can.bus_state import BusState
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.port import CanPortError
from drivers.clock import Clock
from drivers.readings import LinkState
from hil_tests.bridge.figures import TransitTimes
from hil_tests.bridge.raw_port import BridgePort, OpenPort, Sending

log = logging.getLogger("gateway")

# An old command is worse than none: what a bus has not taken after so long is dropped. In a tenth of a second, a full
# bus at 1 Mbit/s carries 750 frames.
KEEP_S = 0.1
QUEUE_MAX = 1000
# the queue of an interface has 10 frames, and takes a millisecond to carry them
RETRY_S = 0.0005
REOPEN_FIRST_S, REOPEN_MAX_S = 0.1, 2.0

QUEUE_FULL, TOO_LATE, REFUSED = "queue full", "not taken in time", "refused by the interface"
NOT_VIRTUAL = "error frame that only a virtual bus can have"

OnState = Callable[[LinkState], None]


def unheard(_state: LinkState) -> None:
    """For those who do not want to know."""


class BusEnd:
    """See the module's text.

    Args:
        name: of the bus.
        open_port: how it is opened, as often as needed.
        clock: tells the time.
        virtual: a fault may put error frames onto it, for all to hear. A real controller would send them as data.
        on_state: gets the state whenever it changes.

    Attributes:
        received, sent: frames.
        lost: of those that came from the bus, what could not be read, by cause.
        dropped: of those that were for the bus, what it never got, by cause.
        errors: of the bus, by what error frames said.
        away: how often the interface was lost.
        transit: of frames that no fault has held.
    """

    def __init__(
        self, name: str, open_port: OpenPort, clock: Clock, on_state: OnState = unheard, *, virtual: bool = False
    ) -> None:
        self.name = name
        self.received = self.sent = self.away = 0
        self.lost: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()
        self.errors: Counter[str] = Counter()
        self.transit = TransitTimes()
        self.port: BridgePort | None = None
        self._open_port, self._clock, self._on_state, self._virtual = open_port, clock, on_state, virtual
        self._state = BusState(self.errors)
        self._up = False
        self._waiting: deque[tuple[float, CanFrame, bool]] = deque()
        self._act_s = inf
        self._reopen_s = REOPEN_FIRST_S

    def open(self) -> None:
        """Open the bus for the first time.

        Raises:
            CanPortError: it does not open; the text says how to mend that.
        """
        try:
            self._open()
        except CanPortError as error:
            remedy = f"bring it up: sudo ip link set {self.name} up type can bitrate 1000000 restart-ms 100"
            raise CanPortError(f"{self.name} does not open: {error}; {remedy}") from error

    def close(self) -> None:
        """Give the bus up; what waits for it is dropped."""
        if self.port is not None:
            self.port.close()
            self.port = None
        self.dropped[self._gone] += len(self._waiting)
        self._waiting.clear()

    @property
    def next_s(self) -> float:
        """When `act` has something to do; infinity: never."""
        return self._act_s

    def act(self) -> None:
        """What is due: send what waits, or open the bus again."""
        now_s = self._clock.now()
        if now_s < self._act_s:
            return
        self._act_s = inf
        if self.port is None:
            self._open_again(now_s)
        else:
            self._send_waiting(now_s)

    def read(self) -> list[CanFrame]:
        """Data and remote frames that have come; nothing where the bus is lost, which is noted."""
        frames: list[CanFrame] = []
        failure = None
        try:
            if self.port is not None:
                self.port.read(frames)
        except CanPortError as error:
            failure = error
        if frames and (not self._up or any(frame.error for frame in frames)):
            frames = self._told(frames)
        if failure is not None:
            self._lose(str(failure))
        self.received += len(frames)
        return frames

    def put(self, frame: CanFrame, prompt: bool) -> None:
        """Take a frame for the bus.

        Args:
            frame: of any kind.
            prompt: no fault has held it: how long it took counts.
        """
        if frame.error and not self._virtual:
            self.dropped[NOT_VIRTUAL] += 1
        elif self._waiting or not self._sent(frame, prompt):
            self._queue(frame, prompt)

    @property
    def _gone(self) -> str:
        return f"{self.name} is away"

    def _queue(self, frame: CanFrame, prompt: bool) -> None:
        if self.port is None:
            self.dropped[self._gone] += 1
        elif len(self._waiting) >= QUEUE_MAX:
            self.dropped[QUEUE_FULL] += 1
        else:
            now_s = self._clock.now()
            self._waiting.append((now_s + KEEP_S, frame, prompt))
            self._act_s = min(self._act_s, now_s + RETRY_S)

    def _send_waiting(self, now_s: float) -> None:
        """In their order, until the bus takes no more."""
        while self._waiting:
            until_s, frame, prompt = self._waiting[0]
            if until_s < now_s:
                self.dropped[TOO_LATE] += 1
            elif not self._sent(frame, prompt):
                self._act_s = min(self._act_s, now_s + RETRY_S)  # sooner: the bus was lost, and is to be opened
                return
            self._waiting.popleft()

    def _sent(self, frame: CanFrame, prompt: bool) -> bool:
        """Whether the bus is done with it; False: it has to wait, or the bus is lost."""
        if self.port is None:
            return False
        try:
            outcome = self.port.send(frame)
        except CanPortError as error:
            self._lose(str(error))
            return False
        if outcome is Sending.REFUSED:
            self.dropped[REFUSED] += 1
        elif outcome is Sending.DONE:
            self.sent += 1
            if prompt:
                self.transit.add(self._clock.now() - frame.time_s)
        return outcome is not Sending.FULL

    def _open(self) -> None:
        self.port = self._open_port(self._clock, self.lost)
        self._reopen_s = REOPEN_FIRST_S
        self._report(True, "")

    def _open_again(self, now_s: float) -> None:
        try:
            self._open()
        except CanPortError:
            self._act_s = now_s + self._reopen_s
            self._reopen_s = min(2.0 * self._reopen_s, REOPEN_MAX_S)

    def _lose(self, reason: str) -> None:
        self.away += 1
        self.close()
        self._act_s = self._clock.now() + self._reopen_s
        self._report(False, reason)

    def _told(self, frames: list[CanFrame]) -> list[CanFrame]:
        """The frames without what the controller says of the bus, which is counted and reported."""
        for change in self._state.changes(FrameBlock.of(frames)):
            self._say(change.up, change.detail)
        return [frame for frame in frames if not frame.error]

    def _report(self, up: bool, detail: str) -> None:
        if self._state.becomes(up, detail):
            self._say(up, detail)

    def _say(self, up: bool, detail: str) -> None:
        self._up = up
        if up and not detail:
            log.info("bridge: %s is up", self.name)
        else:
            log.warning("bridge: %s is %s: %s", self.name, "up" if up else "down", detail)
        self._on_state(LinkState(self._clock.now(), self.name, up, detail))

"""Whether an autopilot is armed, as its HEARTBEAT tells it: before a play, and all the time while it goes on."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterator

from drivers.clock import Clock
from drivers.mavlink.autopilot import AUTOPILOT_INVALID, HEARTBEAT_LOST_S
from drivers.mavlink.endpoint import parse_endpoint
from drivers.mavlink.transports import Transport, open_transport
from drivers.readings import AutopilotHeartbeat
from gateway.checking.survey import MavlinkSurvey, Sender
from hil_tests.bridge.permission import Granted, HeardAutopilot

# heartbeats come once a second, and one may be lost
LISTEN_S = 3.0
OPEN_S = 3.0


class ArmedWatch:
    """What the autopilots on a link say of themselves. Pure: it is told the time.

    No signature is asked for: a forged heartbeat can stop a play, and do no more.

    Args:
        begun_s: silence counts from then on.
    """

    def __init__(self, begun_s: float) -> None:
        self._begun_s = begun_s
        self._survey = MavlinkSurvey(None)

    def feed(self, data: bytes, time_s: float) -> None:
        """Takes what was received, cut anywhere."""
        self._survey.feed(data, time_s)

    def heard(self) -> tuple[HeardAutopilot, ...]:
        """All autopilots so far, by their newest HEARTBEAT, in the order of their ids."""
        return tuple(HeardAutopilot(_name(sender), beat.armed) for sender, beat in self._autopilots())

    def stop_reason(self, time_s: float, granted: Granted) -> str:
        """Why a play that touches something real must stop now; "": it may go on.

        Args:
            time_s: now.
            granted: what the user has said when it began.
        """
        if granted.while_armed:
            return ""
        armed = [one.name for one in self.heard() if one.armed]
        if armed:
            return f"{armed[0]} has become armed: stopped, for --while-armed was not said"
        if granted.no_autopilot:
            return ""
        silent = self._silent(time_s)
        return f"{silent}, and may be armed: stopped; mend the link, or say --while-armed" if silent else ""

    def _silent(self, time_s: float) -> str:
        """Who was not heard for too long."""
        spoken = {_name(sender): max(beat.time_s, self._begun_s) for sender, beat in self._autopilots()}
        for name, last_s in (spoken or {"the autopilot": self._begun_s}).items():
            if time_s - last_s > HEARTBEAT_LOST_S:
                return f"{name} has been silent for {HEARTBEAT_LOST_S:g} s"
        return ""

    def _autopilots(self) -> Iterator[tuple[Sender, AutopilotHeartbeat]]:
        for _, sender in sorted(self._survey.senders.items()):
            beat = sender.heartbeat
            if beat is not None and beat.autopilot != AUTOPILOT_INVALID:
                yield sender, beat


def _name(sender: Sender) -> str:
    return sender.name() if sender.autopilot else f"autopilot (component {sender.component_id} of {sender.system_id})"


async def listen(endpoint: str, clock: Clock, listen_s: float = LISTEN_S) -> ArmedWatch:
    """Listens to a link. Nothing is sent.

    Args:
        endpoint: as in the gateway's configuration.
        clock: stamps what is received.
        listen_s: for so long.

    Raises:
        OSError: it does not open, or is lost.
        ValueError: the endpoint cannot be read.
    """
    watch, lost = ArmedWatch(clock.now()), asyncio.Event()
    transport = await _opened(endpoint, watch, clock, lost)
    try:
        async with asyncio.timeout(listen_s):
            await lost.wait()
        raise OSError(f"{endpoint} opens, and is lost at once")
    except TimeoutError:
        return watch
    finally:
        transport.close()


async def _opened(endpoint: str, watch: ArmedWatch, clock: Clock, lost: asyncio.Event) -> Transport:
    try:
        async with asyncio.timeout(OPEN_S):
            return await open_transport(
                parse_endpoint(endpoint),
                lambda data: watch.feed(data, clock.now()),
                lambda _reason: lost.set(),
                Counter(),
            )
    except OSError as error:
        raise OSError(f"{endpoint} does not open: {error or 'no answer'}") from error

"""The gateway as an onboard computer on the vehicle's MAVLink network: it listens, asks for streams, and speaks."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

from drivers.clock import Clock
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.messages import OutgoingMessage
from drivers.mavlink.streams import StreamRequests
from drivers.readings import AutopilotConflict, AutopilotHeartbeat, LinkState, Reading
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.supervision.autopilots import kind_of
from gateway.wiring import mavlink_decoder, navigation_streams

log = logging.getLogger("gateway")


class Companion:
    """The link to the autopilot, with what is said on it.

    It speaks with the vehicle's own system id: the configured one, or that of the one autopilot that it hears. Before
    it knows that, and while several autopilots are heard, it is silent.

    Args:
        config: with a `mavlink` table.
        clock: stamps what is received.
        take: gets the readings.

    Attributes:
        received: readings so far.

    Raises:
        ValueError: the configuration has no `mavlink` table.
    """

    def __init__(self, config: Config, clock: Clock, take: Callable[[str, Sequence[Reading]], None]) -> None:
        if config.mavlink is None:
            raise ValueError("mavlink: missing, a companion needs the link to its autopilot")
        self._settings = config.mavlink
        self._link = MavlinkLink(MAVLINK, config.mavlink.endpoint, clock)
        self._decoder = mavlink_decoder(config.mavlink, config.thruster, navigation=config.navigation is not None)
        self._requests = StreamRequests(also=partial(navigation_streams, config.navigation))
        self._settled = False
        self._encoders: dict[int, MavlinkEncoder] = {}
        self._unsent: Counter[str] = Counter()
        self._take = take
        self.received = 0

    async def run(self, on_state: Callable[[LinkState], None]) -> None:
        """Keeps the link alive until it is cancelled."""
        await self._link.run(self._on_bytes, on_state)

    def on_state(self, state: LinkState) -> None:
        """The state of some link: of our own, requests for streams begin anew when it is back."""
        if state.link == MAVLINK:
            self._ask([state], state.time_s)

    def advance(self, time_s: float) -> None:
        """Repeats requests that are due."""
        self._ask([], time_s)

    def send(self, message: OutgoingMessage) -> None:
        """Sends without waiting; where that cannot be, it is counted."""
        system = self._decoder.autopilot_system
        if system is None:
            self._unsent["not sent: no autopilot heard"] += 1
            return
        encoder = self._encoders.get(system)
        if encoder is None:
            encoder = self._encoders[system] = MavlinkEncoder(system, self._settings.component_id)
        self._link.send(encoder.encode(message))

    def drops(self) -> Counter[str]:
        """What was thrown away or not sent, by cause."""
        return (
            self._decoder.drops + self._unsent + Counter({f"not sent: {k}": n for k, n in self._link.unsent.items()})
        )

    def _on_bytes(self, data: bytes, time_s: float) -> None:
        known = self._decoder.autopilot_system if self.received else None
        readings = self._decoder.decode(data, time_s)
        self.received += len(readings)
        for reading in readings:
            self._log(reading, known)
        if readings:
            self._take(MAVLINK, readings)
            self._ask(readings, time_s)

    def _log(self, reading: Reading, known: int | None) -> None:
        if isinstance(reading, AutopilotHeartbeat) and reading.system_id != known:
            log.info("autopilot %s, system %d", kind_of(reading), reading.system_id)
        elif isinstance(reading, AutopilotConflict):
            systems = ", ".join(map(str, reading.system_ids))
            log.warning("several autopilots (systems %s): set mavlink.system_id; until then none is heard", systems)

    def _ask(self, readings: Sequence[Reading], time_s: float) -> None:
        for request in self._requests.update(readings, time_s):
            self.send(request)
        if self._requests.settled and not self._settled:
            self._tell_streams()
        self._settled = self._requests.settled

    def _tell_streams(self) -> None:
        requests = self._requests
        if not (requests.accepted or requests.refused):
            log.warning(
                "the autopilot answers no requests for streams; does it take commands from component %d?",
                self._settings.component_id,
            )
            return
        log.info(
            "streams: %d granted, %d refused, %d unanswered",
            len(requests.accepted),
            len(requests.refused),
            len(requests.unanswered),
        )

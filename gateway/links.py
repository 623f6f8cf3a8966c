"""All links of the vehicle: its CAN buses, and the one to its autopilot."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Coroutine, Iterator
from itertools import chain
from typing import Any

from drivers.clock import Clock
from drivers.mavlink.messages import OutgoingMessage
from drivers.mavlink.transports import Connect
from drivers.readings import LinkState
from gateway.can_source import CanSource, PortOf
from gateway.companion import Companion
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.intake import Intake
from gateway.telemetry_board import Counted

log = logging.getLogger("gateway")


class Links:
    """See the module's text.

    Args:
        config: which there are.
        clock: stamps what is received.
        intake: gets what they receive, and how they are.
        port_of: how a CAN bus is opened; None: as it is configured.
        connect: how the autopilot's link is opened.

    Attributes:
        send: says a message on the autopilot's link; None: there is none.
        unopened: names of those of which nothing is known yet.
    """

    def __init__(
        self, config: Config, clock: Clock, intake: Intake, port_of: PortOf | None, connect: Connect
    ) -> None:
        self._config, self._intake = config, intake
        self._buses = [
            CanSource(bus, config, clock, intake, port_of and port_of(bus)) for bus in config.can if not bus.forwarded
        ]
        self._companion = Companion(config, clock, intake, connect) if config.mavlink else None
        self.send: Callable[[OutgoingMessage], None] | None = (
            None if self._companion is None else self._companion.send
        )
        self.unopened = set(config.links())

    def tasks(self) -> Iterator[tuple[str, Coroutine[Any, Any, None]]]:
        """What keeps them alive, by name, until it is cancelled."""
        for bus in self._buses:
            yield f"link {bus.name}", bus.run(self._on_state)
            yield f"load {bus.name}", bus.watch_load()
        if self._companion is not None:
            yield "link mavlink", self._companion.run(self._on_state)

    def advance(self, time_s: float) -> None:
        """What is due now is said on the autopilot's link."""
        if self._companion is not None:
            self._companion.advance(time_s)

    def take_leave(self) -> None:
        """Before the end, see `Companion.take_leave`."""
        if self._companion is not None:
            self._companion.take_leave()

    def places(self) -> Iterator[str]:
        """Each with the place that it leads to."""
        yield from (f"{bus.name} ({bus.interface} {bus.channel})" for bus in self._config.can)
        if self._config.mavlink is not None:
            yield f"{MAVLINK} ({self._config.mavlink.endpoint})"

    def all(self) -> Iterator[Counted]:
        """Each with what it has counted: buses, then the autopilot's link."""
        companion = self._companion
        return chain(self._buses, *(() if companion is None else (companion.buses, (companion,))))

    def received(self) -> Counter[str]:
        """Frames so far, by link; of MAVLink: readings."""
        return Counter({link.name: link.received for link in self.all()})

    def drops(self) -> dict[str, Counter[str]]:
        """What was thrown away or not sent, by link and cause."""
        return {link.name: link.drops() for link in self.all()}

    def remarks(self) -> dict[str, str]:
        """What is worth saying beside the counts."""
        return {} if self._companion is None else self._companion.remarks()

    def _on_state(self, state: LinkState) -> None:
        word, detail = "up" if state.up else "down", f": {state.detail}" if state.detail else ""
        log.log(logging.INFO if state.up else logging.WARNING, "%s %s%s", state.link, word, detail)
        self.unopened.discard(state.link)
        self._intake.reading(state.link, state)
        if self._companion is not None:
            self._companion.on_state(state)

"""An autopilot on the other end of the gateway's MAVLink link, over UDP.

It is a client of the gateway's UDP server, as an ArduSub's router is of a companion's: it sends first, and answers
whoever sent last.
"""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Any

from drivers.can.frame import CanFrame
from hil_tests.rig.can_forwarder import CanForwarder
from hil_tests.rig.commander import Commander
from hil_tests.rig.conduct import Conduct
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.notes import Notes
from hil_tests.rig.telemetry import Telemetry


class AutopilotPeer:
    """A `MavlinkAutopilot` with a socket.

    Args:
        gateway: host and port that the gateway listens on.
        commander: whose modes and answers these are.
        system_id: of the vehicle.
        conduct, key, can_buses: as `MavlinkAutopilot` takes them.
    """

    def __init__(
        self,
        gateway: tuple[str, int],
        commander: Commander,
        system_id: int = 1,
        conduct: Conduct | None = None,
        key: bytes | None = None,
        can_buses: int = 0,
    ) -> None:
        self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._link.bind((gateway[0], 0))
        self._link.setblocking(False)
        self._address = gateway
        self._autopilot = MavlinkAutopilot(self._send, commander, system_id, conduct, key, can_buses)

    @property
    def notes(self) -> Notes:
        """All that came in."""
        return self._autopilot.notes

    @property
    def conduct(self) -> Conduct:
        """Where it does not do as it should; can be changed at any time."""
        return self._autopilot.conduct

    @property
    def forwarder(self) -> CanForwarder:
        """Of its CAN buses."""
        return self._autopilot.forwarder

    def close(self) -> None:
        """Close the socket."""
        self._link.close()

    def exchange(self, time_s: float, telemetry: Telemetry) -> None:
        """Take in and answer what has arrived by now, then send what is due, but for `SENSED`; never waits."""
        for datagram in self._arrived():
            self._autopilot.receive(time_s, datagram)
        self._autopilot.advance(time_s, telemetry)

    def sense(self, time_s: float, telemetry: Telemetry) -> None:
        """Send what of `SENSED` is due."""
        self._autopilot.sense(time_s, telemetry)

    def on_bus(self, time_s: float, bus: int, frame: CanFrame) -> None:
        """A frame is on one of its CAN buses, as `MavlinkAutopilot.on_bus`."""
        self._autopilot.on_bus(time_s, bus, frame)

    def restart(self, time_s: float, silent_s: float) -> None:
        """Start anew after a silence, as `MavlinkAutopilot.restart`."""
        self._autopilot.restart(time_s, silent_s)

    def relay(self, message: Any, component_id: int, system_id: int | None = None) -> None:
        """Send another component's message, as `MavlinkAutopilot.relay`."""
        self._autopilot.relay(message, component_id, system_id)

    def interval_s(self, message_id: int) -> float:
        """Seconds between two messages, as `MavlinkAutopilot.interval_s`."""
        return self._autopilot.interval_s(message_id)

    def _arrived(self) -> Iterator[bytes]:
        while True:
            try:
                datagram, self._address = self._link.recvfrom(4096)
            except (BlockingIOError, ConnectionRefusedError):
                return
            yield datagram

    def _send(self, datagram: bytes) -> None:
        try:
            self._link.sendto(datagram, self._address)
        except ConnectionRefusedError:
            return  # nobody listens yet: UDP's way of saying so, about an earlier datagram

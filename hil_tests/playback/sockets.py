"""A real CAN bus and a UDP link, as the vehicle's side of a play has them. Nothing here waits."""

from __future__ import annotations

import socket
from collections import Counter
from collections.abc import Sequence

from drivers.can.datagrams import DatagramReader
from drivers.can.frame import EXTENDED_MASK, CanFilter, CanFrame
from drivers.can.packets import CONTROL_BYTES, FD_BYTES, SO_TIMESTAMPNS, frames_in, packed, stamps_of
from drivers.can.port import port_errors
from drivers.can.socketcan import open_socket
from drivers.clock import Clock
from hil_tests.bridge.transmission import TransmitGate

HOST = "127.0.0.1"
BATCH_MAX = 2000
DATAGRAM_MAX = 4096
# the autopilot's node only sends: no frame is this one
NOTHING = CanFilter(EXTENDED_MASK, EXTENDED_MASK, extended=True)


class SocketCanBus:
    """A SocketCAN interface with two nodes on it: the autopilot's, and that of all ESCs.

    What others send, a real autopilot among them, comes to the ESCs as well.

    Args:
        channel: the interface, "vcan0".
        clock: stamps what is heard.
        gate: what may be put onto it; None: it is virtual, and takes all.

    Attributes:
        counts: "frame not sent: ..." and what is wrong with frames.

    Raises:
        CanPortError: there is no such interface, or it is down.
    """

    def __init__(self, channel: str, clock: Clock, gate: TransmitGate | None = None) -> None:
        self._clock, self._gate = clock, gate
        self.counts: Counter[str] = Counter()
        with port_errors():
            self._autopilot, self._devices = open_socket(channel, [NOTHING]), open_socket(channel, ())
            for node in (self._autopilot, self._devices):
                node.setblocking(False)
                node.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
            self._reader = DatagramReader(self._devices, FD_BYTES, CONTROL_BYTES, BATCH_MAX)

    def send(self, from_autopilot: Sequence[CanFrame], from_devices: Sequence[CanFrame]) -> None:
        """See VehicleBus. What the interface does not take is counted."""
        for node, frames in ((self._autopilot, from_autopilot), (self._devices, from_devices)):
            for frame in frames if self._gate is None else self._gate.passed(frames):
                try:
                    node.send(packed(frame))
                except OSError as error:
                    self.counts[f"frame not sent: {error.strerror}"] += 1

    def heard_by_devices(self) -> list[CanFrame]:
        """See VehicleBus."""
        with port_errors():
            packets = self._reader.read()
        return list(frames_in(packets, self._clock.stamps(stamps_of(packets)), self.counts).frames())

    def close(self) -> None:
        """See VehicleBus."""
        self._autopilot.close()
        self._devices.close()


class UdpLink:
    """The autopilot's end of a UDP link: a client of the gateway's server.

    Args:
        port: that the gateway listens on.
    """

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect((HOST, port))

    def send(self, datagram: bytes) -> None:
        """See VehicleLink. Nobody may listen yet, or any more: that is UDP."""
        try:
            self._socket.send(datagram)
        except OSError:
            return

    def heard(self) -> list[bytes]:
        """See VehicleLink."""
        datagrams: list[bytes] = []
        while len(datagrams) < BATCH_MAX:
            try:
                datagrams.append(self._socket.recv(DATAGRAM_MAX))
            except BlockingIOError:
                break
            except ConnectionRefusedError:
                continue  # about a datagram of ours, earlier
        return datagrams

    def close(self) -> None:
        """See VehicleLink."""
        self._socket.close()

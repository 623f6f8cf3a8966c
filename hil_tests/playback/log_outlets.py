"""Where a recorded dive goes: CAN buses and a MAVLink link, real ones as well, if that is allowed."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager

from drivers.can.frame import EXTENDED_MASK, CanFilter, CanFrame
from drivers.can.interface import SOCKETCAN, port_opener
from drivers.can.port import CanPort, CanPortError
from drivers.clock import Clock
from drivers.mavlink.endpoint import parse_endpoint
from drivers.mavlink.transports import Transport, open_transport
from hil_tests.bridge.armed_watch import ArmedWatch, listen
from hil_tests.bridge.network_kind import bus_of
from hil_tests.bridge.permission import Bus, Granted, RefusedError, Touched, refusals
from hil_tests.bridge.transmission import TransmitGate

NOTHING = CanFilter(EXTENDED_MASK, EXTENDED_MASK, extended=True)  # who plays does not listen
FULL_S, PATIENCE_S = 0.001, 0.5  # a full queue is asked again so often, and waited for so long


class Outlets:
    """Open buses and an open link.

    Args:
        ports: by the names of the buses.
        gates: of the buses that are real.
        transport: of the link; None: there is none.
        unsent: what could not be sent is counted here, by cause.

    Attributes:
        sent: frames by bus, and packets as "mavlink".
    """

    def __init__(
        self,
        ports: Mapping[str, CanPort],
        gates: Mapping[str, TransmitGate],
        transport: Transport | None,
        unsent: Counter[str],
    ) -> None:
        self._ports, self._gates, self._transport, self._unsent = ports, gates, transport, unsent
        self.sent: Counter[str] = Counter()

    async def frame(self, bus: str, frame: CanFrame) -> None:
        """Put a frame onto a bus, and wait while it is full.

        Raises:
            CanPortError: the bus takes none any more.
        """
        port, gate = self._ports.get(bus), self._gates.get(bus)
        if port is None:
            self._unsent[f"frames of {bus}, which is played nowhere"] += 1
        elif gate is None or gate.passed([frame]):
            await _put(port, frame, bus)
            self.sent[bus] += 1

    def packet(self, packet: bytes) -> None:
        """Send a packet over the link."""
        if self._transport is None:
            self._unsent["packets, for there is no --mavlink"] += 1
        else:
            self._transport.send(packet)
            self.sent["mavlink"] += 1

    def lines(self) -> list[str]:
        """What could not be sent."""
        return [f"not sent: {count} {cause}" for cause, count in sorted(self._unsent.items())] + [
            f"{bus}: {line}" for bus, gate in self._gates.items() if (line := gate.line())
        ]


async def _put(port: CanPort, frame: CanFrame, bus: str) -> None:
    deadline_s = asyncio.get_running_loop().time() + PATIENCE_S
    while True:
        try:
            port.send(frame)
        except CanPortError as error:
            if asyncio.get_running_loop().time() > deadline_s:
                raise CanPortError(f"{bus} takes no frames: {error}") from error
            await asyncio.sleep(FULL_S)
        else:
            return


def permitted(channels: Mapping[str, str], granted: Granted) -> dict[str, TransmitGate]:
    """What may be put onto which of the SocketCAN interfaces; those without a gate are virtual, and take all.

    Raises:
        RefusedError: a real one, without leave.
    """
    buses = {name: bus_of(SOCKETCAN, channel) for name, channel in channels.items()}
    touched = Touched(buses=tuple(buses.values()))
    reasons = refusals(touched, granted) + _autopilots_own(touched.real_buses, granted)
    if reasons:
        raise RefusedError("\n".join(reasons))
    allowed = granted.transmit
    return {name: TransmitGate(allowed) for name, bus in buses.items() if not bus.virtual and allowed is not None}


def _autopilots_own(real: Sequence[Bus], granted: Granted) -> list[str]:
    if not real or granted.no_autopilot:
        return []
    names = " and ".join(bus.name for bus in real)
    return [f"a recorded dive speaks for its autopilot: take any other off {names}, and say --no-autopilot"]


async def nobody_else(endpoint: str, clock: Clock, listen_s: float) -> None:
    """Listens whether an autopilot is there already, in whose place the recorded one would speak.

    Raises:
        RefusedError: it is.
        OSError: the endpoint does not open.
    """
    check_alone(await listen(endpoint, clock, listen_s), endpoint)


def check_alone(watch: ArmedWatch, endpoint: str) -> None:
    """Raises RefusedError where an autopilot was heard."""
    heard = watch.heard()
    if heard:
        raise RefusedError(
            f"{heard[0].name} is heard on {endpoint}: a recorded dive would speak in its place;"
            " take it off, or play somewhere else"
        )


@asynccontextmanager
async def opened(
    channels: Mapping[str, str],
    gates: Mapping[str, TransmitGate],
    endpoint: str | None,
    clock: Clock,
    hear: Callable[[bytes], None],
) -> AsyncIterator[Outlets]:
    """Buses and link, open until the end.

    Args:
        channels: SocketCAN interfaces by the names of the buses.
        gates: see `permitted`.
        endpoint: of the link, as in a configuration; None: there is none.
        clock: stamps what is received.
        hear: gets what comes over the link.

    Raises:
        CanPortError: a bus does not open.
        OSError: the link does not open.
        ValueError: the endpoint cannot be read.
    """
    ports: dict[str, CanPort] = {}
    transport, unsent = None, Counter[str]()
    try:
        for name, channel in channels.items():
            ports[name] = _port(channel, clock)
        if endpoint is not None:
            transport = await open_transport(parse_endpoint(endpoint), hear, lambda _reason: None, unsent)
        yield Outlets(ports, gates, transport, unsent)
    finally:
        for port in ports.values():
            port.close()
        if transport is not None:
            transport.close()


def _port(channel: str, clock: Clock) -> CanPort:
    try:
        return port_opener(SOCKETCAN, channel)([NOTHING], clock, Counter())
    except CanPortError as error:
        remedy = f"sudo ip link add {channel} type vcan; sudo ip link set {channel} up"
        raise CanPortError(f"{channel} does not open: {error}; a virtual one is made by {remedy}") from error

"""UDP, TCP and serial ports under one contract: bytes come in by a callback, bytes go out without waiting.

Every I/O failure is one of two: these bytes could not be sent (counted, the link goes on), or the connection is lost
(reported once, with the reason).
"""

from __future__ import annotations

import asyncio
import os
import termios
from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any, Protocol, cast

import serial

from drivers.mavlink.endpoint import Endpoint, SerialPort, TcpClient, UdpServer

CONNECT_S = 5.0
# Half a second at 57600 baud. More than this waiting means that the line is stuck, and late notices are worthless.
BACKLOG_MAX = 4096
# Ground stations and routers that sent something lately; the oldest makes room for a ninth.
PEERS_MAX = 8
PEER_S = 30.0

ReceiveCallback = Callable[[bytes], None]
LostCallback = Callable[[str], None]


class Transport(Protocol):
    """An open connection."""

    def send(self, data: bytes) -> None:
        """Hand the bytes on without waiting; what cannot go out now is dropped and counted."""
        ...

    def close(self) -> None:
        """Let go of socket or device; the lost callback is not called for it."""
        ...


class StreamTransport(asyncio.Protocol):
    """TCP, or a serial port (which asyncio sees as one pipe to read and one to write)."""

    def __init__(self, on_bytes: ReceiveCallback, on_lost: LostCallback, unsent: Counter[str]) -> None:
        self._on_bytes = on_bytes
        self._on_lost = on_lost
        self._unsent = unsent
        self._open: list[asyncio.BaseTransport] = []
        self._closed = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio, twice for a serial port."""
        self._open.append(transport)

    def data_received(self, data: bytes) -> None:
        """Called by asyncio."""
        self._on_bytes(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        if not self._closed:
            self._on_lost(f"connection lost: {exc or 'closed by the other end'}")

    def send(self, data: bytes) -> None:
        """Queue the bytes, unless too many wait already."""
        writer = cast(asyncio.WriteTransport, self._open[-1])
        if writer.is_closing():
            self._unsent["connection lost"] += 1
        elif writer.get_write_buffer_size() + len(data) > BACKLOG_MAX:
            self._unsent["line too slow"] += 1
        else:
            writer.write(data)

    def close(self) -> None:
        """Close; bytes already queued still go out on TCP."""
        self._closed = True
        for transport in self._open:
            transport.close()


class DatagramTransport(asyncio.DatagramProtocol):
    """UDP: a server answers all who sent something of late, a client its one remote end."""

    def __init__(self, server: bool, on_bytes: ReceiveCallback, on_lost: LostCallback, unsent: Counter[str]) -> None:
        self._on_bytes = on_bytes
        self._on_lost = on_lost
        self._unsent = unsent
        self._server = server
        self._peers: dict[Any, float] = {}
        self._socket: asyncio.DatagramTransport | None = None
        self._closed = False

    @property
    def local_port(self) -> int:
        """The port that this end is bound to."""
        port: int = self._bound().get_extra_info("sockname")[1]
        return port

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._socket = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """Called by asyncio."""
        if self._server:
            self._peers.pop(addr, None)
            self._peers[addr] = asyncio.get_running_loop().time()
            if len(self._peers) > PEERS_MAX:
                del self._peers[next(iter(self._peers))]
        self._on_bytes(data)

    def error_received(self, exc: Exception) -> None:
        """Called by asyncio: nobody listens there (yet), or no route. UDP has no connection that this could end."""
        self._unsent[getattr(exc, "strerror", None) or str(exc)] += 1

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        if not self._closed:
            self._on_lost(f"socket lost: {exc}")

    def send(self, data: bytes) -> None:
        """Send one datagram to the remote end, or to each peer."""
        udp = self._bound()
        if cast(asyncio.WriteTransport, udp).get_write_buffer_size() + len(data) > BACKLOG_MAX:
            self._unsent["line too slow"] += 1
        elif not self._server:
            udp.sendto(data)
        else:
            self._answer(udp, data)

    def _answer(self, udp: asyncio.DatagramTransport, data: bytes) -> None:
        oldest_s = asyncio.get_running_loop().time() - PEER_S
        self._peers = {peer: at_s for peer, at_s in self._peers.items() if at_s >= oldest_s}
        if not self._peers:
            self._unsent["nobody there yet"] += 1
        for peer in self._peers:
            udp.sendto(data, peer)

    def close(self) -> None:
        """Close."""
        self._closed = True
        self._bound().close()

    def _bound(self) -> asyncio.DatagramTransport:
        if self._socket is None:
            raise ValueError("the socket is not open: use open_transport")
        return self._socket


# How an endpoint is opened: `open_transport`, or what plays its part
Connect = Callable[[Endpoint, ReceiveCallback, LostCallback, Counter[str]], Awaitable[Transport]]


async def open_transport(
    endpoint: Endpoint, on_bytes: ReceiveCallback, on_lost: LostCallback, unsent: Counter[str]
) -> Transport:
    """Open the endpoint.

    Args:
        endpoint: where to.
        on_bytes: called with what was received, from the event loop, at once.
        on_lost: called at most once, with the reason, when the connection is gone.
        unsent: what could not be sent is counted here, by cause.

    Raises:
        OSError: it cannot be opened (now).
    """
    loop = asyncio.get_running_loop()
    if isinstance(endpoint, SerialPort):
        return await _open_serial(endpoint, StreamTransport(on_bytes, on_lost, unsent))
    place = (endpoint.host, endpoint.port)
    async with asyncio.timeout(CONNECT_S):
        if isinstance(endpoint, TcpClient):
            stream = StreamTransport(on_bytes, on_lost, unsent)
            await loop.create_connection(lambda: stream, *place)
            return stream
        server = isinstance(endpoint, UdpServer)
        datagrams = DatagramTransport(server, on_bytes, on_lost, unsent)
        await loop.create_datagram_endpoint(
            lambda: datagrams, local_addr=place if server else None, remote_addr=None if server else place
        )
        return datagrams


async def _open_serial(endpoint: SerialPort, protocol: StreamTransport) -> StreamTransport:
    loop = asyncio.get_running_loop()
    try:
        port = serial.Serial(endpoint.device, endpoint.baud, timeout=0, write_timeout=0)
    except (termios.error, ValueError) as error:  # not a terminal; a baud rate that the hardware cannot do
        raise OSError(f"{endpoint.device} at {endpoint.baud} baud: {error}") from error
    # The two pipes are closed each for itself, so the writing one gets a descriptor of its own.
    writing = os.fdopen(os.dup(port.fileno()), "wb", buffering=0)
    try:
        await loop.connect_read_pipe(lambda: protocol, port)
        await loop.connect_write_pipe(lambda: protocol, writing)
    except BaseException:
        protocol.close()
        port.close()
        writing.close()
        raise
    return protocol

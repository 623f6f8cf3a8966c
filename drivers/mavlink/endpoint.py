"""Where a MAVLink link goes, as written in the configuration."""

from __future__ import annotations

from dataclasses import dataclass

FORMS = "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD"


@dataclass(frozen=True, slots=True)
class UdpServer:
    """Wait for datagrams here, and answer whoever sends some, as a ground station does. Port 0: any free one."""

    host: str
    port: int


@dataclass(frozen=True, slots=True)
class UdpClient:
    """Send datagrams there, and hear the answers."""

    host: str
    port: int


@dataclass(frozen=True, slots=True)
class TcpClient:
    """Connect to there."""

    host: str
    port: int


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial device with 8 data bits, no parity, 1 stop bit."""

    device: str
    baud: int


Endpoint = UdpServer | UdpClient | TcpClient | SerialPort


def parse_endpoint(text: str) -> Endpoint:
    """Read `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT` or `serial:DEVICE:BAUD`; IPv6 hosts in brackets.

    Raises:
        ValueError: not one of these, or a number out of range.
    """
    kind, _, rest = text.partition(":")
    place, _, number = rest.rpartition(":")
    if kind not in {"udpin", "udpout", "tcp", "serial"} or not place or not (number.isascii() and number.isdigit()):
        raise ValueError(f"endpoint must be {FORMS}, got {text!r}")
    if kind == "serial":
        return SerialPort(place, _bounded(text, "baud", int(number), 1, 20_000_000))
    host = place.removeprefix("[").removesuffix("]")
    if kind == "udpin":
        return UdpServer(host, _bounded(text, "port", int(number), 0, 65535))
    port = _bounded(text, "port", int(number), 1, 65535)
    return UdpClient(host, port) if kind == "udpout" else TcpClient(host, port)


def _bounded(text: str, name: str, value: int, lowest: int, highest: int) -> int:
    if not lowest <= value <= highest:
        raise ValueError(f"{name} must lie in {lowest}..{highest}, got {value} in endpoint {text!r}")
    return value

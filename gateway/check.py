"""Whether this machine can do what a configuration asks for: each check is one line, with the way to mend it."""

from __future__ import annotations

import asyncio
import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drivers.can.interface import port_opener
from drivers.can.port import CanPortError
from drivers.clock import Clock
from drivers.mavlink.endpoint import SerialPort, TcpClient, UdpClient, UdpServer, parse_endpoint
from drivers.mavlink.transports import open_transport
from gateway import state
from gateway.config import Config
from gateway.config_sections import CanBus, Mavlink
from gateway.wiring import can_decoder

OPEN_TIMEOUT_S = 5.0
INTERFACES = Path("/sys/class/net")


@dataclass(frozen=True, slots=True)
class CheckResult:
    """What a check found.

    Attributes:
        subject: what was looked at.
        ok: True if the gateway can work with it.
        detail: what was seen.
        remedy: what to do where it is not ok.
    """

    subject: str
    ok: bool
    detail: str
    remedy: str = ""

    def line(self) -> str:
        """For the terminal."""
        if self.ok:
            return f"ok       {self.subject}: {self.detail}"
        return f"problem  {self.subject}: {self.detail}; {self.remedy}"


def checks(config: Config) -> Iterator[CheckResult]:
    """Looks at every link and file of a configuration. Nothing is sent, nothing is changed."""
    for bus in config.can:
        yield _check_bus(bus, config)
    if config.mavlink is not None:
        yield _check_mavlink(config.mavlink)
    yield _check_folder("findings", config.files.findings)
    yield _check_folder("state", config.files.state)
    yield _check_state(config.files.state)


def _check_bus(bus: CanBus, config: Config) -> CheckResult:
    subject = f"can {bus.name}"
    filters = can_decoder(bus, config.thruster).filters()
    options = {} if bus.bitrate is None else {"bitrate": bus.bitrate}
    try:
        port = port_opener(bus.interface, bus.channel, **options)(filters, Clock(), Counter())
    except (CanPortError, ValueError) as error:
        return CheckResult(subject, False, f"{bus.interface} {bus.channel} does not open: {error}", _bus_remedy(bus))
    port.close()
    if bus.interface == "socketcan" and _operstate(bus.channel) == "down":
        return CheckResult(subject, False, f"{bus.channel} is down", _bus_remedy(bus))
    return CheckResult(subject, True, f"{bus.interface} {bus.channel} opens, {len(filters)} kinds of frames are read")


def _bus_remedy(bus: CanBus) -> str:
    if bus.interface != "socketcan":
        return f"see python-can's documentation of {bus.interface}, and that no other program holds the device"
    if (INTERFACES / bus.channel).exists():
        return f"bring it up: sudo ip link set {bus.channel} up type can bitrate 1000000 restart-ms 100"
    found = sorted(path.name for path in INTERFACES.glob("*can*")) if INTERFACES.is_dir() else []
    here = ", ".join(found) or "none"
    return f"connect the adapter, load its driver, or name another channel (CAN interfaces here: {here})"


def _operstate(channel: str) -> str:
    try:
        return (INTERFACES / channel / "operstate").read_text(encoding="ascii").strip()
    except OSError:
        return "unknown"


def _check_mavlink(mavlink: Mavlink) -> CheckResult:
    subject = f"mavlink {mavlink.endpoint}"
    try:
        asyncio.run(_open(mavlink))
    except (OSError, TimeoutError) as error:
        return CheckResult(subject, False, f"does not open: {error or 'no answer'}", _mavlink_remedy(mavlink))
    return CheckResult(subject, True, "opens")


async def _open(mavlink: Mavlink) -> None:
    async with asyncio.timeout(OPEN_TIMEOUT_S):
        transport = await open_transport(
            parse_endpoint(mavlink.endpoint), lambda _data: None, lambda _reason: None, Counter()
        )
    transport.close()


def _mavlink_remedy(mavlink: Mavlink) -> str:
    match parse_endpoint(mavlink.endpoint):
        case SerialPort(device=device):
            return f"is {device} connected, and is this user in its group (sudo usermod -aG dialout $USER)?"
        case UdpServer(port=port):
            return f"another program may hold port {port} (sudo ss -lunp), or the address is not this machine's"
        case TcpClient(host=host, port=port) | UdpClient(host=host, port=port):
            return f"is the autopilot's server at {host}:{port} running and reachable?"


def _check_folder(what: str, path: Path) -> CheckResult:
    subject = f"files.{what}"
    if not path.parent.is_dir():
        return CheckResult(subject, False, f"no folder {path.parent}", f"mkdir -p {path.parent}")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        return CheckResult(
            subject, False, f"{path} cannot be written", "give this user the right to, or name another"
        )
    return CheckResult(subject, True, str(path))


def _check_state(path: Path) -> CheckResult:
    try:
        learnt = state.load(path)
    except (state.StateError, OSError) as error:
        remedy = "it will be set aside and all is learnt anew"
        return CheckResult("learnt state", False, f"{path} {error}", remedy)
    known = ", ".join(map(str, sorted(learnt))) or "nothing yet"
    return CheckResult("learnt state", True, f"thrusters {known}" if learnt else known)

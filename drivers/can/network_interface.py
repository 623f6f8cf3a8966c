"""What Linux says of a CAN interface: its bit rates, and how much it has carried."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.can.load import BitRates, Traffic

INTERFACES = Path("/sys/class/net")
ANSWER_S = 2.0


def traffic(channel: str, interfaces: Path = INTERFACES) -> Traffic | None:
    """All data frames, received and sent, since the interface was made; None where there is no such interface.

    Drivers before Linux 5.17 count their error frames, too: a bus that has many of them looks busier than it is.
    """
    statistics = interfaces / channel / "statistics"
    try:
        counts = {name: int((statistics / name).read_text()) for name in _COUNTS}
    except (OSError, ValueError):
        return None
    return Traffic(
        counts["rx_packets"] + counts["tx_packets"],
        counts["rx_bytes"] + counts["tx_bytes"],
    )


_COUNTS = ("rx_packets", "tx_packets", "rx_bytes", "tx_bytes")


@dataclass(frozen=True, slots=True)
class Controller:
    """How the controller of a CAN interface is set up.

    Attributes:
        rates: None: it has not been given any yet.
        listen_only: it acknowledges nothing, and can send nothing.
        restart_s: from bus-off to its restart by the kernel; 0.0: somebody has to restart it.
    """

    rates: BitRates | None
    listen_only: bool
    restart_s: float


async def controller(channel: str) -> Controller | None:
    """The controller of an interface; None where it has none (as vcan), or nobody can say.

    Asks the `ip` of iproute2: the kernel tells of controllers over netlink only.
    """
    try:
        process = await asyncio.create_subprocess_exec(
            *("ip", "-details", "-json", "link", "show", "dev", channel),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL,
        )
    except OSError:
        return None
    try:
        async with asyncio.timeout(ANSWER_S):
            answer, _ = await process.communicate()
    except TimeoutError:
        return None
    finally:
        if process.returncode is None:
            with suppress(ProcessLookupError):
                process.kill()
            await process.wait()
    return parse_controller(answer)


async def bit_rates(channel: str) -> BitRates | None:
    """The bit rates that the interface is set to; None where it has none, or nobody can say."""
    found = await controller(channel)
    return None if found is None else found.rates


def parse_controller(answer: bytes) -> Controller | None:
    """The controller in the answer of `ip -details -json link show`; None where there is none."""
    try:
        link = json.loads(answer)[0]["linkinfo"]
        data = link["info_data"]
        if link["info_kind"] != "can" or not isinstance(data, dict):
            return None
        modes, restart_ms = data.get("ctrlmode", []), data.get("restart_ms", 0)
    except (ValueError, LookupError, TypeError, AttributeError):
        return None
    return Controller(
        _rates(data),
        listen_only=isinstance(modes, list) and "LISTEN-ONLY" in modes,
        restart_s=restart_ms / 1000.0 if isinstance(restart_ms, int) else 0.0,
    )


def _rates(data: dict[str, Any]) -> BitRates | None:
    """A controller with a table of fixed rates says `bittiming_bitrate` where others have a whole `bittiming`."""
    nominal, fast = _rate(data, "bittiming"), _rate(data, "data_bittiming")
    return None if nominal is None else BitRates(nominal, fast)


def _rate(data: dict[str, Any], timing: str) -> int | None:
    whole = data.get(timing)
    rate = whole.get("bitrate") if isinstance(whole, dict) else data.get(f"{timing}_bitrate")
    return rate if isinstance(rate, int) and rate > 0 else None

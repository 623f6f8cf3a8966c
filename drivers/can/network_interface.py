"""What Linux says of a CAN interface: its bit rates, and how much it has carried."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
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


async def bit_rates(channel: str) -> BitRates | None:
    """The bit rates that the interface is set to; None where it has none (as vcan), or nobody can say.

    Asks the `ip` of iproute2: the kernel tells bit rates over netlink only.
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
    return parse_bit_rates(answer)


def parse_bit_rates(answer: bytes) -> BitRates | None:
    """The bit rates in the answer of `ip -details -json link show`; None where there are none.

    A controller with a table of fixed rates says `bittiming_bitrate` where others have a whole `bittiming`.
    """
    try:
        data = json.loads(answer)[0]["linkinfo"]["info_data"]
        nominal, fast = _rate(data, "bittiming"), _rate(data, "data_bittiming")
    except (ValueError, LookupError, TypeError, AttributeError):
        return None
    return None if nominal is None else BitRates(nominal, fast)


def _rate(data: dict[str, Any], timing: str) -> int | None:
    rate = data[timing]["bitrate"] if timing in data else data.get(f"{timing}_bitrate")
    return rate if isinstance(rate, int) and rate > 0 else None

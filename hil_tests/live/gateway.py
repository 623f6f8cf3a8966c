"""`python -m hil_tests.live.gateway CONFIG SUMMARY`: `gateway run`, whose CAN buses may be UDP ports.

SIGTERM ends it; then what it has received and dropped is written to the file SUMMARY.
"""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from pathlib import Path

from drivers.can.interface import SOCKETCAN
from gateway.config import Config, load
from gateway.logs import start_logging
from gateway.run import run
from gateway.summary import Summary
from hil_tests.live.buses import udp_opener


async def watch(config: Config) -> Summary:
    """Until SIGTERM."""
    stop = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, stop.set)
    over_udp = any(bus.interface != SOCKETCAN for bus in config.can)
    return await run(config, stop=stop, port_of=udp_opener if over_udp else None)


def main(config: Path, out: Path) -> None:
    """Watch, and write what it came to."""
    start_logging(verbose=False)
    summary = asyncio.run(watch(load(config)))
    figures = {"frames": summary.frames, "drops": summary.drops, "behind_max_s": summary.behind_max_s}
    out.write_text(json.dumps(figures), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))

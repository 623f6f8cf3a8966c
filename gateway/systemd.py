"""What systemd is told of this service: that it is ready, that it lives, how it is, and that it stops.

The protocol of sd_notify(3): datagrams of `NAME=value` lines to the socket that NOTIFY_SOCKET names, a path or, with
an @ in front, an abstract name. Where there is no such socket, nothing is said.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Mapping

log = logging.getLogger("gateway")

# often enough that a turn of the judging may be late
PER_WATCHDOG = 2.0
STATUS_PERIOD_S = 1.0


class Service:
    """This process as a service of systemd.

    Args:
        environment: where systemd says what it wants to hear.
        process_id: ours; the watchdog may be meant for another process.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ, process_id: int | None = None) -> None:
        self._address = _address(environment.get("NOTIFY_SOCKET", ""))
        self._watchdog_s = _watchdog_s(environment, os.getpid() if process_id is None else process_id)
        self._alive_s: float | None = None
        self._status, self._status_s = "", float("-inf")
        self._failing = False

    def ready(self) -> None:
        """Links were opened, and judging turns."""
        self._send("READY=1")

    def alive(self, time_s: float) -> None:
        """Judging has turned once more. Called at every turn; systemd hears of it twice in its watchdog's time."""
        if self._watchdog_s is None:
            return
        if self._alive_s is None or time_s - self._alive_s >= self._watchdog_s / PER_WATCHDOG:
            self._alive_s = time_s
            self._send("WATCHDOG=1")

    def status(self, line: str, time_s: float) -> None:
        """How it is, in one line for `systemctl status`; said when it changes, at most once a second."""
        if line != self._status and time_s - self._status_s >= STATUS_PERIOD_S:
            self._status, self._status_s = line, time_s
            self._send(f"STATUS={line}")

    def stopping(self) -> None:
        """The service stops."""
        self._send("STOPPING=1")

    def _send(self, text: str) -> None:
        """Nothing is worth more than the watch: what systemd does not take is lost, and told once."""
        if self._address is None:
            return
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as channel:
                channel.setblocking(False)
                channel.sendto(text.encode(), self._address)
        except OSError as error:
            if not self._failing:
                log.warning("systemd cannot be told %s: %s", text, error)
            self._failing = True
        else:
            self._failing = False


def _address(name: str) -> str | None:
    if name.startswith("/"):
        return name
    if name.startswith("@"):
        return "\0" + name[1:]
    if name:
        log.warning("NOTIFY_SOCKET = %r: want a path or @name; systemd is told nothing", name)
    return None


def _watchdog_s(environment: Mapping[str, str], process_id: int) -> float | None:
    """The time in which systemd wants a sign of life; None where it does not watch us."""
    try:
        period_us = int(environment.get("WATCHDOG_USEC", "0"))
        watched = int(environment.get("WATCHDOG_PID", str(process_id)))
    except ValueError:
        log.warning("WATCHDOG_USEC or WATCHDOG_PID is no number: the watchdog is not served")
        return None
    return period_us * 1e-6 if period_us > 0 and watched == process_id else None

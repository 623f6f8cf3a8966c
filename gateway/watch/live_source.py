"""The gateway that runs with a configuration: asked over its control socket, waited for where there is none."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Protocol

from gateway.control.tell import NoAnswerError
from gateway.telemetry import Telemetry
from gateway.watch.source import Look
from gateway.watch.words import ago


class Asked(Protocol):
    """What answers; see `gateway.control.watching.Watching`."""

    def ask(self) -> Telemetry:
        """How the gateway is."""
        ...

    def close(self) -> None:
        """It is asked no more."""
        ...


# a gateway that was started again is told of as that for a while
NEW_S = 30.0


class LiveSource:
    """See `gateway.watch.source.Source`.

    Args:
        gateway: is asked.
        now: the time, unix seconds.
    """

    def __init__(self, gateway: Asked, now: Callable[[], float]) -> None:
        self._gateway, self._now = gateway, now
        self._seen: Telemetry | None = None
        self._restarted = False

    def look(self) -> Look:
        """How it is; where it does not answer, how it was, and why."""
        try:
            telemetry = self._gateway.ask()
        except NoAnswerError as error:
            return self._gone(f"{error}; waiting for it")
        if self._seen is not None:
            self._restarted |= telemetry.running_s < self._seen.running_s
        self._restarted &= telemetry.running_s < NEW_S
        self._seen = telemetry
        state = "live, started again" if self._restarted else "live"
        return Look(telemetry, state, time=_instant(telemetry.time_s))

    def close(self) -> None:
        """The gateway is asked no more."""
        self._gateway.close()

    def _gone(self, why: str) -> Look:
        now_s = self._now()
        note = "" if self._seen is None else f"last seen {ago(now_s - self._seen.time_s)} ago"
        return Look(self._seen, why, note, fresh=False, time=_instant(now_s))


def _instant(time_s: float) -> str:
    return f"{datetime.fromtimestamp(time_s, UTC):%Y-%m-%dT%H:%M:%SZ}"

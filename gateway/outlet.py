"""Where outcomes go: the file of findings, the log, the autopilot's link, and whoever listens."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

from drivers.mavlink.messages import (
    CommandAck,
    CommandLong,
    CompanionHeartbeat,
    NamedValue,
    OutgoingMessage,
    StatusText,
)
from gateway.findings import Finding, FindingsFile
from gateway.pipeline import Outcome
from gateway.severity import Severity

log = logging.getLogger("gateway")

LOG_LEVELS = {Severity.CRITICAL: logging.ERROR, Severity.ERROR: logging.ERROR, Severity.WARNING: logging.WARNING}
# findings that are no change of a level: what was asked of the autopilot, what an operator has said
NOTES = frozenset({"failsafe", "operator"})

Observer = Callable[[Outcome], None]


class Outlet:
    """See the module's text.

    Args:
        findings: gets every finding.
        path: of that file, for the log.
        listeners: get every outcome, in order.
        send: says a message on the autopilot's link; None: there is none.

    Attributes:
        counts: findings by level.
        lost: findings that were not written, by cause.
    """

    def __init__(
        self,
        findings: FindingsFile,
        path: Path,
        listeners: Iterable[Observer],
        send: Callable[[OutgoingMessage], None] | None,
    ) -> None:
        self._findings, self._path, self._listeners = findings, path, tuple(listeners)
        self._send = send
        self.counts: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()

    def record(self, outcomes: Iterable[Outcome]) -> None:
        """What takes time: called in the judging's thread."""
        for outcome in outcomes:
            if isinstance(outcome, Finding):
                self._write(outcome)

    def tell(self, outcomes: Iterable[Outcome]) -> None:
        """The rest: called in the event loop."""
        for outcome in outcomes:
            match outcome:
                case Finding():
                    if outcome.detector not in NOTES:
                        self.counts[outcome.level.name] += 1
                    log.log(LOG_LEVELS.get(outcome.severity, logging.INFO), "%s", _line(outcome))
                case StatusText() | CommandAck() | CommandLong() | CompanionHeartbeat() | NamedValue():
                    self._say(outcome)
            for listener in self._listeners:
                listener(outcome)

    def _say(self, message: OutgoingMessage) -> None:
        if self._send is not None:
            self._send(message)

    def _write(self, finding: Finding) -> None:
        """A full disk must not end the watch: pilot and autopilot are told all the same."""
        try:
            self._findings.append(finding)
        except OSError as error:
            if not self.lost["finding not written"]:
                log.error("findings cannot be written to %s: %s", self._path, error)
            self.lost["finding not written"] += 1


def _line(finding: Finding) -> str:
    """For the log: a note on what was asked says how it went, and not how well the vehicle is."""
    return finding.text if finding.detector in NOTES else f"{finding.level.name}: {finding.text}"

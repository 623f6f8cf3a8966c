"""Log lines for a terminal, and for the journal, which has its own times and wants the priority in front."""

from __future__ import annotations

import logging
import os

# sd-daemon(3): syslog priorities
PRIORITIES = {logging.DEBUG: 7, logging.INFO: 6, logging.WARNING: 4, logging.ERROR: 3, logging.CRITICAL: 2}


class JournalFormatter(logging.Formatter):
    """`<priority>message`: journald takes the priority off, stamps the line, and can filter by it."""

    def format(self, record: logging.LogRecord) -> str:
        """One record."""
        prefix = f"<{PRIORITIES.get(record.levelno, 6)}>"
        return "\n".join(prefix + line for line in super().format(record).splitlines())


def formatter(under_journal: bool) -> logging.Formatter:
    """How lines look: with their time only where nobody else adds it."""
    if under_journal:
        return JournalFormatter("%(levelname)s %(message)s")
    return logging.Formatter("%(asctime)s.%(msecs)03d %(levelname)-7s %(message)s", "%H:%M:%S")


def start_logging(verbose: bool = False) -> None:
    """Logs to standard error, one line an event."""
    handler = logging.StreamHandler()
    # systemd sets it where standard error goes to the journal
    handler.setFormatter(formatter(under_journal="JOURNAL_STREAM" in os.environ))
    logging.basicConfig(handlers=[handler], level=logging.DEBUG if verbose else logging.INFO, force=True)
    logging.getLogger("can").setLevel(logging.CRITICAL)  # our own links say what is wrong with them
    logging.getLogger("asyncio").setLevel(logging.WARNING)

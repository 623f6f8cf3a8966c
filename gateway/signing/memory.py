"""Keeps the stamps of signed MAVLink over restarts, in a file beside the state.

A stamp that came twice would be refused by the vehicle, and a recording could be played to a gateway that had
forgotten what it heard. So the file is written at the start, then every half minute, and at the end; it reserves more
stamps than can be used until the next time.
"""

from __future__ import annotations

import json
import logging
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from drivers.mavlink.signing import SigningHistory
from gateway.state import write

log = logging.getLogger("gateway")

FORMAT = "thruster-gateway stamps 1"
# mavlink.io asks for once a minute at the least
KEEP_S = 30.0


class HistoryError(ValueError):
    """A file of stamps that cannot be used."""


def pack(history: SigningHistory) -> bytes:
    """The bytes of a file of stamps."""
    streams = [[*stream, stamp] for stream, stamp in sorted(history.streams.items())]
    fields = {"format": FORMAT, "clock": history.clock, "reserved": history.reserved, "streams": streams}
    return json.dumps(fields).encode() + b"\n"


def unpack(data: bytes) -> SigningHistory:
    """Reads the bytes of a file of stamps.

    Raises:
        HistoryError: they are none.
    """
    try:
        fields = json.loads(data)
        if fields["format"] != FORMAT:
            raise HistoryError(f"is not of this version: {fields['format']!r}")
        streams = {(system, component, link): stamp for system, component, link, stamp in fields["streams"]}
        return SigningHistory(fields["clock"], fields["reserved"], streams)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise HistoryError(f"is no file of stamps, or damaged: {error}") from error


class SigningMemory:
    """The file of stamps of a run.

    Writing takes as long as the disk wants, so it is done in a thread, one after the other; failures are told once.

    Args:
        path: where it lies, or will lie.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="stamps")
        self._failing = False

    def recall(self, time_s: float) -> SigningHistory:
        """What the run before knew; nothing where there was none, or where it cannot be believed at `time_s`."""
        try:
            history = unpack(self._path.read_bytes())
            if not history.believable(time_s):
                raise HistoryError("lies in the far future: was a clock wrong?")
        except FileNotFoundError:
            return SigningHistory()
        except (HistoryError, OSError) as error:
            log.warning("%s %s; if the vehicle takes nothing from us now, set up its key anew", self._path, error)
            return SigningHistory()
        return history

    def keep(self, history: SigningHistory) -> None:
        """Has a history written, without waiting."""
        self._thread.submit(self._write, history)

    def close(self, history: SigningHistory) -> None:
        """Has the last history written, and waits for it."""
        self.keep(history)
        self._thread.shutdown()

    def _write(self, history: SigningHistory) -> None:
        try:
            write(self._path, pack(history))
        except OSError as error:
            if not self._failing:
                log.error("stamps of signed messages cannot be kept in %s: %s", self._path, error)
            self._failing = True
        else:
            self._failing = False

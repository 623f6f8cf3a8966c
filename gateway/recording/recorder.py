"""Records a run: what is put into memory is written to the disk by a thread of its own, twice a second.

Nothing that happens to the disk reaches the run. Where it cannot be written to, recording pauses, which the log says
once, and what waits in memory is tried again every few seconds.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from time import monotonic

from gateway.config_sections import Recording
from gateway.recording.entries import About
from gateway.recording.folder import MB, is_full
from gateway.recording.mending import mend_all
from gateway.recording.scribe import Scribe
from gateway.recording.waiting import WAITING_MAX_BYTES, Batch, Waiting

log = logging.getLogger("gateway")

# a pulled plug loses what waits for its chunk: with the time that the disk takes, less than a second
CHUNK_S = 0.5
# of memory, in one chunk: what has waited for a disk is not to become one huge one
CHUNK_BYTES = 8_000_000
AGAIN_S = 3.0

_FULL = "delete or move away what lies in {folder}, or set less for recording.keep_free_mb or recording.budget_mb"
_OTHER = "see that {folder} can be written to, or set recording.folder"


class Recorder(Waiting):
    """See the module's text. It is the `Journal` of the run.

    Args:
        settings: `[recording]` of the configuration.
        about: what the recording says of itself.
        now: the time, unix seconds.
        most_bytes: of memory for what waits.

    Attributes:
        lost: what was not recorded, by what it was.
    """

    def __init__(
        self,
        settings: Recording,
        about: About,
        now: Callable[[], float],
        most_bytes: int = WAITING_MAX_BYTES,
    ) -> None:
        super().__init__(now, most_bytes)
        self._settings = settings
        self._scribe = Scribe(settings, about, now)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        # files of hundreds of megabytes take seconds, in which the new one must not wait
        self._mender = threading.Thread(target=mend_all, args=(settings.folder,), name="mender", daemon=True)
        self._unwritten: Batch | None = None
        self._paused, self._full = "", False
        self._again_s = 0.0

    def begin(self, state: bytes = b"", resumed: bool = False) -> None:
        """Begins to write. Nothing of the disk is touched before this, nor in this thread.

        Args:
            state, resumed: see `About`.
        """
        self._scribe.begin(state, resumed)
        self._mender.start()
        self._thread.start()

    def close(self, within_s: float) -> bool:
        """Ends the recording with all that was put in before; False where the disk takes longer than that."""
        self._closing.set()
        if self._thread.ident is None:  # it was never begun
            return True
        self._thread.join(within_s)
        return not self._thread.is_alive()

    def remember(self, state: bytes) -> None:
        """What has been learnt by now (`gateway.state`): the next file begins with it."""
        self._scribe.remember(state)

    @property
    def recorded_bytes(self) -> int:
        """In all files of the run."""
        return self._scribe.bytes_written

    def state_words(self) -> str:
        """How it goes."""
        if self._paused:
            return f"paused: {self._paused}"
        lost = self.lost.total()
        path = self._scribe.path
        name = "" if path is None else f" to {path.name}"
        words = f"recording{name}, {self._scribe.bytes_written / MB:.1f} MB"
        return f"{words}, {lost} not recorded" if lost else words

    def _run(self) -> None:
        while not self._closing.wait(CHUNK_S):
            self._write_waiting()
        self._again_s = 0.0
        self._write_waiting()
        self._end()

    def _write_waiting(self) -> None:
        if monotonic() < self._again_s:
            return
        while batch := self._unwritten or self.take(CHUNK_BYTES):
            self._unwritten = batch
            try:
                self._scribe.write(batch.items)
            except OSError as error:
                self._pause(error)
                return
            except Exception as error:  # a value that nobody thought of must not end the recording of all others
                log.error("recording: %d items cannot be written down: %r", len(batch.items), error)
                self.give_up(batch)
            else:
                self.release(batch)
                self._go_on()
            self._unwritten = None

    def _pause(self, error: OSError) -> None:
        self._again_s = monotonic() + AGAIN_S
        why, full = error.strerror or str(error), is_full(error)
        if not self._paused or full != self._full:
            way_out = (_FULL if full else _OTHER).format(folder=self._settings.folder)
            log.error("recording pauses: %s: %s; %s", error.filename or self._settings.folder, why, way_out)
        self._paused, self._full = why, full

    def _go_on(self) -> None:
        if self._paused:
            self._paused = ""
            lost = self.lost.total()
            log.info("recording goes on%s", f"; {lost} could not be kept meanwhile" if lost else "")

    def _end(self) -> None:
        while (batch := self._unwritten or self.take(CHUNK_BYTES)) and batch.size:
            self.give_up(batch)
            self._unwritten = None
        try:
            self._scribe.close()
        except OSError as error:
            log.error("recording %s has no end: %s; the next run mends it", self._scribe.path, error)

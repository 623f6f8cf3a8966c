"""Keeps what the pipeline has learnt over restarts; a file that cannot be used is set aside, never fatal."""

from __future__ import annotations

import logging
from pathlib import Path

from gateway import state
from gateway.pipeline import Pipeline

log = logging.getLogger("gateway")


class Memory:
    """The state file of a run.

    Args:
        path: where it lies, or will lie.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._failing = False

    def recall(self, pipeline: Pipeline) -> None:
        """Gives the pipeline what an earlier run had learnt."""
        try:
            foreign = pipeline.recall(state.load(self._path))
        except state.StateError as error:
            self._set_aside(f"state {self._path} {error}")
        except OSError as error:
            log.warning("state %s cannot be read, all is learnt anew: %s", self._path, error)
        else:
            if foreign:
                self._set_aside(f"state {self._path} is of others: {', '.join(foreign)}", keep=True)

    def store(self, pipeline: Pipeline) -> None:
        """Writes what the pipeline has learnt; a failure is logged once, until it works again."""
        try:
            state.save(self._path, pipeline.learnt())
        except OSError as error:
            if not self._failing:
                log.error("state %s cannot be saved: %s", self._path, error)
            self._failing = True
        else:
            self._failing = False

    def _set_aside(self, reason: str, keep: bool = False) -> None:
        aside = self._path.with_name(self._path.name + ".aside")
        try:
            aside.write_bytes(self._path.read_bytes()) if keep else self._path.replace(aside)
        except OSError as error:
            log.warning("%s, and cannot be set aside (%s): what it had is learnt anew", reason, error)
        else:
            log.warning("%s: kept as %s, what it had is learnt anew", reason, aside.name)

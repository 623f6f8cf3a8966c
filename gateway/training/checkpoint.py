"""How far a training has come, on disk: one that was stopped goes on as if it had not been."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from pickle import UnpicklingError
from typing import Any
from zipfile import is_zipfile

import torch

from gateway.training.evaluation import Figures
from gateway.training.records import InnovationRecord
from gateway.training.settings import TrainingSettings


class CheckpointError(ValueError):
    """A checkpoint that cannot be gone on from."""


class Checkpoint:
    """Results of the trainings that are over, and the state of the one that is not.

    Args:
        path: of the file; None: nothing is kept.
        fingerprint: of what is trained, see `fingerprint`.
        resume: go on from what the file says, if there is one.

    Raises:
        CheckpointError: the file cannot be read, or belongs to another training.
        OSError: it cannot be read.
    """

    def __init__(self, path: Path | None, fingerprint: str, *, resume: bool) -> None:
        self._path = path
        self._fingerprint = fingerprint
        self._results: dict[str, dict[str, Any]] = {}
        self._current: tuple[str, Mapping[str, Any]] | None = None
        if path is not None and resume and path.exists():
            self._read(path)

    def result(self, training: str) -> Figures | None:
        """The figures of a training that is over."""
        known = self._results.get(training)
        return None if known is None else Figures(**known)

    def state(self, training: str) -> Mapping[str, Any] | None:
        """The state of a training that was begun."""
        return self._current[1] if self._current and self._current[0] == training else None

    def finish(self, training: str, figures: Figures) -> None:
        """A training is over."""
        self._results[training] = asdict(figures)
        self._current = None
        self._write()

    def keep(self, training: str, state: Mapping[str, Any]) -> None:
        """A training has come so far."""
        self._current = (training, state)
        self._write()

    def remove(self) -> None:
        """All is over."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    def _write(self) -> None:
        if self._path is None:
            return
        content = {"fingerprint": self._fingerprint, "results": self._results, "current": self._current}
        temporary = self._path.with_name(self._path.name + ".new")
        torch.save(content, temporary)
        temporary.replace(self._path)

    def _read(self, path: Path) -> None:
        if not is_zipfile(path):
            raise CheckpointError(f"{path} is not a checkpoint")
        try:
            content = torch.load(path, weights_only=True)
            theirs, self._results, self._current = (content[key] for key in ("fingerprint", "results", "current"))
        except (RuntimeError, ValueError, KeyError, TypeError, EOFError, UnpicklingError) as error:
            raise CheckpointError(f"{path} is not a checkpoint, or damaged: {error}") from error
        if theirs != self._fingerprint:
            raise CheckpointError(f"{path} belongs to a training with other recordings or settings")


def fingerprint(records: Sequence[InnovationRecord], settings: TrainingSettings) -> str:
    """Tells trainings with other data, settings or versions apart."""
    digest = hashlib.sha256(json.dumps([asdict(settings), torch.__version__], sort_keys=True).encode())
    for record in records:
        digest.update(record.name.encode())
        for values in (record.time_s, record.features, record.innovation, record.variance):
            digest.update(values.tobytes())
    return digest.hexdigest()

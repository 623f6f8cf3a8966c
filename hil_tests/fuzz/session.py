"""Fuzzing a target for a time, with atheris where it is installed, and what is left on disk of it.

Of each target a folder holds the inputs that reached something new, which the next session begins with, and those
that failed.
"""

from __future__ import annotations

import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path

from hil_tests.fuzz.damaging import checked, damaged_inputs, first_failure
from hil_tests.fuzz.mutations import EXTREMES, INPUT_MAX
from hil_tests.fuzz.target import Target

INPUT_SECONDS, MEMORY_MIB = 20, 1024
TOKEN_MAX = 60  # bytes that libFuzzer takes as one word
FAILED = "failed"
_GRACE_S = 120.0


def is_guided() -> bool:
    """Whether atheris is installed."""
    return find_spec("atheris") is not None


@dataclass(frozen=True, slots=True)
class Session:
    """A target for a time.

    Attributes:
        target: what is fuzzed.
        seconds: for how long.
        folder: for what is left of it.
    """

    target: Target
    seconds: float
    folder: Path

    def guided(self) -> list[Path]:
        """With atheris, in a process of its own; inputs that failed.

        Raises:
            RuntimeError: atheris itself failed.
        """
        corpus, words = self.folder / "corpus", self.folder / "words"
        corpus.mkdir(parents=True, exist_ok=True)
        for seed in self.target.seeds():
            _kept(corpus, "seed", seed[:INPUT_MAX])
        words.write_text("".join(f"{line}\n" for line in _words(self.target)), encoding="ascii")
        before = self._failed()
        ended = self._run([str(corpus), f"-dict={words}", f"-artifact_prefix={self.folder}/{FAILED}-"])
        found = sorted(path for path, time_ns in self._failed().items() if before.get(path) != time_ns)
        if ended and not found:
            raise RuntimeError(f"{self.target.name}: atheris ended with {ended}, and left no input: see above")
        return found

    def _run(self, arguments: list[str]) -> int:
        limits = [
            f"-max_total_time={self.seconds:.0f}",
            f"-max_len={INPUT_MAX}",
            f"-timeout={INPUT_SECONDS}",
            f"-rss_limit_mb={MEMORY_MIB}",
            "-verbosity=0",
            "-print_final_stats=1",
        ]
        command = [sys.executable, "-m", "hil_tests.fuzz.guided", self.target.name, *arguments, *limits]
        try:
            return subprocess.run(command, check=False, timeout=self.seconds + _GRACE_S).returncode
        except subprocess.TimeoutExpired as error:
            raise RuntimeError(f"{self.target.name}: atheris does not end") from error

    def _failed(self) -> dict[Path, int]:
        """Inputs that failed so far, and when: what fails again is written again."""
        return {path: path.stat().st_mtime_ns for path in self.folder.glob(f"{FAILED}-*")}

    def unguided(self) -> list[Path]:
        """By chance, in this process; inputs that failed."""
        self.folder.mkdir(parents=True, exist_ok=True)
        end_s = time.monotonic() + self.seconds
        inputs: Iterator[bytes] = takewhile(
            lambda _: time.monotonic() < end_s, damaged_inputs(self.target, seed=time.time_ns())
        )
        failure = first_failure(self.target, inputs)
        if failure is None:
            return []
        traceback.print_exception(failure.error)
        return [_kept(self.folder, FAILED, failure.data)]


def reproduce(target: Target, path: Path) -> Exception | None:
    """Gives a target an input once more; what it raises.

    Raises:
        OSError: the file cannot be read.
    """
    try:
        checked(target, path.read_bytes())
    except Exception as error:  # whatever it is, it is what was looked for
        return error
    return None


def _kept(folder: Path, kind: str, data: bytes) -> Path:
    path = folder / f"{kind}-{sha256(data).hexdigest()[:16]}"
    path.write_bytes(data)
    return path


def _words(target: Target) -> Iterator[str]:
    """The tokens as libFuzzer reads them."""
    for token in (*EXTREMES, *target.tokens):
        if len(token) <= TOKEN_MAX:
            yield '"' + "".join(f"\\x{byte:02x}" for byte in token) + '"'

"""MAVProxy as a ground station: a process of its own without windows, its commands typed, its log read."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from struct import unpack
from types import TracebackType
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

SYSTEM_ID, COMPONENT_ID = 255, 230  # MAVProxy's own
STOP_S = 5.0
# What is needed of it: `long` sends a COMMAND_LONG, `signing` signs. Others would speak to the vehicle by themselves.
MODULES = "cmdlong,signing"
STAMP_BYTES, HEADER_BYTES, CHECKSUM_BYTES, SIGNATURE_BYTES = 8, 10, 2, 13


def program() -> Path:
    """Where MAVProxy is; it need not be there."""
    return Path(sysconfig.get_path("scripts")) / "mavproxy.py"


class GroundStation:
    """Runs between `with ...:` and its end.

    Args:
        folder: for its log and its state; it keeps nothing elsewhere.
        master: the link to the vehicle, in MAVProxy's words, e.g. "udpin:127.0.0.1:14550".
        outputs: to whom the vehicle's messages are passed on, and from whom messages are passed to the vehicle.
        target_component: of the commands that are typed.
        passphrase: signs with the SHA-256 of it; None: does not.

    Raises:
        FileNotFoundError: MAVProxy is not installed.
    """

    def __init__(
        self,
        folder: Path,
        master: str,
        outputs: Sequence[str] = (),
        target_component: int = 1,
        passphrase: str | None = None,
    ) -> None:
        if not program().exists():
            raise FileNotFoundError(f"{program()}: missing, install MAVProxy")
        self._folder = folder
        self._log = folder / "ground_station.tlog"
        self._command = [
            sys.executable,
            str(program()),
            f"--master={master}",
            *(f"--out={output}" for output in outputs),
            f"--default-modules={MODULES}",
            f"--source-system={SYSTEM_ID}",
            "--target-system=1",
            f"--target-component={target_component}",
            "--streamrate=-1",
            "--mav20",
            "--nowait",
            f"--logfile={self._log}",
            f"--state-basedir={folder}",
            "--cmd=set flushlogs True",
            *([f"--cmd=signing key {passphrase}"] if passphrase else []),
        ]
        self._process: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None
        self.output: list[str] = []

    def __enter__(self) -> GroundStation:
        self._process = subprocess.Popen(
            self._command,
            cwd=self._folder,
            env={**os.environ, "HOME": str(self._folder), "MPLBACKEND": "Agg"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, args=(self._process,), name="ground station", daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        process = self._running()
        if process.stdin is not None:
            process.stdin.close()  # as if the user closed the terminal; a signal would find it waiting for a line
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._reader is not None:
            self._reader.join()
        if process.stdout is not None:
            process.stdout.close()

    def type(self, line: str) -> None:
        """Type a command, e.g. "long 31010 3".

        Raises:
            BrokenPipeError: it does not run any more.
        """
        keyboard = self._running().stdin
        if keyboard is not None:
            keyboard.write(line + "\n")
            keyboard.flush()

    def logged(self) -> Iterator[Any]:
        """What it has logged so far, as messages of pymavlink."""
        if self._log.exists():
            yield from read_tlog(self._log.read_bytes())

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None:
            raise RuntimeError("the ground station was not started: use it in a `with` statement")
        return self._process

    def _read(self, process: subprocess.Popen[str]) -> None:
        if process.stdout is not None:
            self.output.extend(process.stdout)


def read_tlog(data: bytes) -> Iterator[Any]:
    """The MAVLink 2 messages of a telemetry log, where each stands after its time. What is cut short is left out."""
    parser = mavlink.MAVLink(None)
    parser.robust_parsing = True
    offset = 0
    while offset + STAMP_BYTES + HEADER_BYTES <= len(data):
        (time_us,) = unpack(">Q", data[offset : offset + STAMP_BYTES])
        start = offset + STAMP_BYTES
        if data[start] != mavlink.PROTOCOL_MARKER_V2:
            offset += 1
            continue
        signature = SIGNATURE_BYTES if data[start + 2] & mavlink.MAVLINK_IFLAG_SIGNED else 0
        offset = start + HEADER_BYTES + data[start + 1] + CHECKSUM_BYTES + signature
        for message in parser.parse_buffer(data[start:offset]) or []:
            message._timestamp = 1e-6 * time_us
            yield message

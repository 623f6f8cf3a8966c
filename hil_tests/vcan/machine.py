"""One run of the virtual machine: boots, runs one command on a real vcan, and ends, whatever happens."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from hil_tests.vcan.initramfs import initramfs
from hil_tests.vcan.kernel import QEMU, GuestKernel

MEMORY_MIB = 2048
_PASSED_ON = ("PATH", "HOME", "LANG", "TERM", "VIRTUAL_ENV", "PYTHONPATH")


class MachineError(Exception):
    """The machine ended, or was ended, without its command having come to an end."""


class Machine:
    """Runs `command` inside, with the host's files around it; a context manager.

    The command sees the host's root; what it writes is gone afterwards, except below `exchange`. Leaving the context
    ends the machine at once, also in mid-command; should this process be killed, the kernel ends the machine with it.

    Args:
        kernel: what to boot.
        command: program and arguments, found as in a shell.
        exchange: an empty directory, its path without blanks, that both sides see at the same path and may write to.
        directory: where the command starts; None: the current directory.
        stdin, stdout: what the command's terminal is joined to, as for `subprocess.Popen`.
    """

    def __init__(
        self,
        kernel: GuestKernel,
        command: Sequence[str],
        exchange: Path,
        *,
        directory: Path | None = None,
        stdin: int | IO[bytes] | None = subprocess.DEVNULL,
        stdout: int | IO[bytes] | None = None,
    ) -> None:
        self._kernel = kernel
        self._command = tuple(command)
        self._exchange = exchange
        self._directory = directory or Path.cwd()
        self._stdin = stdin
        self._stdout = stdout

    def __enter__(self) -> Self:
        (self._exchange / "command").write_text(_script(self._command, self._directory))
        (self._exchange / "initramfs").write_bytes(initramfs(_tool("busybox"), self._kernel.modules))
        self._process = subprocess.Popen(self._invocation(), stdin=self._stdin, stdout=self._stdout)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()

    @property
    def running(self) -> bool:
        """Whether the machine has not ended yet."""
        return self._process.poll() is None

    def wait(self, timeout_s: float | None = None) -> int:
        """Wait for the command to end; its exit status.

        Raises:
            MachineError: not ended in `timeout_s`, or ended with no exit status (the kernel's last words are told).
        """
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired as error:
            raise MachineError(f"the virtual machine had not ended after {timeout_s:.0f} s") from error
        try:
            return int((self._exchange / "exit_status").read_text())
        except (OSError, ValueError) as error:
            raise MachineError(f"the virtual machine broke down:\n{self.console()}") from error

    def console(self, lines: int = 20) -> str:
        """The last lines that the kernel and the first script wrote."""
        try:
            text = (self._exchange / "console").read_text(errors="replace")
        except OSError:
            return "(the kernel wrote nothing)"
        return "\n".join(text.splitlines()[-lines:])

    def _invocation(self) -> list[str]:
        # setpriv: the emulator gets SIGKILL from the kernel when we die, even of SIGKILL
        ended_with_us = ["setpriv", "--pdeathsig", "KILL", "--"]
        shared = "security_model=none,multidevs=remap"
        return [
            *ended_with_us, QEMU, "-nodefaults", "-no-user-config", "-display", "none", "-no-reboot",
            # software emulation even where /dev/kvm exists: in a machine that is itself virtual, kvm may hang
            "-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "2", "-m", str(MEMORY_MIB),
            "-kernel", str(self._kernel.image), "-initrd", str(self._exchange / "initramfs"),
            # tsc: read without leaving the emulated processor, a clock costs 2 us instead of 8
            "-append", f"console=ttyS0 quiet panic=-1 tsc=reliable clocksource=tsc exchange={self._exchange}",
            "-serial", f"file:{self._exchange / 'console'}",
            "-chardev", "stdio,id=terminal,signal=off", "-serial", "chardev:terminal",
            "-virtfs", f"local,path=/,mount_tag=host,readonly=on,{shared}",
            "-virtfs", f"local,path={self._exchange},mount_tag=exchange,{shared}",
        ]  # fmt: skip


def _tool(name: str) -> Path:
    found = shutil.which(name)
    if found is None:
        raise MachineError(f"{name} not found")
    return Path(found)


def _script(command: Sequence[str], directory: Path) -> str:
    """The shell script that runs inside: the command, with the parts of our environment that it may need."""
    environment = {name: os.environ[name] for name in _PASSED_ON if name in os.environ}
    environment["PYTHONDONTWRITEBYTECODE"] = "1"  # it would be written into memory, for nobody
    exports = [f"export {name}={shlex.quote(value)}" for name, value in environment.items()]
    lines = ["stty -opost", *exports, f"cd {shlex.quote(str(directory))}", f"exec {shlex.join(command)}"]
    return "\n".join(lines) + "\n"

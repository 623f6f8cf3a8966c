"""Tests that a pytest inside the virtual machine runs, and tells of while they run."""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from hil_tests.vcan.kernel import GuestKernel
from hil_tests.vcan.machine import Machine, MachineError

REPORT_OPTION = "--vcan-report"
TEST_TIMEOUT_S = 600  # for one test: everything takes 10 to 20 times longer in there
# pytest inside ends a test that hangs; who waits outside allows for boot and imports besides
_PATIENCE_S = TEST_TIMEOUT_S + 300
_POLL_S = 0.2

Report = dict[str, Any]


class GuestTests:
    """One run of a pytest inside, on some tests by name; a context manager.

    That pytest writes each of its reports, serialized, as a line of JSON to the file that REPORT_OPTION names.

    Args:
        kernel: what to boot.
        node_ids: pytest's own names of the tests, relative to `root`.
        root: pytest's root directory.
    """

    def __init__(self, kernel: GuestKernel, node_ids: Sequence[str], root: Path) -> None:
        self._kernel = kernel
        self._node_ids = tuple(node_ids)
        self._root = root
        self._resources = ExitStack()

    def __enter__(self) -> Self:
        exchange = Path(self._resources.enter_context(tempfile.TemporaryDirectory(prefix="vcan-")))
        (exchange / "tests").write_text("".join(f"{node_id}\n" for node_id in self._node_ids))
        self._output = exchange / "output"
        self._lines = self._resources.enter_context((exchange / "reports").open("x+"))
        output = self._resources.enter_context(self._output.open("wb"))
        command = [
            sys.executable,
            "-m",
            "pytest",
            "--color=no",
            "-p",
            "no:cacheprovider",
            "-o",
            f"timeout={TEST_TIMEOUT_S}",
        ]
        command += [REPORT_OPTION, self._lines.name, f"@{exchange / 'tests'}"]
        machine = Machine(self._kernel, command, exchange, directory=self._root, stdout=output)
        self._machine = self._resources.enter_context(machine)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._resources.close()

    def reports(self, node_id: str) -> Iterator[Report]:
        """The reports of one test, as they come in; to be asked for in the order that the tests were given in.

        Raises:
            MachineError: the machine, or the pytest in it, ended or hung before this test was over; its last words.
        """
        while True:
            report = self._next_report()
            if report["nodeid"] != node_id:
                raise MachineError(f"the virtual machine tells of {report['nodeid']}, {node_id} was due")
            yield report
            if report["when"] == "teardown":
                return

    def _next_report(self) -> Report:
        line, deadline_s = "", time.monotonic() + _PATIENCE_S
        while not line.endswith("\n"):
            ended = not self._machine.running  # asked first: what it wrote before its end is still read
            line += self._lines.readline()
            if line.endswith("\n"):
                break
            if ended:
                raise MachineError(f"the virtual machine ended without telling of this test:\n{self._last_words()}")
            if time.monotonic() > deadline_s:
                raise MachineError(f"no test came to an end in {_PATIENCE_S:.0f} s:\n{self._last_words()}")
            time.sleep(_POLL_S)
        report: Report = json.loads(line)
        return report

    def _last_words(self) -> str:
        said = self._output.read_text(errors="replace").splitlines()[-40:]
        return "\n".join([*said, "--- its kernel:", self._machine.console()])


def write_report(report: Report, file: IO[str]) -> None:
    """Tell of one report, at once: the other side of `GuestTests.reports`."""
    file.write(json.dumps(report) + "\n")
    file.flush()

"""What was on the bus and on the link during a play, in files that `gateway replay` and everybody's tools read."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.can.frame import CanFrame
from drivers.logs.candump_writer import candump_line
from drivers.logs.tlog_writer import tlog_records

HEARD, SAID = "heard.tlog", "said.tlog"


class Recorder:
    """Writes a candump log for each bus, and the packets that the gateway heard and said as MAVLink telemetry logs.

    Args:
        folder: exists; files of an earlier play are replaced.

    Raises:
        OSError: it cannot be written to.
    """

    def __init__(self, folder: Path) -> None:
        self._files = ExitStack()
        self._heard, self._said = (self._files.enter_context((folder / name).open("wb")) for name in (HEARD, SAID))
        self._candump = self._files.enter_context((folder / "can.log").open("w", encoding="ascii"))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all files."""
        self._files.close()

    def frames(self, bus: str, frames: Iterable[CanFrame]) -> None:
        """Frames that are on the bus where the gateway listens, in order."""
        self._candump.writelines(candump_line(bus, frame) for frame in frames)

    def heard(self, time_s: float, data: bytes) -> None:
        """Came to the gateway over its link."""
        self._heard.writelines(tlog_records(time_s, data))

    def said(self, time_s: float, data: bytes) -> None:
        """Came from the gateway."""
        self._said.writelines(tlog_records(time_s, data))

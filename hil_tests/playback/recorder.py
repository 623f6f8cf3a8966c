"""What was on the bus and on the link during a play, in files that `gateway replay` and everybody's tools read."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.can.frame import CanFrame
from drivers.mavlink.encoder import frames_of
from drivers.mavlink.frames import MAGIC_1, MAGIC_2

HEARD, SAID = "heard.tlog", "said.tlog"
_STAMP = struct.Struct(">Q")  # of a .tlog: microseconds, big-endian, before each packet


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
        self._candump.writelines(_candump_line(bus, frame) for frame in frames)

    def heard(self, time_s: float, data: bytes) -> None:
        """Came to the gateway over its link."""
        self._heard.writelines(_records(time_s, data))

    def said(self, time_s: float, data: bytes) -> None:
        """Came from the gateway."""
        self._said.writelines(_records(time_s, data))


def _candump_line(bus: str, frame: CanFrame) -> str:
    """As `candump -L` writes it; an error frame is one whose identifier has bit 29."""
    identifier = frame.identifier | (0x2000_0000 if frame.error else 0)
    digits = 8 if frame.extended or frame.error else 3
    middle = "##0" if frame.fd else "#"
    return f"({frame.time_s:.6f}) {bus} {identifier:0{digits}X}{middle}{frame.data.hex().upper()}\n"


def _records(time_s: float, data: bytes) -> Iterable[bytes]:
    """One record for each packet; what is none stands in a record of its own."""
    stamp = _STAMP.pack(round(1e6 * time_s))
    whole = data[:1] in (bytes([MAGIC_1]), bytes([MAGIC_2]))
    packets = list(frames_of(data)) if whole else []
    if b"".join(packets) != data:
        packets = [data]
    for packet in packets:
        yield stamp
        yield packet

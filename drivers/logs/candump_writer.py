"""Frames as can-utils' candump writes them into files (`candump -l`): for everybody's tools."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.can.frame import CanFrame
from drivers.can.frame_block import ERROR, EXTENDED, FD, FrameBlock

# linux/can.h: this bit of the identifier marks what the controller has to say of an error
_ERROR_FLAG = 0x2000_0000


def candump_line(interface: str, frame: CanFrame) -> str:
    """A frame, with the end of its line."""
    return _line(
        interface, frame.time_s, frame.identifier, frame.data.hex().upper(), frame.extended, frame.fd, frame.error
    )


def candump_lines(interface: str, block: FrameBlock) -> Iterator[str]:
    """The lines of a block."""
    columns = (block.time_s, block.identifier, block.kind, block.length)
    data, digits = block.data.tobytes().hex().upper(), 2 * block.data.shape[1]
    starts = range(0, len(data), digits)
    for start, time_s, identifier, kind, length in zip(starts, *(one.tolist() for one in columns), strict=True):
        flags = (bool(kind & EXTENDED), bool(kind & FD), bool(kind & ERROR))
        yield _line(interface, time_s, identifier, data[start : start + 2 * length], *flags)


def _line(interface: str, time_s: float, identifier: int, data: str, extended: bool, fd: bool, error: bool) -> str:
    stated = identifier | _ERROR_FLAG if error else identifier
    digits = 8 if extended or error else 3
    middle = "##0" if fd else "#"
    return f"({time_s:.6f}) {interface} {stated:0{digits}X}{middle}{data}\n"

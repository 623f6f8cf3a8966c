"""A CAN log of any format, told apart by what is in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from drivers.can.frame_block import FrameBlock
from drivers.logs.asc import is_asc, read_asc
from drivers.logs.blf import is_blf, read_blf
from drivers.logs.candump import is_candump, read_candump
from drivers.logs.damage import DamageReport
from drivers.logs.text_log import head_of_text, not_a_log
from drivers.logs.time_spikes import without_spikes
from drivers.logs.trc import is_trc, read_trc

Reader = Callable[[Path, DamageReport], Iterator[tuple[str, FrameBlock]]]

_BY_CONTENT: tuple[tuple[Callable[[bytes], bool], Reader], ...] = (
    (is_blf, read_blf),
    (is_trc, read_trc),
    (is_asc, read_asc),
    (is_candump, read_candump),
)
_BY_SUFFIX: dict[str, Reader] = {".log": read_candump, ".asc": read_asc, ".trc": read_trc}


def open_can_log(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    """Name of an interface and some of its frames, again and again, each interface's in the order of the log.

    A block spans about as much time as those of the other interfaces that come with it: logs are read in pieces.

    Args:
        path: a log of candump, an ASC, BLF or TRC file; all but BLF gzip or not. What is in it decides; of an empty
            one, its suffix.
        damage: told what is lost; also frames that are left out for their times alone, see `time_spikes`.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no such log; the message says what it looks like.
    """
    reader = _reader(head_of_text(path), path)
    if reader is None:
        raise not_a_log(path, "CAN log (candump, ASC, BLF or TRC)")
    return without_spikes(reader(path, damage), damage)


def _reader(head: bytes, path: Path) -> Reader | None:
    if not head.strip():
        return _BY_SUFFIX.get(Path(path.name.removesuffix(".gz")).suffix.lower())
    return next((reader for is_kind, reader in _BY_CONTENT if is_kind(head)), None)

"""What a file is by its first bytes, for those who were given a wrong one."""

from __future__ import annotations

HEAD_BYTES = 256  # enough to tell

_MAGICS: tuple[tuple[bytes, str], ...] = (
    (b"\xa3\x95", "an ArduPilot dataflash log (.BIN)"),
    (b"FMT, ", "an ArduPilot dataflash log converted to text (.log)"),
    (b"ULog\x01\x12\x35", "a PX4 log (.ulg)"),
    (b"LOGG", "a Vector BLF log"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"PK\x03\x04", "a zip archive"),
    (b";$FILEVERSION", "a PEAK TRC log"),
    (b"date ", "a Vector ASC log"),
    (b"MDF ", "an ASAM MDF log (.mf4)"),
    (b"SQLite format 3", "an SQLite database"),
)
_MAVLINK_MAGICS = (0xFE, 0xFD)
_STAMP_BYTES = 8  # before each packet of a tlog


def looks_like(head: bytes) -> str:
    """What begins like this, in words.

    Args:
        head: the first `HEAD_BYTES` of a file, or all of it.
    """
    if not head:
        return "an empty file"
    for magic, words in _MAGICS:
        if head.startswith(magic):
            return words
    if head[_STAMP_BYTES : _STAMP_BYTES + 1] and head[_STAMP_BYTES] in _MAVLINK_MAGICS:
        return "a MAVLink log (.tlog)"
    if head[0] in _MAVLINK_MAGICS:
        return "a MAVLink stream without times"
    return "text" if _is_text(head) else f"unknown ({head[:8].hex(' ')} ...)"


def _is_text(head: bytes) -> bool:
    return all(32 <= byte < 127 or byte in b"\t\r\n" for byte in head)

"""Who is let in where the key is not at hand: as by `drivers.mavlink.signing`, but that signatures are believed."""

from __future__ import annotations

from drivers.mavlink.frames import Frame, is_signed
from drivers.mavlink.signing import FROM_RADIOS, UNSIGNED


class Unchecked:
    """The gate of a recorded link.

    Args:
        accept_unsigned: packets that are not signed at all are let in, too.
    """

    def __init__(self, accept_unsigned: bool) -> None:
        self._accept_unsigned = accept_unsigned

    def refusal(self, frame: Frame, packet: bytes, time_s: float) -> str:
        """See `drivers.mavlink.frames.Gate`."""
        admitted = is_signed(packet) or self._accept_unsigned or frame.message_id in FROM_RADIOS
        return "" if admitted else UNSIGNED

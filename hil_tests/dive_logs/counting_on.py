"""A recording that begins anew, without its receivers noticing: times and counters go on where they were.

MAVLink: the sender's times in the packets, and its sequence numbers. DroneCAN: uptimes of nodes, and transfer ids.
What was lost while it was recorded stays lost. Signals of a database are left as they are: a counter among them
jumps.
"""

from __future__ import annotations

from dataclasses import replace

from drivers.can.dronecan.node_status import NODE_STATUS
from drivers.can.dronecan.transfer import MESSAGE_MASK, START_OF_TRANSFER, STREAM_MASK, TRANSFER_ID_MASK
from drivers.can.frame import CanFrame
from drivers.mavlink.frames import Packet
from hil_tests.dive_logs.packet_bytes import later
from hil_tests.dive_logs.pieces import OnLink, Piece

UPTIME_BYTES = 4


class CircularCounters:
    """Counters that wrap round, one for each key.

    Args:
        modulus: what they wrap round at.
    """

    def __init__(self, modulus: int) -> None:
        self._modulus = modulus
        self._newest: dict[tuple[object, ...], int] = {}
        self._shift: dict[tuple[object, ...], int] = {}
        self._known: set[tuple[object, ...]] = set()

    def begin_anew(self) -> None:
        """All are recorded from the beginning again."""
        self._known = set()

    def met(self, key: tuple[object, ...]) -> bool:
        """Whether this one has counted since the beginning."""
        return key in self._known

    def shown(self, key: tuple[object, ...], recorded: int) -> int:
        """What is shown for what was recorded."""
        if key not in self._known:
            self._known.add(key)
            self._shift[key] = self._newest[key] + 1 - recorded if key in self._newest else 0
        shown = (recorded + self._shift[key]) % self._modulus
        self._newest[key] = shown
        return shown


class CountingOn:
    """Pieces of a recording in, the same as they would be if it had gone on out.

    Args:
        dronecan: names of the buses that speak it.
    """

    def __init__(self, dronecan: frozenset[str]) -> None:
        self._dronecan = dronecan
        self._sequences = CircularCounters(256)
        self._transfers = CircularCounters(TRANSFER_ID_MASK + 1)
        self._later_s = 0.0

    def begin_anew(self, later_s: float) -> None:
        """The recording begins again, by so much later than the first time."""
        self._sequences.begin_anew()
        self._transfers.begin_anew()
        self._later_s = later_s

    def shown(self, piece: Piece) -> Piece | None:
        """The piece; None for the rest of a transfer whose start is of the time before."""
        if isinstance(piece, OnLink):
            return OnLink(piece.time_s, self._packet(piece.packet))
        if piece.bus not in self._dronecan or piece.frame.error or not piece.frame.extended or not piece.frame.data:
            return piece
        frame = self._transfer_frame(piece.frame, piece.bus)
        return None if frame is None else replace(piece, frame=frame)

    def _packet(self, packet: Packet) -> Packet:
        sequence = self._sequences.shown((packet.system_id, packet.component_id), packet.sequence)
        if not self._later_s:
            return packet
        return later(packet, self._later_s, sequence)

    def _transfer_frame(self, frame: CanFrame, bus: str) -> CanFrame | None:
        key, tail = (bus, frame.identifier & STREAM_MASK), frame.data[-1]
        if self._later_s and not self._transfers.met(key) and not tail & START_OF_TRANSFER:
            return None
        transfer_id = self._transfers.shown(key, tail & TRANSFER_ID_MASK)
        if not self._later_s:
            return frame
        data = frame.data[:-1] + bytes([tail & ~TRANSFER_ID_MASK | transfer_id])
        return replace(frame, data=self._uptime(data) if _is_node_status(frame) else data)

    def _uptime(self, data: bytes) -> bytes:
        uptime_s = int.from_bytes(data[:UPTIME_BYTES], "little") + round(self._later_s)
        return (uptime_s % (1 << 8 * UPTIME_BYTES)).to_bytes(UPTIME_BYTES, "little") + data[UPTIME_BYTES:]


def _is_node_status(frame: CanFrame) -> bool:
    return frame.identifier & MESSAGE_MASK == NODE_STATUS.key and len(frame.data) > UPTIME_BYTES

"""DroneCAN transfers: payloads cut into CAN frames, and put together again frame by frame.

Source: DroneCAN specification, part 4 "CAN bus transport layer". Only message broadcasts on classic CAN: services and
CAN FD carry nothing that the gateway reads.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections import Counter
from dataclasses import dataclass

from drivers.can.frame import CLASSIC_DATA_BYTES, CanFilter, CanFrame

START_OF_TRANSFER = 0x80
END_OF_TRANSFER = 0x40
TOGGLE = 0x20
TRANSFER_ID_MASK = 0x1F
SOURCE_MASK = 0x7F
MESSAGE_MASK = 0x00FF_FF80  # data type, and the bit that tells a service from a message
STREAM_MASK = MESSAGE_MASK | SOURCE_MASK
# A node that was silent this long may use any transfer id, and a transfer left open this long is lost.
TRANSFER_TIMEOUT_S = 2.0
CRC_BYTES = 2
NODE_ID_MAX = 127


@dataclass(frozen=True, slots=True)
class DataType:
    """A DroneCAN message type.

    Attributes:
        identifier: data type id, 16 bits.
        signature: data type signature, 64 bits; it seeds the CRC of multi-frame transfers.
        payload_max: bytes of the longest payload.
    """

    identifier: int
    signature: int
    payload_max: int

    @property
    def key(self) -> int:
        """What `frame.identifier & MESSAGE_MASK` is for a message of this type."""
        return self.identifier << 8

    def filter(self) -> CanFilter:
        """Frames of this type from any node, at any priority."""
        return CanFilter(self.key, MESSAGE_MASK, extended=True)

    def crc(self, payload: bytes) -> int:
        """CRC-16-CCITT-FALSE over the signature, least significant byte first, and the payload."""
        return crc_hqx(payload, crc_hqx(self.signature.to_bytes(8, "little"), 0xFFFF))


def check_range(name: str, value: int, lowest: int, highest: int) -> None:
    """ValueError: a field that does not fit the wire."""
    if not lowest <= value <= highest:
        raise ValueError(f"{name} must lie in {lowest}..{highest}, got {value}")


def split(
    data_type: DataType, payload: bytes, *, source_node: int, transfer_id: int, priority: int, time_s: float
) -> list[CanFrame]:
    """Cut a payload into the frames of one transfer.

    Args:
        data_type: type of the message.
        payload: serialised message.
        source_node: 1..127.
        transfer_id: counts up from transfer to transfer of one type; its lowest 5 bits are sent.
        priority: 0 (first on the bus) .. 31.
        time_s: stamp of the frames.

    Raises:
        ValueError: node or priority out of range.
    """
    check_range("source_node", source_node, 1, NODE_ID_MAX)
    check_range("priority", priority, 0, 31)
    step = CLASSIC_DATA_BYTES - 1
    if len(payload) > step:
        payload = data_type.crc(payload).to_bytes(CRC_BYTES, "little") + payload
    chunks = [payload[i : i + step] for i in range(0, len(payload), step)] or [b""]
    identifier = priority << 24 | data_type.key | source_node
    return [
        CanFrame(time_s, identifier, chunk + bytes([_tail(i, len(chunks), transfer_id)]))
        for i, chunk in enumerate(chunks)
    ]


def _tail(index: int, count: int, transfer_id: int) -> int:
    start = START_OF_TRANSFER if index == 0 else 0
    end = END_OF_TRANSFER if index == count - 1 else 0
    toggle = TOGGLE if index % 2 else 0
    return start | end | toggle | transfer_id & TRANSFER_ID_MASK


class TransferReceiver:
    """Puts together the transfers of one data type from one node, so that a lost frame costs that node one transfer.

    Args:
        data_type: type of the messages.
        drops: counts dropped frames by cause; frames that come after a bad one count under the cause of that one.
    """

    __slots__ = ("_data_type", "_done_id", "_done_s", "_drops", "_last", "_parts", "_size", "_start_s", "_why_closed")

    def __init__(self, data_type: DataType, drops: Counter[str]) -> None:
        self._data_type = data_type
        self._drops = drops
        self._parts: list[bytes] = []  # of the open transfer; empty: none is open
        self._size = 0
        self._last = b""  # last frame taken, empty after a drop
        self._start_s = 0.0
        self._done_id = -1
        self._done_s = 0.0
        self._why_closed = "missing start"

    def accept(self, data: bytes, time_s: float) -> bytes | None:
        """Take the next frame; the payload if it completes a transfer."""
        if not data:
            self._drops["empty frame"] += 1
            return None
        tail = data[-1]
        starts = tail & START_OF_TRANSFER
        if data == self._last and (self._parts or not starts):  # CAN may deliver a frame twice; it never means two
            self._drops["repeated frame"] += 1
            return None
        cause = self._begin(tail, time_s) if starts else self._check(tail, time_s)
        if cause:
            self._close(cause)
            return None
        return self._take(data, time_s)

    def completed(self, transfer_id: int, time_s: float) -> bool:
        """Whether no transfer is open, and the last that was completed is this one."""
        return not self._parts and self._done_id == transfer_id and self._done_s == time_s

    def resume(self, last: bytes, time_s: float) -> None:
        """Go on as if it had taken the frames of a transfer that was complete with this one."""
        self._parts.clear()
        self._why_closed = "missing start"
        self._last, self._done_id, self._done_s = last, last[-1] & TRANSFER_ID_MASK, time_s

    def _begin(self, tail: int, time_s: float) -> str:
        """Open a transfer; the cause if it must not be."""
        if self._parts:
            self._close("unfinished transfer")
        if tail & TOGGLE:
            return "toggle"
        if tail & TRANSFER_ID_MASK == self._done_id and abs(time_s - self._done_s) < TRANSFER_TIMEOUT_S:
            return "repeated transfer"
        self._start_s = time_s
        self._size = 0
        return ""

    def _check(self, tail: int, time_s: float) -> str:
        """The cause why this frame does not go on with the open transfer."""
        if not self._parts:
            return self._why_closed
        changed = tail ^ self._last[-1]
        if changed & TRANSFER_ID_MASK:
            return "transfer id"
        if not changed & TOGGLE:
            return "toggle"
        if not 0.0 <= time_s - self._start_s < TRANSFER_TIMEOUT_S:
            return "timed out"
        return ""

    def _take(self, data: bytes, time_s: float) -> bytes | None:
        self._parts.append(data[:-1])
        self._size += len(data) - 1
        self._last = data
        if self._size > self._data_type.payload_max + CRC_BYTES:
            self._close("wrong length")
        elif data[-1] & END_OF_TRANSFER:
            return self._finish(time_s)
        elif len(data) < CLASSIC_DATA_BYTES:
            self._close("wrong length")
        return None

    def _finish(self, time_s: float) -> bytes | None:
        payload = b"".join(self._parts)
        if len(self._parts) > 1:
            received, payload = payload[:CRC_BYTES], payload[CRC_BYTES:]
            if self._data_type.crc(payload).to_bytes(CRC_BYTES, "little") != received:
                self._close("CRC")
                return None
        self._parts.clear()
        self._why_closed = "missing start"
        self._done_id = self._last[-1] & TRANSFER_ID_MASK
        self._done_s = time_s
        return payload

    def _close(self, cause: str) -> None:
        self._drops[cause] += 1
        self._why_closed = cause
        self._parts.clear()
        self._last = b""

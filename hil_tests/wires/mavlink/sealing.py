"""Packets with another payload or number, sealed as their senders do: length, checksum and signature are right.

A signature needs the key that the sender has, too; link id and stamp stay those of the sender's signature.
"""

from __future__ import annotations

from struct import Struct

from drivers.mavlink.formats import CRC_EXTRA, checksum
from drivers.mavlink.frames import (
    CHECKSUM_SIZE,
    FLAG_SIGNED,
    MAGIC_1,
    MAGIC_2,
    MESSAGE_ID_MASK,
    SIGNATURE_SIZE,
    Frame,
    is_signed,
)
from drivers.mavlink.signing import PROOF_SIZE, STAMP_SIZE, SigningKey

NO_KEY = "signed, not changed: no key"
UNKNOWN = "unknown message, not numbered anew"

HEADER_SIZE_1, HEADER_SIZE_2 = 6, 10
SEQUENCE_PLACE_1, SEQUENCE_PLACE_2 = 2, 4
LENGTH_PLACE = 1
MESSAGE_ID_PLACE_2 = 7


_read_start = Struct("<BBB").unpack_from  # magic byte, length, flags
_read_message_id = Struct("<I").unpack_from  # and a byte behind it
NOWHERE = -1, 1 << 32


def outline(data: bytes, start: int) -> tuple[int, int]:
    """Message id of a packet that may begin at `start`, and where it would end; `NOWHERE` where none does.

    Nothing is checked, neither that it is whole nor that it is one.
    """
    if len(data) - start < HEADER_SIZE_2 + CHECKSUM_SIZE:
        return NOWHERE
    magic, length, flags = _read_start(data, start)
    if magic == MAGIC_1:
        return data[start + HEADER_SIZE_1 - 1], start + HEADER_SIZE_1 + length + CHECKSUM_SIZE
    if magic != MAGIC_2 or flags & ~FLAG_SIGNED:
        return NOWHERE
    end = start + HEADER_SIZE_2 + length + CHECKSUM_SIZE + (SIGNATURE_SIZE if flags else 0)
    return _read_message_id(data, start + MESSAGE_ID_PLACE_2)[0] & MESSAGE_ID_MASK, end


def payload_of(packet: bytes) -> bytes:
    """The payload of a whole packet, as it is on the wire: without the zeros that MAVLink 2 cuts off."""
    header_size = HEADER_SIZE_1 if packet[0] == MAGIC_1 else HEADER_SIZE_2
    return packet[header_size : header_size + packet[LENGTH_PLACE]]


class Sealer:
    """Seals packets of all senders.

    Args:
        key: 32 bytes, of the link's signatures; None: packets that are signed cannot be sealed.
    """

    def __init__(self, key: bytes | None = None) -> None:
        self._key = None if key is None else SigningKey(key)

    def why_not(self, packet: bytes, frame: Frame) -> str:
        """Why a packet cannot be changed and still be believed: `NO_KEY` or `UNKNOWN`; "": it can."""
        if frame.message_id not in CRC_EXTRA:
            return UNKNOWN
        return NO_KEY if self._key is None and is_signed(packet) else ""

    def sealed(self, packet: bytes, frame: Frame, payload: bytes, sequence: int) -> bytes:
        """The packet with another payload and another number; nothing may be against it, see `why_not`.

        Args:
            packet: as its sender sealed it.
            frame: its header.
            payload: as `payload_of` gives it, or longer: of full size.
            sequence: 0 to 255.
        """
        if packet[0] == MAGIC_1:
            size = packet[LENGTH_PLACE]  # in MAVLink 1 the length never changes
            head = bytearray(packet[:HEADER_SIZE_1])
            head[SEQUENCE_PLACE_1] = sequence
            return self._checked(bytes(head) + payload[:size].ljust(size, b"\0"), frame)
        payload = payload.rstrip(b"\0") or b"\0"
        head = bytearray(packet[:HEADER_SIZE_2])
        head[LENGTH_PLACE], head[SEQUENCE_PLACE_2] = len(payload), sequence
        return self._signed(packet, self._checked(bytes(head) + payload, frame))

    def _checked(self, body: bytes, frame: Frame) -> bytes:
        return body + checksum(body[1:], CRC_EXTRA[frame.message_id]).to_bytes(CHECKSUM_SIZE, "little")

    def _signed(self, before: bytes, unsigned: bytes) -> bytes:
        if self._key is None or not is_signed(before):
            return unsigned
        signed = unsigned + before[-PROOF_SIZE - STAMP_SIZE - 1 : -PROOF_SIZE]  # link id and stamp
        return signed + self._key.proof(signed)


class Numbering:
    """Sequence numbers of senders that would have sent less: without a gap where something was withheld."""

    def __init__(self) -> None:
        self._withheld: dict[tuple[int, int], int] = {}

    def withhold(self, frame: Frame) -> None:
        """A packet of this sender is not sent."""
        sender = frame.system_id, frame.component_id
        self._withheld[sender] = self._withheld.get(sender, 0) + 1

    def number(self, frame: Frame) -> int:
        """Sequence number of a packet that is sent."""
        return (frame.sequence - self._withheld.get((frame.system_id, frame.component_id), 0)) & 0xFF

    @property
    def changed(self) -> bool:
        """Whether anything was withheld at all."""
        return bool(self._withheld)

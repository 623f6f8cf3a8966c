"""MAVLink 2 message signing: which packets are rightly signed, and the signature on all that we send.

A signature is a link id, a 48-bit time stamp in units of 10 us since 2015, and the first 48 bits of the SHA-256 of
key, packet, link id and stamp (mavlink.io, "Message Signing"). It proves that the sender has the key; the stamps keep
recorded packets from being played again. The rules for stamps:

- Within a stream (system, component, link id) they rise, packet by packet.
- A new stream begins at most a minute behind our own clock.
- Our clock of stamps is the machine's, put forward to the highest stamp that was accepted: under water and without a
  GNSS, autopilots and companions often know the time only from each other.
- Neither ours nor theirs goes beyond what can be true: stamps cannot be taken back, and they end in 2104.
- Our own rise over restarts, too, even where the machine wakes up in 1970: see `SigningHistory`.

The key is looked at before the stamps, so that what is counted as played again was once rightly signed.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NoReturn

from drivers.mavlink.formats import CRC_EXTRA, checksum
from drivers.mavlink.frames import CHECKSUM_SIZE, FLAG_SIGNED, MAGIC_2, Frame, frame_at, is_signed

KEY_SIZE = 32
PROOF_SIZE = 6  # of the SHA-256
STAMP_SIZE = 6

EPOCH_S = 1_420_070_400  # 2015-01-01 00:00:00 UTC
TICKS_PER_S = 100_000
STAMP_END = 2**48
# A machine's clock that is beyond this (2059) is not believed: there must always be stamps left above it.
MACHINE_STAMP_MAX = 2**47
MINUTE = 60 * TICKS_PER_S
# A companion without a battery for its clock may believe it is 1970; this program is no older than that.
YOUNGEST = (1_767_225_600 - EPOCH_S) * TICKS_PER_S  # 2026-01-01
# How far ahead a peer can rightly be: our clock may have stood still while the vehicle was laid up.
AHEAD_MAX = 10 * 365 * 86_400 * TICKS_PER_S
# Ours that may go out until the history is kept again
RESERVED = 2 * MINUTE
RESERVED_PACKETS = 100_000
# More sources than a vehicle has; only who has the key can open one.
STREAMS_MAX = 256

UNSIGNED = "unsigned"
WRONG_KEY = "wrong key"
REPLAYED = "played again or late"
TOO_OLD = "signed too long ago"
FUTURE = "signed in the far future"
TOO_MANY = "too many signed streams"
REFUSALS = (UNSIGNED, WRONG_KEY, REPLAYED, TOO_OLD, FUTURE, TOO_MANY)

# RADIO, RADIO_STATUS: telemetry radios put them in between and have no key. Nothing here reads them.
FROM_RADIOS = frozenset({166, 109})

Stream = tuple[int, int, int]


class SigningKey:
    """The secret that all who may speak share. It shows itself in no text, and cannot be pickled.

    Args:
        secret: 32 bytes.

    Raises:
        ValueError: another size, or all zeros, by which autopilots mean that there is no key.
    """

    __slots__ = ("_begun",)

    def __init__(self, secret: bytes) -> None:
        if len(secret) != KEY_SIZE:
            raise ValueError(f"a signing key has {KEY_SIZE} bytes, got {len(secret)}")
        if not any(secret):
            raise ValueError("a signing key of zeros means none to autopilots: want a random one")
        self._begun = hashlib.sha256(secret)

    @classmethod
    def from_passphrase(cls, passphrase: str) -> SigningKey:
        """The key that MAVProxy, Mission Planner and QGroundControl make of a passphrase: its SHA-256."""
        return cls(hashlib.sha256(passphrase.encode()).digest())

    def proof(self, data: bytes) -> bytes:
        """Six bytes that only who has the key can make of `data`."""
        digest = self._begun.copy()
        digest.update(data)
        return digest.digest()[:PROOF_SIZE]

    def __repr__(self) -> str:
        return "SigningKey(not shown)"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a signing key is not pickled: read it from its file")


@dataclass(frozen=True, slots=True)
class SigningHistory:
    """What must outlast a restart, lest stamps come twice.

    Attributes:
        clock: our clock of stamps when this was taken.
        reserved: the highest stamp that may have gone out, even if the program died before it told again.
        streams: the newest stamp of each stream (system, component, link id) that was heard.

    Raises:
        ValueError: a stamp or an id out of its range.
    """

    clock: int = 0
    reserved: int = 0
    streams: Mapping[Stream, int] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        for name, stamp in (("clock", self.clock), ("reserved", self.reserved), *self.streams.items()):
            if not _whole(stamp, STAMP_END):
                raise ValueError(f"{name} must be a stamp in 0..{STAMP_END - 1}, got {stamp!r}")
        for stream in self.streams:
            if len(stream) != 3 or not all(_whole(number, 256) for number in stream):
                raise ValueError(f"streams must be (system, component, link id), each in 0..255, got {stream}")

    def believable(self, time_s: float) -> bool:
        """False if one of its stamps lies further ahead than anything can at `time_s` (unix)."""
        return max((self.clock, self.reserved, *self.streams.values())) <= latest_stamp(time_s)


def _whole(value: object, end: int) -> bool:
    return type(value) is int and 0 <= value < end


def stamp_of(time_s: float) -> int:
    """Stamp of a unix time by the machine's clock; what no clock can rightly say is the nearest that it can."""
    return max(0, _ticks(time_s))


def _ticks(time_s: float) -> int:
    """The same, below zero before 2015: a machine that believes it is 1970 goes on evenly, too."""
    return min(int((time_s - EPOCH_S) * TICKS_PER_S), MACHINE_STAMP_MAX)


def latest_stamp(time_s: float) -> int:
    """The highest stamp that may be true when the machine's clock says `time_s` (unix)."""
    return max(stamp_of(time_s), YOUNGEST) + AHEAD_MAX


class Signing:
    """One link's signatures, in and out.

    Args:
        key: shared with all who may speak on the link.
        time_s: now, unix.
        link_id: in our own signatures, 0..255.
        accept_unsigned: take packets that are not signed at all. Wrongly signed ones are refused all the same.
        history: of the run before this one.

    Raises:
        ValueError: `link_id` out of its range, or a history that is not believable.
    """

    def __init__(
        self,
        key: SigningKey,
        time_s: float,
        link_id: int = 0,
        accept_unsigned: bool = False,
        history: SigningHistory | None = None,
    ) -> None:
        if not 0 <= link_id <= 255:
            raise ValueError(f"link_id must lie in 0..255, got {link_id}")
        history = history or SigningHistory()
        if not history.believable(time_s):
            raise ValueError(f"history must not lie in the far future of unix time {time_s:.0f} s, got {history}")
        self._key = key
        self._link_id = bytes((link_id,))
        self._accept_unsigned = accept_unsigned
        self._ahead = max(0, history.clock - _ticks(time_s))  # of the machine's clock
        self._sent = history.reserved
        self._streams = dict(history.streams)

    def clock(self, time_s: float) -> int:
        """Our clock of stamps at the unix time `time_s`."""
        return max(0, _ticks(time_s) + self._ahead)

    def history(self, time_s: float, reserve: bool = True) -> SigningHistory:
        """What the next run must know.

        Args:
            time_s: now, unix.
            reserve: leave room for what is sent in the next two minutes; False if nothing more will be.
        """
        clock = self.clock(time_s)
        reserved = max(clock + RESERVED, self._sent + RESERVED_PACKETS) if reserve else self._sent
        return SigningHistory(clock, reserved, dict(self._streams))

    def sign(self, packet: bytes, time_s: float) -> bytes:
        """An unsigned MAVLink 2 packet with our signature.

        Raises:
            ValueError: it is not one.
        """
        frame = frame_at(packet, 0) if packet[:1] == bytes((MAGIC_2,)) else None
        if frame is None or frame.end != len(packet) or is_signed(packet):
            raise ValueError(f"want one unsigned MAVLink 2 packet, got {len(packet)} bytes of something else")
        body = packet[:2] + bytes((packet[2] | FLAG_SIGNED,)) + packet[3:-CHECKSUM_SIZE]
        crc = checksum(body[1:], CRC_EXTRA[frame.message_id])
        self._sent = max(self._sent + 1, self.clock(time_s))
        stamp = self._sent.to_bytes(STAMP_SIZE, "little")
        signed = body + crc.to_bytes(CHECKSUM_SIZE, "little") + self._link_id + stamp
        return signed + self._key.proof(signed)

    def refusal(self, frame: Frame, packet: bytes, time_s: float) -> str:
        """Why a packet must not be read: one of `REFUSALS`, "" for none.

        Args:
            frame: its header.
            packet: the whole of it.
            time_s: reception, unix.
        """
        if not is_signed(packet):
            return "" if self._accept_unsigned or frame.message_id in FROM_RADIOS else UNSIGNED
        proof, stamp = packet[-PROOF_SIZE:], packet[-PROOF_SIZE - STAMP_SIZE : -PROOF_SIZE]
        if not hmac.compare_digest(self._key.proof(packet[:-PROOF_SIZE]), proof):
            return WRONG_KEY
        link_id = packet[-PROOF_SIZE - STAMP_SIZE - 1]
        return self._admit((frame.system_id, frame.component_id, link_id), int.from_bytes(stamp, "little"), time_s)

    def _admit(self, stream: Stream, stamp: int, time_s: float) -> str:
        """Whether a rightly signed packet comes in its time; if so, stream and clock follow it."""
        clock, newest = self.clock(time_s), self._streams.get(stream)
        if stamp > clock and stamp > latest_stamp(time_s):
            return FUTURE
        if newest is not None and stamp <= newest:
            return REPLAYED
        if newest is None and stamp < clock - MINUTE:
            return TOO_OLD
        if newest is None and len(self._streams) >= STREAMS_MAX:
            return TOO_MANY
        self._streams[stream] = stamp
        self._ahead += max(0, stamp - clock)
        return ""

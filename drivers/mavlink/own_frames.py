"""Packets with our own ids: our frames coming back, or another program that uses the same ids.

Routers and ground stations send on what they get, to us as well. A frame is known again by its sequence number,
message and payload, which every router leaves as they are, and by coming soon. What is not known again was sent by
somebody else; once, that may have been the run before this one: it takes several, over a while.
"""

from __future__ import annotations

from collections import Counter
from math import inf

from drivers.mavlink.encoder import frames_of
from drivers.mavlink.frames import Packet, frame_at
from drivers.readings import IdentityConflict

# Routes take seconds at the very most; sequence numbers come again after ten or more.
ECHO_S = 10.0
KEPT = 1024
STRANGE_MIN = 3
STRANGE_OVER_S = 2.0
REPEAT_S = 10.0

_Key = tuple[int, int, bytes]


class OwnFrames:
    """What we sent of late, and what came with our ids without being of it.

    Args:
        drops: counted here: "our own, coming back" and "another's, with our ids".
    """

    def __init__(self, drops: Counter[str]) -> None:
        self._drops = drops
        self._sent: dict[_Key, float] = {}
        self._strange = 0
        self._since_s = self._newest_s = self._said_s = -inf

    def sent(self, data: bytes, time_s: float) -> None:
        """Takes frames that are sent now, one after the other."""
        for one in frames_of(data):
            if (frame := frame_at(one, 0)) is not None:
                key = _key(frame.sequence, frame.message_id, one[frame.payload_start : frame.payload_end])
                self._sent.pop(key, None)
                self._sent[key] = time_s
        while len(self._sent) > KEPT:
            del self._sent[next(iter(self._sent))]

    def take(self, packet: Packet, time_s: float) -> list[IdentityConflict]:
        """Takes a packet with our ids; a conflict once there is no doubt, and every 10 s while it goes on."""
        sent_s = self._sent.get(_key(packet.sequence, packet.message_id, packet.payload), -inf)
        if time_s - sent_s <= ECHO_S:
            self._drops["our own, coming back"] += 1
            return []
        self._drops["another's, with our ids"] += 1
        if time_s - self._newest_s > REPEAT_S:
            self._strange, self._since_s = 0, time_s
        self._strange, self._newest_s = self._strange + 1, time_s
        certain = self._strange >= STRANGE_MIN and time_s - self._since_s >= STRANGE_OVER_S
        if not certain or time_s - self._said_s < REPEAT_S:
            return []
        self._said_s = time_s
        return [IdentityConflict(time_s, packet.system_id, packet.component_id)]


def _key(sequence: int, message_id: int, payload: bytes) -> _Key:
    """Whoever sends a frame on may cut the zeros at its end off, or put them back."""
    return sequence, message_id, payload.rstrip(b"\0")

"""One direction of a link on which sensors have faults.

What comes out looks as if its senders had sent it so: checksums and signatures are right, and where a message is
withheld the numbers go on without a gap, from then on. Only packets that are signed with a key that is not known stay
as they are, numbers and all; they can but be withheld. Packets that came in one datagram leave in one. One that may
have to be changed waits until it is whole; all other bytes go on at once.
"""

from __future__ import annotations

from collections import Counter

from drivers.mavlink.frames import Frame
from hil_tests.wires.mavlink.packet_stream import PacketStream, Stretch
from hil_tests.wires.mavlink.payload_faults import Draft, PayloadFaults
from hil_tests.wires.mavlink.sealing import Numbering, Sealer, outline, payload_of


class ChangedStream:
    """See the module's text.

    Args:
        faults: of the signals on it.
        sealer: of changed packets.
        counts: what is done is counted here.
    """

    def __init__(self, faults: PayloadFaults, sealer: Sealer, counts: Counter[str]) -> None:
        self._faults = faults
        self._sealer = sealer
        self._counts = counts
        self._numbering = Numbering()
        self._stream = PacketStream()

    @property
    def release_s(self) -> float:
        """When what waits for the rest of its packet has waited for too long; infinity: nothing does."""
        return self._stream.release_s

    def release(self) -> bytes:
        """What has waited for too long: it goes on as it is."""
        return self._stream.release()

    def take(self, time_s: float, since_s: float, item: bytes) -> bytes:
        """What is sent instead of these bytes: the same object where nothing changes; empty: nothing, for now.

        Args:
            time_s: now, unix; does not go back.
            since_s: the same, as seconds since the start.
            item: what came at once.
        """
        if self._is_of_no_interest(item):
            return item
        waiting = self._stream.holding
        stretches = self._stream.feed(item, time_s, lambda frame: self._holds(frame, since_s))
        said = [self._said(stretch, since_s) for stretch in stretches]
        same = all(new is stretch.data for new, stretch in zip(said, stretches, strict=True))
        return item if same and not waiting and not self._stream.holding else b"".join(said)

    def _is_of_no_interest(self, item: bytes) -> bool:
        """Whether these are whole packets without a signal that has faults: nearly all are.

        Only their lengths are looked at. Damaged ones may be among them, but all go on as they are anyway.
        """
        message_ids = self._faults.message_ids
        if not message_ids:
            return True
        if self._stream.begun or self._numbering.changed:
            return False
        place, size = 0, len(item)
        while place < size:
            message_id, place = outline(item, place)
            if message_id in message_ids:
                return False
        return place == size

    def _holds(self, frame: Frame | None, since_s: float) -> bool:
        """Whether a packet that is not whole yet may have to be changed."""
        if self._numbering.changed:
            return True
        return self._faults.active(since_s) and (frame is None or frame.message_id in self._faults.message_ids)

    def _said(self, stretch: Stretch, since_s: float) -> bytes:
        packet, frame = stretch.packet, stretch.frame
        if packet is None or frame is None:
            return stretch.data
        payload = payload_of(packet)
        concerned = frame.message_id in self._faults.message_ids
        draft = self._faults.draft(since_s, frame, payload) if concerned else Draft(payload)
        if not stretch.whole:
            return stretch.data  # its head has gone already: no fault was there then
        return self._sent(packet, frame, payload, draft)

    def _sent(self, packet: bytes, frame: Frame, payload: bytes, draft: Draft) -> bytes:
        unsealable = self._sealer.why_not(packet, frame)
        if draft.payload is None:
            self._counts.update(draft.causes)
            if not unsealable:
                self._numbering.withhold(frame)
            return b""
        sequence = self._numbering.number(frame)
        if draft.payload is payload and sequence == frame.sequence:
            return packet
        if unsealable:
            self._counts[unsealable] += 1
            return packet
        self._counts.update(draft.causes)
        return self._sealer.sealed(packet, frame, draft.payload, sequence)

"""A wire that is listened to: what the gateway says to a real autopilot, and how that one's mode is."""

from __future__ import annotations

from collections import Counter

from drivers.mavlink import formats
from drivers.mavlink.frames import FrameScanner
from hil_tests.playback.listening import HeardModes, Listener
from hil_tests.playback.recorder import Recorder
from hil_tests.rig.notes import Notes
from hil_tests.rig.truth import ModeChange
from hil_tests.wires.way import Passed, Towards, Wire

WANTED = (formats.HEARTBEAT.message_id, formats.COMMAND_ACK.message_id)


class TappedWire:
    """A MAVLink wire that passes everything on, and keeps what expectations are held against.

    Args:
        wire: the one that is listened to.
        recorder: of what comes out at its ends.
        key: 32 bytes; what is not signed with it is not noted. None: everything is.

    Attributes:
        counts: see Wire.
    """

    def __init__(self, wire: Wire[bytes], recorder: Recorder, key: bytes | None) -> None:
        self.counts = wire.counts
        self._wire, self._recorder = wire, recorder
        self._modes, self._listener = HeardModes(), Listener(key)
        self._scanner = FrameScanner(WANTED, Counter())

    @property
    def notes(self) -> Notes:
        """What has come to the autopilot."""
        return self._listener.notes

    @property
    def modes(self) -> list[ModeChange]:
        """Of the autopilot."""
        return self._modes.modes

    def truth(self) -> None:
        """Nobody knows what really was."""
        return

    def put(self, time_s: float, item: bytes, towards: Towards) -> None:
        """See Wire."""
        if towards is Towards.GATEWAY:
            self._hear_autopilot(time_s, item)
        self._wire.put(time_s, item, towards)

    def due(self, time_s: float) -> list[Passed[bytes]]:
        """See Wire."""
        passed = self._wire.due(time_s)
        for one in passed:
            if one.towards is Towards.AUTOPILOT:
                self._recorder.said(time_s, one.item)
                self._listener.hear(time_s, one.item, self._modes.system_id)
            else:
                self._recorder.heard(time_s, one.item)
        return passed

    def next_s(self) -> float:
        """See Wire."""
        return self._wire.next_s()

    def _hear_autopilot(self, time_s: float, data: bytes) -> None:
        for packet in self._scanner.feed(data, time_s):
            if packet.message_id == formats.HEARTBEAT.message_id:
                self._modes.take(packet, time_s)
            else:
                command, result, *_ = formats.COMMAND_ACK.unpack(packet.payload)
                self._listener.answered(command, result)

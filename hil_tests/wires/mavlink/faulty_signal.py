"""One signal with all its faults, for every sender that tells it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, isfinite
from zlib import crc32

from hil_tests.scenario.fault import Fault
from hil_tests.wires.distortion import Distortion
from hil_tests.wires.mavlink.signal import Signal


class Outcome(StrEnum):
    """What has become of a signal in a payload; the values are words for counts."""

    AS_IT_WAS = ""
    CHANGED = "changed"
    WITHHELD = "withheld"


@dataclass(slots=True)
class _Told:
    """What one sender tells.

    Attributes:
        distortion: of its values.
        payload: that was sent last with a value; None: none was.
    """

    distortion: Distortion
    payload: bytes | None = None


class FaultySignal:
    """A signal and its faults.

    Args:
        signal: of one message.
        faults: of it, in their order.
        seed: of all chance in them.
    """

    def __init__(self, signal: Signal, faults: Sequence[Fault], seed: int) -> None:
        self.signal = signal
        self._faults = [replace(fault, until_s=inf) if fault.failure == "reset" else fault for fault in faults]
        self._unlocking = [fault for fault in faults if fault.failure == "no_lock"]
        self._seed = seed
        self._senders: dict[tuple[int, int], _Told] = {}

    @property
    def words(self) -> str:
        """Whose signal it is."""
        return self._faults[0].subject.name

    def active(self, since_s: float) -> bool:
        """Whether any of its faults is there."""
        return any(fault.active(since_s) for fault in self._faults)

    def put(self, since_s: float, sender: tuple[int, int], payload: bytes, draft: bytearray) -> Outcome:
        """Take the next payload; every one is needed, those before the onset as well.

        Args:
            since_s: seconds since the start.
            sender: system and component.
            payload: as it came, of full size.
            draft: what is to be sent instead, so far.
        """
        value = self.signal.read(payload)
        if value is None or not all(map(isfinite, value)):
            return Outcome.AS_IT_WAS
        told = self._senders.get(sender) or self._new(sender)
        said = told.distortion.value(since_s, value)
        if said is None:
            told.payload = told.payload or payload
            return Outcome.CHANGED if self.signal.silence(draft, told.payload) else Outcome.WITHHELD
        unlocked = any(fault.active(since_s) for fault in self._unlocking)
        if said == value and not unlocked:
            told.payload = payload
            return Outcome.AS_IT_WAS
        self.signal.write(draft, said)
        told.payload = bytes(draft)
        return Outcome.WITHHELD if unlocked and not self.signal.lose_lock(draft) else Outcome.CHANGED

    def _new(self, sender: tuple[int, int]) -> _Told:
        """Each sender's chance is its own, and the same in each run."""
        place = crc32(repr((self.signal.message.message_id, sender, self._seed)).encode())
        self._senders[sender] = _Told(Distortion(self._faults, place))
        return self._senders[sender]

"""All signals that have faults, put to the payloads of the messages that carry them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

from drivers.mavlink.frames import Frame
from gateway.config import Config
from hil_tests.scenario.fault import Fault, Subject
from hil_tests.wires.mavlink.catalogue import signals
from hil_tests.wires.mavlink.faulty_signal import FaultySignal, Outcome


class Draft(NamedTuple):
    """What a payload has become.

    Attributes:
        payload: the very object that came where nothing is changed; None: the message is not sent.
        causes: whose fault that is, for counts.
    """

    payload: bytes | None
    causes: Sequence[str] = ()


class PayloadFaults:
    """The faults of all signals on one direction of a link.

    Args:
        faults: those of what is on no MAVLink link are left to others.
        seed: of all chance.
        config: of the gateway, see `hil_tests.wires.mavlink.catalogue`.

    Attributes:
        message_ids: of the messages that carry any of the signals.
    """

    def __init__(self, faults: Sequence[Fault], seed: int = 0, config: Config | None = None) -> None:
        by_subject: defaultdict[Subject, list[Fault]] = defaultdict(list)
        for fault in faults:
            by_subject[fault.subject].append(fault)
        self._by_message: defaultdict[int, list[FaultySignal]] = defaultdict(list)
        for subject, its_faults in by_subject.items():
            for place, signal in enumerate(signals(subject, config)):
                self._by_message[signal.message.message_id].append(FaultySignal(signal, its_faults, seed + place))
        self._all = [one for several in self._by_message.values() for one in several]
        self.message_ids = frozenset(self._by_message)

    def active(self, since_s: float) -> bool:
        """Whether any of the faults is there."""
        return any(one.active(since_s) for one in self._all)

    def draft(self, since_s: float, frame: Frame, payload: bytes) -> Draft:
        """What becomes of the next payload; every one of `message_ids` is needed, whether a fault is there or not.

        Args:
            since_s: seconds since the start; does not go back.
            frame: header of its packet.
            payload: as it was on the wire, zeros at its end cut off or not.
        """
        faulty = self._by_message[frame.message_id]
        sender = frame.system_id, frame.component_id
        full = payload.ljust(faulty[0].signal.message.payload.size, b"\0")
        draft = bytearray(full)
        outcomes = [(one.words, one.put(since_s, sender, full, draft)) for one in faulty]
        causes = [f"{words} {outcome}" for words, outcome in outcomes if outcome is not Outcome.AS_IT_WAS]
        if any(outcome is Outcome.WITHHELD for _, outcome in outcomes):
            return Draft(None, causes)
        return Draft(bytes(draft), causes) if causes else Draft(payload)

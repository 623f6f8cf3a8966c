"""A second device that speaks with the node id, or the identifiers, of another: as two ESCs that were not told apart.

It says as often what the first one says, at instants of its own: it is up since the onset, its motor stands still,
and it counts its transfers and its frames by itself.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from drivers.can.dronecan.esc_status import ESC_STATUS, pack_status, unpack_status
from drivers.can.dronecan.node_status import NODE_STATUS, pack_node_status, unpack_node_status
from drivers.can.dronecan.transfer import MESSAGE_MASK, SOURCE_MASK, DataType, TransferReceiver, split
from drivers.can.frame import CanFrame
from hil_tests.scenario.fault import Fault
from hil_tests.wires.frame_faults import Due
from hil_tests.wires.message_edits import EditedMessage, slot_of_speed
from hil_tests.wires.protection import Seal
from hil_tests.wires.transfer_edits import PRIORITY_MASK, PRIORITY_SHIFT
from hil_tests.wires.way import Towards

# Frames of one transfer follow each other so closely: eight bytes of data at 1 Mbit/s.
FRAME_S = 0.00014
# It speaks neither with the first one nor just before him, so that frames of two transfers are seldom mixed.
EARLIEST, LATEST = 0.1, 0.9
SPOKEN = "frames of a second device"


class SecondNode:
    """One on a DroneCAN bus: NodeStatus and esc.Status.

    Args:
        fault: "node_conflict".
        seed: of the instants at which it speaks.
        counts: its frames are counted here.
    """

    def __init__(self, fault: Fault, seed: Sequence[int], counts: Counter[str]) -> None:
        self._fault = fault
        self._node = int(fault.values["node"])
        self._counts = counts
        self._moments = _Moments(seed)
        self._said: dict[int, Callable[[float, bytes], bytes | None]] = {
            ESC_STATUS.key: _standing,
            NODE_STATUS.key: self._up_since_the_onset,
        }
        self._receivers = {one.key: (one, TransferReceiver(one, Counter())) for one in (ESC_STATUS, NODE_STATUS)}
        self._transfers: Counter[int] = Counter()

    def take(self, since_s: float, due: Due) -> list[Due]:
        """The frame of the first, and what the second says some time later."""
        frame = due.frame
        key = frame.identifier & MESSAGE_MASK
        if due.towards is not Towards.AUTOPILOT or key not in self._said or not self._is_of_node(frame):
            return [due]
        data_type, receiver = self._receivers[key]
        payload = receiver.accept(frame.data, frame.time_s)
        interval_s = 0.0 if payload is None else self._moments.interval_s(key, due.at_s)
        said = None if payload is None else self._said[key](since_s, payload)
        if said is None or not interval_s or not self._fault.active(since_s):
            return [due]
        return [due, *self._spoken(data_type, said, due, self._moments.after_s(interval_s))]

    def _is_of_node(self, frame: CanFrame) -> bool:
        plain = frame.extended and not frame.error and not frame.fd
        return plain and bool(frame.data) and frame.identifier & SOURCE_MASK == self._node

    def _spoken(self, data_type: DataType, payload: bytes, due: Due, after_s: float) -> list[Due]:
        frames = split(
            data_type,
            payload,
            source_node=self._node,
            transfer_id=self._transfers[data_type.key],
            priority=due.frame.identifier >> PRIORITY_SHIFT & PRIORITY_MASK,
            time_s=due.frame.time_s,
        )
        self._transfers[data_type.key] += 1
        self._counts[SPOKEN] += len(frames)
        return [
            due._replace(frame=frame).arriving(due.at_s + after_s + place * FRAME_S)
            for place, frame in enumerate(frames)
        ]

    def _up_since_the_onset(self, since_s: float, payload: bytes) -> bytes | None:
        status = unpack_node_status(payload)
        uptime_s = max(0, int(since_s - self._fault.at_s))
        return None if status is None else pack_node_status(replace(status, uptime_s=uptime_s))


class SecondSender:
    """One on a bus of a vendor's own messages: those that report a thruster's speed come twice.

    Args:
        fault: "node_conflict"; its node is the thruster's number.
        messages: of the bus.
        seed, counts: as of `SecondNode`.

    Raises:
        ValueError: no message reports this thruster's speed.
    """

    def __init__(
        self, fault: Fault, messages: Sequence[EditedMessage], seed: Sequence[int], counts: Counter[str]
    ) -> None:
        number = int(fault.values["node"])
        reports = [(one, at) for one in messages for thruster, at in one.speeds if thruster == number]
        if not reports:
            known = sorted({thruster for one in messages for thruster, _ in one.speeds})
            raise ValueError(
                f"node = {number} of {fault.words}: on a bus without node ids it is a thruster that reports its "
                f"speed, want one of {known}"
            )
        self._fault = fault
        self._counts = counts
        self._moments = _Moments(seed)
        self._said = {
            (one.layout.identifier, one.layout.extended): _StandingMessage(one, slot_of_speed(at).written, counts)
            for one, at in reports
        }

    def take(self, since_s: float, due: Due) -> list[Due]:
        """The frame of the first, and what the second says some time later."""
        frame = due.frame
        message = self._said.get((frame.identifier, frame.extended))
        if due.towards is not Towards.AUTOPILOT or message is None or frame.error:
            return [due]
        interval_s = self._moments.interval_s(frame.identifier, due.at_s)
        data = message.data(frame.data)
        if not interval_s or data is None or not self._fault.active(since_s):
            return [due]
        self._counts[SPOKEN] += 1
        second = due._replace(frame=replace(frame, data=data))
        return [due, second.arriving(due.at_s + self._moments.after_s(interval_s))]


class _StandingMessage:
    """A message of a motor that stands still, with an alive counter of its own."""

    def __init__(
        self, message: EditedMessage, written: Callable[[bytes, float], bytes], counts: Counter[str]
    ) -> None:
        self._length = message.layout.length
        self._written = written
        self._seal = None if message.protection is None else Seal(message.protection, counts)
        if self._seal is not None and message.protection is not None:
            self._seal.withheld = message.protection.counter_span // 2

    def data(self, of_first: bytes) -> bytes | None:
        """What it says when the first says this; None: nothing that is known."""
        if len(of_first) < self._length:
            return None
        standing = self._written(of_first, 0.0)
        if self._seal is None:
            return standing
        self._seal.watch(of_first)
        return self._seal.sealed(standing, changed=standing != of_first)


class _Moments:
    """When the second speaks: once in each interval of the first, at random."""

    def __init__(self, seed: Sequence[int]) -> None:
        self._random = np.random.default_rng(seed)
        self._newest_s: dict[int, float] = {}

    def interval_s(self, key: int, time_s: float) -> float:
        """Since the message before; 0 where there was none."""
        before_s = self._newest_s.get(key, inf)
        self._newest_s[key] = time_s
        return max(0.0, time_s - before_s)

    def after_s(self, interval_s: float) -> float:
        return interval_s * float(self._random.uniform(EARLIEST, LATEST))


def _standing(_since_s: float, payload: bytes) -> bytes | None:
    status = unpack_status(payload)
    return None if status is None else pack_status(status._replace(speed_rpm=0, power_percent=0))

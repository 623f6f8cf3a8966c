"""Others on the link: a second autopilot, and somebody who sends again what was recorded."""

from __future__ import annotations

from collections import deque
from math import inf, pi, remainder
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.scenario.fault import Fault
from hil_tests.wires.way import Passed, Towards

TURN_RADPS = 0.2  # of the second vehicle, which circles
ATTITUDES_PER_S = 10  # and one heartbeat

Event = tuple[float, Passed[bytes]]


class Intruder(Protocol):
    """Somebody who puts packets of his own onto the link.

    Attributes:
        counted: what the counts of a wire call one of these packets.
    """

    counted: str

    def hear(self, time_s: float, passed: Passed[bytes]) -> None:
        """Something was sent on the link; `time_s`, in unix seconds, does not go back."""
        ...

    def next_s(self) -> float:
        """When the next packet is sent; infinity: not unless something is heard first."""
        ...

    def take(self) -> Event:
        """That packet, with its time; each is given out once."""
        ...


class ForeignAutopilot:
    """An ArduSub with a system id of its own, that drives in circles.

    What it sends is not signed: it is another vehicle, which has not our key.

    Args:
        fault: "foreign_system" of a link.
        start_s: from when its times count, in unix seconds.
    """

    counted = "packets of another system"

    def __init__(self, fault: Fault, start_s: float) -> None:
        self._encoder = mavlink.MAVLink(None, srcSystem=int(fault.values["system_id"]), srcComponent=1)
        self._begin_s, self._end_s = start_s + fault.at_s, start_s + fault.until_s
        self._ticks = 0

    def hear(self, time_s: float, passed: Passed[bytes]) -> None:
        """It does not listen."""

    def next_s(self) -> float:
        """When the next packet is sent; infinity: none is any more."""
        next_s = self._begin_s + self._ticks / ATTITUDES_PER_S
        return next_s if next_s < self._end_s else inf

    def take(self) -> Event:
        """ATTITUDE, after each tenth HEARTBEAT, of which there is one before all others; in one datagram."""
        sent_s = self.next_s()
        messages = [self._attitude()] if self._ticks % ATTITUDES_PER_S else [_heartbeat(), self._attitude()]
        self._ticks += 1
        return sent_s, Passed(b"".join(self._packed(message) for message in messages), Towards.GATEWAY)

    def _attitude(self) -> mavlink.MAVLink_attitude_message:
        yaw = TURN_RADPS * self._ticks / ATTITUDES_PER_S
        boot_ms = 60_000 + 1000 * self._ticks // ATTITUDES_PER_S
        return mavlink.MAVLink_attitude_message(boot_ms, 0.05, -0.02, remainder(yaw, 2.0 * pi), 0.0, 0.0, TURN_RADPS)

    def _packed(self, message: mavlink.MAVLink_message) -> bytes:
        packed: bytes = message.pack(self._encoder)
        self._encoder.seq = (self._encoder.seq + 1) % 256
        return packed


class Replayer:
    """Sends all that was on the link again, some time later, while the fault is there.

    Args:
        fault: "replay" of a link.
        start_s: from when its times count, in unix seconds.
    """

    counted = "old packets sent again"

    def __init__(self, fault: Fault, start_s: float) -> None:
        self._age_s = fault.values["age_s"]
        self._begin_s, self._end_s = start_s + fault.at_s, start_s + fault.until_s
        self._recorded: deque[Event] = deque()

    def hear(self, time_s: float, passed: Passed[bytes]) -> None:
        """Record what will be sent again while the fault is there."""
        if self._begin_s <= time_s + self._age_s < self._end_s:
            self._recorded.append((time_s + self._age_s, passed))

    def next_s(self) -> float:
        """When the next packet is sent again; infinity: none is there."""
        return self._recorded[0][0] if self._recorded else inf

    def take(self) -> Event:
        """That packet, the same way as before."""
        return self._recorded.popleft()


def intruders(faults: list[Fault], start_s: float) -> list[Intruder]:
    """All who put packets of their own onto the link by these faults."""
    found: list[Intruder] = [ForeignAutopilot(one, start_s) for one in faults if one.failure == "foreign_system"]
    return [*found, *(Replayer(one, start_s) for one in faults if one.failure == "replay")]


def _heartbeat() -> mavlink.MAVLink_heartbeat_message:
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_SUBMARINE,
        mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
        mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_SAFETY_ARMED,
        19,  # ArduSub's MANUAL
        mavlink.MAV_STATE_ACTIVE,
        3,
    )

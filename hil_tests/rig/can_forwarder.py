"""How ArduPilot forwards its CAN buses over MAVLink (AP_MAVLinkCAN.cpp). Pure: no socket, the time passed in.

One bus at a time, to whoever asked last; every hundredth frame looks whether that is longer ago than five seconds.
There is one filter, whoever set it, and it outlives its client. What finds no room on the link is lost.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.frame import FD_DATA_BYTES, CanFrame
from hil_tests.rig.commands import ACCEPTED, Answer, Result, whole

LOOK_FRAMES = 100
EXPIRES_S = 5.0
EXTENDED_FLAG = 1 << 31
FILTER_IDS = 16


class CanForwarder:
    """See the module's text.

    Args:
        send: sends a MAVLink message, to the one link that there is.
        buses: how many the autopilot has opened.

    Attributes:
        has_room: whether a frame of this time finds room on the link.
        client: system and component that asked last; None: nothing is forwarded.
        filter_ids: numbers that are forwarded; empty: all.
        lost: frames that found no room.
    """

    def __init__(self, send: Callable[[Any], None], buses: int) -> None:
        self._send = send
        self._buses = buses
        self.has_room: Callable[[float], bool] = lambda _: True
        self.client: tuple[int, int] | None = None
        self.filter_ids: frozenset[int] = frozenset()
        self.lost = 0
        self._bus = 0
        self._asked_s = 0.0
        self._frames = 0

    def forget(self) -> None:
        """As after a restart."""
        self.client, self.filter_ids, self._frames = None, frozenset(), 0

    def request(self, time_s: float, parameters: tuple[float, ...], client: tuple[int, int]) -> Answer:
        """MAV_CMD_CAN_FORWARD: param1 is the bus, from 1; 0 ends it, whoever asks."""
        number = whole(parameters[0])
        if number == 0:
            self.client = None
            return ACCEPTED
        if not 1 <= number <= self._buses:
            return Answer(Result.FAILED)
        self._bus, self._asked_s, self.client = number, time_s, client
        return ACCEPTED

    def modify_filter(self, message: Any) -> None:
        """CAN_FILTER_MODIFY."""
        if not 1 <= message.bus <= self._buses or message.num_ids > FILTER_IDS:
            return
        ids = frozenset(message.ids[: message.num_ids])
        match message.operation:
            case mavlink.CAN_FILTER_REPLACE:
                self.filter_ids = ids
            case mavlink.CAN_FILTER_ADD:
                self.filter_ids |= ids
            case mavlink.CAN_FILTER_REMOVE:
                self.filter_ids -= ids

    def take(self, time_s: float, bus: int, frame: CanFrame) -> None:
        """A frame that was on a bus, from 1: the autopilot's own are forwarded, too."""
        if self.client is None or bus != self._bus or self._has_expired(time_s):
            return
        if self.filter_ids and number(frame.identifier) not in self.filter_ids:
            return
        if self.has_room(time_s):
            self._send(_message(self.client, bus, frame))
        else:
            self.lost += 1

    def _has_expired(self, time_s: float) -> bool:
        self._frames += 1
        if self._frames <= LOOK_FRAMES:
            return False
        if time_s - self._asked_s > EXPIRES_S:
            self.client = None
        self._frames = 0
        return self.client is None


def number(identifier: int) -> int:
    """What the filter compares: the DroneCAN data type id, of a service's frame 8 bits; 0 of an anonymous node's."""
    if identifier & 0xFF == 0:
        return 0
    return identifier >> 16 & 0xFF if identifier & 0x80 else identifier >> 8 & 0xFFFF


def _message(client: tuple[int, int], bus: int, frame: CanFrame) -> Any:
    word = frame.identifier | (EXTENDED_FLAG if frame.extended else 0)
    make = mavlink.MAVLink_canfd_frame_message if frame.fd else mavlink.MAVLink_can_frame_message
    padded = frame.data.ljust(FD_DATA_BYTES if frame.fd else 8, b"\0")
    return make(*client, bus - 1, len(frame.data), word, padded)

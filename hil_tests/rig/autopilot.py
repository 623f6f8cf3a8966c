"""An autopilot on the other end of the gateway's MAVLink link.

It sends telemetry, answers commands, and notes with its time everything that arrives. It is a client of the gateway's
UDP server, as an ArduSub's router is of a companion's: it sends first, and answers whoever sent last.
"""

from __future__ import annotations

import socket
from collections import Counter
from collections.abc import Set
from dataclasses import dataclass, field
from math import inf
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.ardusub import Answer, ArduSub, Result, whole
from hil_tests.rig.telemetry import COMPOSERS, Telemetry
from hil_tests.rig.vehicle import Motion

# What ArduSub sends unasked, in seconds between two.
DEFAULT_INTERVALS_S = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 0.1,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 1.0 / 3.0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: inf,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 0.5,
    mavlink.MAVLINK_MSG_ID_RAW_IMU: 0.5,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2: 0.5,
}
# What instruments measure at an instant, and is told with its time. All else is told as it is when it is sent.
SENSED = frozenset({mavlink.MAVLINK_MSG_ID_RAW_IMU, mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2})
# A message that is due within this time is due: times are sums of intervals, and rounded.
EARLY_S = 1e-4


@dataclass(frozen=True, slots=True)
class ReceivedText:
    """A STATUSTEXT as it arrived at the autopilot."""

    time_s: float
    component_id: int
    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class ReceivedHeartbeat:
    """A HEARTBEAT of a companion as it arrived at the autopilot."""

    time_s: float
    component_id: int
    vehicle_type: int
    system_status: int


@dataclass(frozen=True, slots=True)
class ReceivedCommand:
    """A COMMAND_LONG as it arrived at the autopilot, and the result it was answered with."""

    time_s: float
    component_id: int
    command: int
    parameters: tuple[float, ...]
    result: Result


@dataclass(slots=True)
class Notes:
    """Everything that was received, in order of arrival."""

    texts: list[ReceivedText] = field(default_factory=list)
    heartbeats: list[ReceivedHeartbeat] = field(default_factory=list)
    commands: list[ReceivedCommand] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)


class _Datagrams:
    """The `file` that pymavlink's encoder writes to: one message, one datagram."""

    def __init__(self, link: socket.socket, address: tuple[str, int]) -> None:
        self.link, self.address = link, address

    def write(self, data: bytes) -> None:
        try:
            self.link.sendto(data, self.address)
        except ConnectionRefusedError:
            return  # nobody listens yet: UDP's way of saying so, about an earlier datagram


class AutopilotPeer:
    """ArduSub's MAVLink face.

    Args:
        gateway: host and port that the gateway listens on.
        ardusub: whose modes and answers these are.
        system_id: of the vehicle.

    Attributes:
        notes: all that came in.
    """

    def __init__(self, gateway: tuple[str, int], ardusub: ArduSub, system_id: int = 1) -> None:
        self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._link.bind((gateway[0], 0))
        self._link.setblocking(False)
        self._datagrams = _Datagrams(self._link, gateway)
        self._ardusub = ardusub
        self._system_id = system_id
        self._mavlink = mavlink.MAVLink(self._datagrams, srcSystem=system_id, srcComponent=1)
        self._relayed: dict[tuple[int, int], mavlink.MAVLink] = {}
        self._interval_s: dict[int, float] = {}
        self._next_s: dict[int, float] = {}
        for message_id, interval_s in DEFAULT_INTERVALS_S.items():
            self._schedule(message_id, interval_s)
        self._telemetry = Telemetry(0.0, Motion(), ())
        self.notes = Notes()

    def close(self) -> None:
        """Close the socket."""
        self._link.close()

    def exchange(self, time_s: float, telemetry: Telemetry) -> None:
        """Take in and answer what has arrived by now, then send what is due, but for `SENSED`; never waits."""
        self._telemetry = telemetry
        for message in self._arrived():
            self._take(time_s, message)
        self._send_due(time_s, self._interval_s.keys() - SENSED)

    def sense(self, time_s: float, telemetry: Telemetry) -> None:
        """Send what of `SENSED` is due."""
        self._telemetry = telemetry
        self._send_due(time_s, self._interval_s.keys() & SENSED)

    def _send_due(self, time_s: float, message_ids: Set[int]) -> None:
        for message_id in message_ids:
            late_s, interval_s = time_s - self._next_s[message_id], self._interval_s[message_id]
            if late_s > -EARLY_S:
                self._next_s[message_id] = time_s + interval_s - (late_s if late_s < interval_s else 0.0)
                self._send(message_id)

    def relay(self, message: Any, component_id: int, system_id: int | None = None) -> None:
        """Send another component's message, as the vehicle's router would: from the same port.

        Args:
            message: of pymavlink.
            component_id: of the sender.
            system_id: the same; None: the vehicle's.
        """
        sender = self._system_id if system_id is None else system_id, component_id
        if sender not in self._relayed:
            self._relayed[sender] = mavlink.MAVLink(self._datagrams, srcSystem=sender[0], srcComponent=sender[1])
        self._relayed[sender].send(message)

    def _schedule(self, message_id: int, interval_s: float) -> None:
        self._interval_s[message_id] = interval_s
        self._next_s[message_id] = -inf if interval_s < inf else inf

    def _arrived(self) -> list[Any]:
        messages: list[Any] = []
        while True:
            try:
                data, self._datagrams.address = self._link.recvfrom(4096)
            except (BlockingIOError, ConnectionRefusedError):
                return messages
            messages.extend(_parse(data))

    def _take(self, time_s: float, message: Any) -> None:
        kind = message.get_type()
        self.notes.counts[kind] += 1
        component_id = message.get_srcComponent()
        if kind == "STATUSTEXT":
            self.notes.texts.append(ReceivedText(time_s, component_id, message.severity, message.text))
        elif kind == "HEARTBEAT":
            heartbeat = ReceivedHeartbeat(time_s, component_id, message.type, message.system_status)
            self.notes.heartbeats.append(heartbeat)
        elif kind == "COMMAND_LONG" and self._is_for_us(message):
            self._obey(time_s, message)

    def _is_for_us(self, message: Any) -> bool:
        return message.target_system in {0, self._system_id} and message.target_component in {0, 1}

    def _obey(self, time_s: float, message: Any) -> None:
        parameters = tuple(float(getattr(message, f"param{number}")) for number in range(1, 8))
        answer = self._answer(message.command, parameters)
        sender = message.get_srcSystem(), message.get_srcComponent()
        self.notes.commands.append(ReceivedCommand(time_s, sender[1], message.command, parameters, answer.result))
        self._mavlink.send(
            mavlink.MAVLink_command_ack_message(
                message.command, answer.result, target_system=sender[0], target_component=sender[1]
            )
        )
        if answer.text:
            self._mavlink.statustext_send(mavlink.MAV_SEVERITY_WARNING, answer.text.encode())

    def _answer(self, command: int, parameters: tuple[float, ...]) -> Answer:
        if command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            return self._set_interval(whole(parameters[0]), parameters[1])
        if command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            return self._request(whole(parameters[0]))
        return self._ardusub.answer(command, parameters)

    def _set_interval(self, message_id: int, interval_us: float) -> Answer:
        """-1 stops a stream, 0 gives it its default rate back; what this autopilot never sends is denied."""
        if message_id not in DEFAULT_INTERVALS_S or not (interval_us >= 0.0 or interval_us == -1.0):
            return Answer(Result.DENIED)
        special_s = {-1.0: inf, 0.0: DEFAULT_INTERVALS_S[message_id]}
        self._schedule(message_id, special_s.get(interval_us, interval_us * 1e-6))
        return Answer(Result.ACCEPTED)

    def _request(self, message_id: int) -> Answer:
        if message_id not in COMPOSERS:
            return Answer(Result.FAILED)
        self._send(message_id)
        return Answer(Result.ACCEPTED)

    def _send(self, message_id: int) -> None:
        message = COMPOSERS[message_id](self._telemetry, self._ardusub)
        if message is not None:
            self._mavlink.send(message)


def _parse(datagram: bytes) -> list[Any]:
    """Messages of one datagram. A parser of its own: none that is cut short may swallow the next datagram's start."""
    parser = mavlink.MAVLink(None)
    parser.robust_parsing = True
    return parser.parse_buffer(datagram) or []

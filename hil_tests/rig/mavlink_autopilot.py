"""The MAVLink face of a simulated autopilot: datagrams in, datagrams out, the time passed in. No socket, no clock."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.frame import CanFrame
from hil_tests.rig.can_forwarder import CanForwarder
from hil_tests.rig.commander import Commander
from hil_tests.rig.commands import ACCEPTED, Answer, Result, whole
from hil_tests.rig.conduct import Conduct, Reply
from hil_tests.rig.notes import Notes, ReceivedCommand, ReceivedHeartbeat, ReceivedText, ReceivedValue
from hil_tests.rig.schedule import Schedule
from hil_tests.rig.telemetry import COMPOSERS, Telemetry, compose
from hil_tests.rig.vehicle import Motion

# What instruments measure at an instant, and is told with its time. All else is told as it is when it is sent.
SENSED = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_RAW_IMU,
        mavlink.MAVLINK_MSG_ID_HIGHRES_IMU,
        mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2,
    }
)
GROUND_STATION = 255
# Signatures carry the time since 2015 in units of 10 us. After a restart ArduPilot goes on a minute ahead of what it
# had saved, for it may not know the time, and must not repeat itself.
SIGNING_EPOCH_S = 1_420_070_400.0
SIGNING_TICKS_PER_S = 100_000
SIGNING_AHEAD_S = 60.0


class _Datagrams:
    """The `file` that pymavlink's encoder writes to: one message, one datagram."""

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self.write = send


@dataclass(frozen=True, slots=True)
class _Promise:
    """An answer that is given later."""

    due_s: float
    acknowledgement: Any


class MavlinkAutopilot:
    """Sends telemetry, answers commands, and notes with its time everything that arrives.

    Args:
        send: takes a datagram away.
        commander: whose modes and answers these are.
        system_id: of the vehicle.
        conduct: where it does not do as it should.
        key: 32 bytes; all that is sent is signed with it, and nothing else is taken. None: no signatures.
        can_buses: CAN buses of an ArduPilot, that it can forward. PX4 forwards none.

    Attributes:
        forwarder: of the CAN buses.
        notes: all that came in.
        conduct: can be changed at any time.
    """

    def __init__(
        self,
        send: Callable[[bytes], None],
        commander: Commander,
        system_id: int = 1,
        conduct: Conduct | None = None,
        key: bytes | None = None,
        can_buses: int = 0,
    ) -> None:
        self._datagrams = _Datagrams(send)
        self._commander = commander
        self._system_id = system_id
        self.conduct = Conduct() if conduct is None else conduct
        self._key = key
        self._encoders: dict[tuple[int, int], mavlink.MAVLink] = {}
        self._mavlink = self._encoder(system_id, 1)
        self._schedule = Schedule(commander.streams)
        self._telemetry = Telemetry(0.0, Motion(), ())
        self._booted_s = 0.0
        self._silent_until_s = -inf
        self._clock_request_s = -inf
        self._promises: list[_Promise] = []
        self.forwarder = CanForwarder(partial(self.relay, component_id=1), can_buses)
        self.notes = Notes()

    def receive(self, time_s: float, datagram: bytes) -> None:
        """Take in what has arrived, and answer it."""
        if time_s < self._silent_until_s:
            return
        self._wind(time_s)
        for message in self._parsed(datagram):
            self._take(time_s, message)

    def advance(self, time_s: float, telemetry: Telemetry) -> None:
        """Send what is due, but for `SENSED`."""
        self._know(telemetry)
        if time_s < self._silent_until_s:
            return
        self._wind(time_s)
        self._keep_promises(time_s)
        self._send_due(time_s, self._commander.streams.keys() - SENSED)
        if time_s >= self._clock_request_s:
            self._clock_request_s = time_s + self._commander.clock_request_s
            self._mavlink.timesync_send(0, self._clock_ns())

    def sense(self, time_s: float, telemetry: Telemetry) -> None:
        """Send what of `SENSED` is due."""
        self._know(telemetry)
        if time_s >= self._silent_until_s:
            self._send_due(time_s, self._commander.streams.keys() & SENSED)

    def on_bus(self, time_s: float, bus: int, frame: CanFrame) -> None:
        """A frame is on one of its CAN buses, from 1."""
        if time_s >= self._silent_until_s:
            self._wind(time_s)
            self.forwarder.take(time_s, bus, frame)

    def restart(self, time_s: float, silent_s: float) -> None:
        """Start anew: for a while there is silence, then it is disarmed, knows no intervals, and counts from 0.

        Args:
            time_s: now.
            silent_s: until it speaks again.
        """
        self._commander.restart()
        self._schedule.forget()
        self.forwarder.forget()
        self._promises.clear()
        self._silent_until_s = time_s + silent_s
        self._booted_s += self._telemetry.boot_s
        signed_ticks = self._mavlink.signing.timestamp
        self._encoders.clear()
        self._mavlink = self._encoder(self._system_id, 1)
        self._mavlink.signing.timestamp = signed_ticks + round(SIGNING_AHEAD_S * SIGNING_TICKS_PER_S)

    def relay(self, message: Any, component_id: int, system_id: int | None = None) -> None:
        """Send another component's message, as the vehicle's router would: from the same port.

        Args:
            message: of pymavlink.
            component_id: of the sender.
            system_id: the same; None: the vehicle's.
        """
        sender = self._system_id if system_id is None else system_id
        self._encoder(sender, component_id).send(message)

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT of the autopilot's own."""
        self._mavlink.statustext_send(severity, text.encode("ascii"))

    def interval_s(self, message_id: int) -> float:
        """Seconds between two messages as they are sent now; infinity: not at all."""
        return self._schedule.interval_s(message_id)

    def _encoder(self, system_id: int, component_id: int) -> mavlink.MAVLink:
        found = self._encoders.get((system_id, component_id))
        if found is None:
            found = mavlink.MAVLink(self._datagrams, srcSystem=system_id, srcComponent=component_id)
            found.signing.secret_key = self._key
            found.signing.sign_outgoing = self._key is not None
            found.robust_parsing = True
            self._encoders[system_id, component_id] = found
        return found

    def _wind(self, time_s: float) -> None:
        """Signatures carry the time; pymavlink only counts on from where it is."""
        ticks = round((time_s - SIGNING_EPOCH_S) * SIGNING_TICKS_PER_S)
        for encoder in self._encoders.values():
            encoder.signing.timestamp = max(encoder.signing.timestamp, ticks, 0)

    def _parsed(self, datagram: bytes) -> list[Any]:
        """Messages of a datagram. A parser of its own: none that is cut short may swallow the next one's start."""
        parser = mavlink.MAVLink(None)
        parser.robust_parsing = True
        parser.signing = self._mavlink.signing
        return parser.parse_buffer(datagram) or []

    def _know(self, telemetry: Telemetry) -> None:
        self._telemetry = replace(telemetry, boot_s=telemetry.boot_s - self._booted_s)

    def _send_due(self, time_s: float, message_ids: Set[int]) -> None:
        for message_id in self._schedule.due(time_s, message_ids):
            self._send(message_id)

    def _send(self, message_id: int) -> None:
        for message in compose(message_id, self._telemetry, self._commander):
            self._mavlink.send(message)

    def _take(self, time_s: float, message: Any) -> None:
        kind, component_id = message.get_type(), message.get_srcComponent()
        self.notes.counts[kind] += 1
        match kind:
            case "STATUSTEXT":
                self.notes.texts.append(ReceivedText(time_s, component_id, message.severity, message.text))
            case "HEARTBEAT":
                heartbeat = ReceivedHeartbeat(time_s, component_id, message.type, message.system_status)
                self.notes.heartbeats.append(heartbeat)
            case "NAMED_VALUE_FLOAT":
                value = ReceivedValue(time_s, message.value)
                self.notes.values.setdefault(message.name, []).append(value)
            case "TIMESYNC":
                self._tell_time(message)
            case "CAN_FILTER_MODIFY" if self._is_for_us(message) and self._forwards:
                self.forwarder.modify_filter(message)
            case "COMMAND_LONG" if self._is_for_us(message):
                self._deal_with(time_s, message)

    @property
    def _forwards(self) -> bool:
        return self._commander.autopilot == int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)

    def _is_for_us(self, message: Any) -> bool:
        return message.target_system in {0, self._system_id} and message.target_component in {0, 1}

    def _tell_time(self, message: Any) -> None:
        """tc1 = 0 is a question; else it is an answer, to a question that may have been ours."""
        if message.tc1 == 0:
            self._mavlink.timesync_send(self._clock_ns(), message.ts1)
        else:
            self.notes.clock_answers += 1

    def _clock_ns(self) -> int:
        """ArduPilot adds its system id, so that it knows its own questions by their stamps."""
        return round(1e9 * self._telemetry.boot_s) // 1000 * 1000 + self._system_id

    def _deal_with(self, time_s: float, message: Any) -> None:
        parameters = tuple(float(getattr(message, f"param{number}")) for number in range(1, 8))
        if self.conduct.ground_station_only and message.get_srcSystem() != GROUND_STATION:
            self._note(time_s, message, parameters, None)
            return
        reply = self.conduct.reply(message.command, parameters)
        if reply is None:
            answer = self._obeyed(time_s, message, parameters)
            reply = Reply(answer.result)
            if answer.text:
                self.say(mavlink.MAV_SEVERITY_WARNING, answer.text)
        elif reply.obeyed:
            self._obeyed(time_s, message, parameters)
        self._note(time_s, message, parameters, reply.result)
        self._answer(time_s, message, reply)

    def _note(self, time_s: float, message: Any, parameters: tuple[float, ...], result: Result | None) -> None:
        sender = message.get_srcComponent()
        command = ReceivedCommand(time_s, sender, message.command, parameters, result, message.confirmation)
        self.notes.commands.append(command)

    def _answer(self, time_s: float, message: Any, reply: Reply) -> None:
        if reply.after_s > 0.0:
            self._mavlink.send(_acknowledgement(message, Result.IN_PROGRESS))
            if reply.result is not None:
                final = _acknowledgement(message, reply.result)
                self._promises.append(_Promise(time_s + reply.after_s, final))
        elif reply.result is not None:
            self._mavlink.send(_acknowledgement(message, reply.result))

    def _keep_promises(self, time_s: float) -> None:
        for promise in [one for one in self._promises if time_s >= one.due_s]:
            self._promises.remove(promise)
            self._mavlink.send(promise.acknowledgement)

    def _obeyed(self, time_s: float, message: Any, parameters: tuple[float, ...]) -> Answer:
        command = message.command
        if command == mavlink.MAV_CMD_CAN_FORWARD and self._forwards:
            client = message.get_srcSystem(), message.get_srcComponent()
            return self.forwarder.request(time_s, parameters, client)
        if command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            known = self._schedule.set_interval(whole(parameters[0]), parameters[1])
            return ACCEPTED if known else Answer(Result.DENIED)
        if command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            return self._request(whole(parameters[0]))
        return self._commander.answer(command, parameters)

    def _request(self, message_id: int) -> Answer:
        if message_id not in COMPOSERS:
            return Answer(Result.FAILED)
        self._send(message_id)
        return ACCEPTED


def _acknowledgement(message: Any, result: Result) -> Any:
    return mavlink.MAVLink_command_ack_message(
        message.command,
        result,
        target_system=message.get_srcSystem(),
        target_component=message.get_srcComponent(),
    )

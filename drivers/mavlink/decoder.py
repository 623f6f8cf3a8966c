"""MAVLink bytes to readings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Any

from drivers.mavlink import formats
from drivers.mavlink.autopilot import AUTOPILOT_COMPONENT, AUTOPILOT_INVALID, AutopilotChoice
from drivers.mavlink.commands import COMMANDS, OperatorCommands
from drivers.mavlink.copies import RouteCopies
from drivers.mavlink.encoder import COMPANION_COMPONENT, check_component
from drivers.mavlink.fixes import PositionFixes
from drivers.mavlink.formats import ESC_TELEMETRY, MessageFormat
from drivers.mavlink.forwarded_frames import ForwardedFrames
from drivers.mavlink.frames import FrameScanner, Gate, Packet, frame_at
from drivers.mavlink.inertial import Barometers, InertialUnits
from drivers.mavlink.messages import CommandAck, TimeSync
from drivers.mavlink.own_frames import OwnFrames
from drivers.mavlink.thruster_commands import ThrusterCommands
from drivers.mavlink.thruster_speeds import ESCS_PER_MESSAGE, ThrusterSpeeds
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.mavlink.timesync import Timesync
from drivers.mavlink.vehicle import VehicleTelemetry, heartbeat
from drivers.mavlink.velocities import BodyVelocities
from drivers.readings import Attitude, AutopilotConflict, Reading

__all__ = ["MavlinkDecoder", "MavlinkThruster"]

# The ground station's, with which DVL drivers on the vehicle speak as well.
GROUND_SYSTEM = 255
VELOCITIES = frozenset(
    message.message_id for message in (formats.VISION_POSITION_DELTA, formats.VISION_SPEED_ESTIMATE, formats.ODOMETRY)
)
ADDRESSED = frozenset({formats.TIMESYNC.message_id, *COMMANDS})
ANSWERS_MAX = 64  # that wait, where nobody sends them: a replay

Unpack = Callable[[bytes], tuple[Any, ...]]
Handle = Callable[[tuple[Any, ...], float], list[Reading]]  # of values in wire order and the time of reception
Handler = tuple[MessageFormat, Handle]


class MavlinkDecoder:
    """A stream of MAVLink 1 and 2 from a vehicle to readings: what its autopilot says, and nobody else.

    (But for GPS_INPUT, which positioning systems send as other components of the vehicle, for DVLs, whose drivers do
    that, too, or use a ground station's system id, and for what is addressed to us: commands, and who asks the time.)

    No byte makes it raise. Without a gate, signed frames are taken like any other: their signature is not checked.

    Args:
        thrusters: where commands and speeds are found.
        own_component: component id under which the gateway sends; what comes back from it is ignored.
        autopilot_system: MAVLink system id of our autopilot; None: the only one that is heard.
        navigation: True where inertial units, water pressure and DVL are wanted, too.
        gate: lets in who may speak, see `drivers.mavlink.signing`; None: all. With a gate, commands to us must be
            signed, whatever else it lets in.
        operators: system ids whose commands to us are taken.
        can_frames: collects the CAN frames that our autopilot forwards; None: they are not wanted.

    Attributes:
        drops: what was thrown away, counted by cause.
        heard: messages of our autopilot that were read, by their ids.
        wanted: ids of the messages that are read at all.
        own: what we sent is told to it, to be known again.
        timesync: what we ask of the autopilot's clock.

    Raises:
        ValueError: ids out of their range, or two thrusters with the same number, ESC or sensor.
    """

    def __init__(
        self,
        thrusters: Sequence[MavlinkThruster],
        own_component: int = COMPANION_COMPONENT,
        autopilot_system: int | None = None,
        navigation: bool = False,
        gate: Gate | None = None,
        operators: Collection[int] = (GROUND_SYSTEM,),
        can_frames: ForwardedFrames | None = None,
    ) -> None:
        check_component(own_component)
        for name in ("thruster", "esc_index", "rpm_sensor"):
            _check_unique(name, [getattr(thruster, name) for thruster in thrusters])
        self.drops: Counter[str] = Counter()
        self.heard: Counter[int] = Counter()
        self._thrusters = tuple(thrusters)
        self._own_component = own_component
        self._navigation = navigation
        self._can_frames = can_frames
        self._autopilot = AutopilotChoice(autopilot_system, self.drops)
        self._handlers = self._handlers_for(autopilot_system)
        self._handlers_system = autopilot_system
        self._fixes = PositionFixes(self.drops)
        self._velocities = BodyVelocities(self.drops)
        self._commands = OperatorCommands(operators, gate is not None, own_component, self.drops)
        self._copies = RouteCopies()
        self._answers: list[CommandAck | TimeSync] = []
        self.own = OwnFrames(self.drops)
        self.timesync = Timesync(own_component, self.drops)
        self._routes = self._routes_for(navigation)
        self.wanted = frozenset({*self._routes, *self._handlers})
        self._scanner = FrameScanner(self.wanted, self.drops, gate)

    @property
    def autopilot_system(self) -> int | None:
        """System id of the autopilot that is listened to; None before the first, and where it could be another."""
        return self._autopilot.system_id

    def decode(self, data: bytes, time_s: float) -> list[Reading]:
        """Readings that these bytes complete, in the order of the stream.

        Args:
            data: as received, cut anywhere.
            time_s: reception; becomes the time of the readings.
        """
        readings: list[Reading] = []
        for packet in self._scanner.feed(data, time_s):
            readings += self.take(packet, time_s)
        return readings

    def take(self, packet: Packet, time_s: float) -> Sequence[Reading]:
        """Readings of a packet whose checksum is right, and which the gate let in where there is one."""
        known = self._handlers.get(packet.message_id)
        if known is None or packet.component_id != AUTOPILOT_COMPONENT:
            return self._from_somebody(packet, time_s)
        if packet.system_id != self._autopilot.system_id:
            self.drops["not our autopilot"] += 1
            return ()
        self.heard[packet.message_id] += 1
        unpack, handle = known
        return handle(unpack(packet.payload), time_s)

    def sent(self, data: bytes, time_s: float) -> None:
        """Takes a packet that we sent, in a replay of what came and went: it and its answer are known again."""
        self.own.sent(data, time_s)
        frame = frame_at(data, 0)
        if frame is not None and frame.message_id == formats.TIMESYNC.message_id:
            answered_ns, asked_ns, *_ = formats.TIMESYNC.unpack(data[frame.payload_start : frame.payload_end])
            if answered_ns == 0:
                self.timesync.asked(asked_ns)

    def answers(self) -> list[CommandAck | TimeSync]:
        """What is to be sent at once, by the rules of the protocol alone; each is given out once."""
        answers, self._answers = self._answers, []
        return answers

    def _from_somebody(self, packet: Packet, time_s: float) -> Sequence[Reading]:
        if packet.component_id == self._own_component and packet.system_id == self._autopilot.system_id:
            return self.own.take(packet, time_s)
        route = self._routes.get(packet.message_id)
        return () if route is None else route(packet, time_s)

    def _routes_for(self, navigation: bool) -> dict[int, Callable[[Packet, float], Sequence[Reading]]]:
        """Messages that do not come from our autopilot alone, or of which more than the payload is looked at."""
        return {
            **dict.fromkeys(ADDRESSED, self._addressed),
            formats.HEARTBEAT.message_id: self._heartbeat,
            formats.COMMAND_ACK.message_id: self._acknowledgement,
            formats.GPS_INPUT.message_id: self._from_positioning,
            **(dict.fromkeys(VELOCITIES, self._from_dvl) if navigation else {}),
        }

    def _addressed(self, packet: Packet, time_s: float) -> list[Reading]:
        receiver = self.timesync if packet.message_id == formats.TIMESYNC.message_id else self._commands
        taken = receiver.take(packet, self._autopilot.system_id, time_s)
        if isinstance(taken, CommandAck | TimeSync):
            self._answers = [*self._answers, taken][-ANSWERS_MAX:]
            return []
        return [] if taken is None else [taken]

    def _from_positioning(self, packet: Packet, time_s: float) -> list[Reading]:
        if packet.system_id != self._autopilot.system_id:
            self.drops["not our vehicle"] += 1
            return []
        return self._fixes.gps_input(packet.component_id, formats.GPS_INPUT.unpack(packet.payload), time_s)

    def _from_dvl(self, packet: Packet, time_s: float) -> list[Reading]:
        ours = self._autopilot.system_id
        if ours is None or packet.system_id not in (ours, GROUND_SYSTEM):
            self.drops["not our vehicle"] += 1
            return []
        return self._velocities.decode(packet, time_s)

    def _acknowledgement(self, packet: Packet, time_s: float) -> Sequence[Reading]:
        if packet.component_id != AUTOPILOT_COMPONENT:
            return ()
        if packet.system_id != self._autopilot.system_id:
            self.drops["not our autopilot"] += 1
            return ()
        if self._copies.repeats(packet, time_s):
            self.drops["repeated"] += 1  # it would answer the next command of the same kind
            return ()
        self.heard[packet.message_id] += 1
        return self._acknowledge(formats.COMMAND_ACK.unpack(packet.payload), time_s)

    def _heartbeat(self, packet: Packet, time_s: float) -> list[Reading]:
        if packet.component_id != AUTOPILOT_COMPONENT:
            return []
        reading = heartbeat(formats.HEARTBEAT.unpack(packet.payload), packet.system_id, packet.component_id, time_s)
        if reading.autopilot == AUTOPILOT_INVALID:
            return []
        rivals_before = self._autopilot.rivals
        self._autopilot.heartbeat(packet.system_id, time_s)
        rivals = self._autopilot.rivals
        several = rivals != rivals_before and max(len(rivals), len(rivals_before)) > 1
        readings: list[Reading] = [AutopilotConflict(time_s, rivals)] if several else []
        if packet.system_id == self._autopilot.system_id:
            self._follow(packet.system_id)
            readings.append(reading)
        return readings

    def _follow(self, system_id: int) -> None:
        if system_id != self._handlers_system:
            self._handlers, self._handlers_system = self._handlers_for(system_id), system_id

    def _handlers_for(self, system_id: int | None) -> dict[int, tuple[Unpack, Handle]]:
        """What to do with each message that is wanted; messages that no thruster needs are not even unpacked."""
        vehicle = VehicleTelemetry(system_id or 0, self._own_component, self.drops)
        self._acknowledge = vehicle.acknowledgement
        fixes = PositionFixes(self.drops)
        handlers: list[Handler] = [
            (formats.SYSTEM_TIME, vehicle.system_time),
            (formats.ATTITUDE, self._remembered(vehicle.attitude)),
            (formats.ATTITUDE_QUATERNION, self._remembered(vehicle.attitude_quaternion)),
            (formats.LOCAL_POSITION_NED, vehicle.local_position),
            (formats.GLOBAL_POSITION_INT, vehicle.global_position),
            (formats.GPS_RAW_INT, fixes.gps_raw),
        ]
        handlers += self._thruster_handlers()
        handlers += self._navigation_handlers() if self._navigation else []
        if self._can_frames is not None:
            handlers += [(formats.CAN_FRAME, self._can_frames.classic), (formats.CANFD_FRAME, self._can_frames.fd)]
        return {message.message_id: (message.unpack, handle) for message, handle in handlers}

    def _thruster_handlers(self) -> list[Handler]:
        commands, speeds = ThrusterCommands(self._thrusters, self.drops), ThrusterSpeeds(self._thrusters, self.drops)
        handlers: list[Handler] = []
        if any(thruster.servo_channel is not None for thruster in self._thrusters):
            handlers.append((formats.SERVO_OUTPUT_RAW, commands.servo_output))
        if any(thruster.actuator is not None for thruster in self._thrusters):
            handlers.append((formats.ACTUATOR_OUTPUT_STATUS, commands.actuator_output))
        if any(thruster.rpm_sensor is not None for thruster in self._thrusters):
            handlers.append((formats.RPM, speeds.rpm))
        escs = {thruster.esc_index for thruster in self._thrusters if thruster.esc_index is not None}
        if escs:
            handlers += [(formats.ESC_STATUS, speeds.esc_status), (formats.ESC_INFO, speeds.esc_info)]
        for group in sorted({esc // ESCS_PER_MESSAGE for esc in escs if esc < ESCS_PER_MESSAGE * len(ESC_TELEMETRY)}):
            handlers.append((ESC_TELEMETRY[group], partial(speeds.esc_telemetry, group)))
        return handlers

    def _remembered(self, handle: Handle) -> Handle:
        """The same, and the newest attitude is known to the velocities, where these are wanted."""
        if not self._navigation:
            return handle

        def remembered(values: tuple[Any, ...], time_s: float) -> list[Reading]:
            readings = handle(values, time_s)
            for reading in readings:
                if isinstance(reading, Attitude):
                    self._velocities.attitude = reading
            return readings

        return remembered

    def _navigation_handlers(self) -> list[Handler]:
        units, barometers = InertialUnits(self.drops), Barometers(self.drops)
        return [
            (formats.RAW_IMU, units.raw),
            (formats.HIGHRES_IMU, units.highres),
            *((message, partial(units.scaled, place)) for place, message in enumerate(formats.SCALED_IMUS)),
            *(
                (message, partial(barometers.pressure, place))
                for place, message in enumerate(formats.SCALED_PRESSURES)
            ),
        ]


def _check_unique(name: str, values: Sequence[int | None]) -> None:
    repeated = sorted(value for value, times in Counter(values).items() if value is not None and times > 1)
    if repeated:
        raise ValueError(f"{name} must be different for every thruster, got {repeated} more than once")

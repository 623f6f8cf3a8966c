"""An autopilot's own log (.BIN, .ulg) as it would have been heard: its link, and the DroneCAN bus that it commands.

Such a log has no packets and no frames, only what was measured. It is told in the messages of the link (see `telling`
and `thruster_messages`); velocities of a DVL as those who measure them tell the autopilot. Thrusters that the
configuration has on DroneCAN are told there (see `esc_frames`), where no log of that bus is played beside it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, groupby
from operator import attrgetter

from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import dataflash_clock, read_dataflash
from drivers.logs.ulog import read_ulog, ulog_clock
from drivers.mavlink import formats
from drivers.mavlink.frames import Packet
from drivers.mavlink.velocities import MAV_FRAME_BODY_FRD
from drivers.readings import AutopilotHeartbeat, BodyVelocity, Reading, ThrusterCommand, ThrusterReport
from gateway.config import Config
from gateway.replay.log_input import LogInput, LogKind
from gateway.wiring import mavlink_thrusters
from hil_tests.dive_logs.esc_frames import EscFrames, as_servos
from hil_tests.dive_logs.pieces import OnBus, OnLink, Piece
from hil_tests.dive_logs.telling import Told, told
from hil_tests.dive_logs.thruster_messages import ThrusterMessages

AUTOPILOT, ODOMETER = 1, 197  # component ids; the second is MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
DVL_EXTENSION = 255, 0  # system and component under which BlueOS's extensions for DVLs speak
ESTIMATED_BY_VISION = 2  # MAV_ESTIMATOR_TYPE
USUAL_INTERVAL_S, INTERVAL_MAX_S = 0.1, 1.0  # between two velocities


def autopilot_pieces(log: LogInput, config: Config, damage: DamageReport, buses: bool) -> Iterator[Piece]:
    """The pieces of a log, by its own times.

    Args:
        log: a .BIN or .ulg.
        config: where commands and speeds are looked for.
        damage: told what is lost.
        buses: whether DroneCAN buses are made of it, too. Of a .ulg none are: PX4 does not say which of its outputs
            are ESCs on CAN.

    Raises:
        OSError: the log cannot be read.
        ValueError: it is not of its kind.
    """
    px4 = log.kind is LogKind.ULOG
    spoken = [bus for bus in config.can if bus.protocol == "dronecan" and not bus.forwarded]
    buses = buses and not px4
    wired = [*mavlink_thrusters(config.thruster)]
    wired += [one for bus in spoken for one in as_servos(config.thruster, bus)] if buses else []
    offset_s = (ulog_clock if px4 else dataflash_clock)(log.path).offset_s
    read = read_ulog if px4 else read_dataflash
    system_id = _system_id(read(log.path, (), DamageReport()))
    voice = _Voice(ThrusterMessages(mavlink_thrusters(config.thruster), px4), system_id, offset_s, px4)
    frames = {bus.name: EscFrames(config.thruster, bus) for bus in spoken} if buses else {}
    readings = chain.from_iterable(read(log.path, wired, damage, config.navigation is not None))
    for time_s, of_instant in groupby(readings, key=attrgetter("time_s")):
        instant = list(of_instant)
        yield from (OnLink(time_s, packet) for packet in voice.packets(instant, time_s))
        for bus, esc_frames in frames.items():
            yield from (OnBus(time_s, frame, bus) for frame in esc_frames.commands(_commands(instant), time_s))
            yield from (OnBus(time_s, frame, bus) for frame in esc_frames.reports(_reports(instant), time_s))


def _system_id(batches: Iterable[Iterable[Reading]]) -> int:
    """The autopilot's, as its first HEARTBEAT has it; 1, which is usual, where there is none."""
    readings = chain.from_iterable(batches)
    return next((one.system_id for one in readings if isinstance(one, AutopilotHeartbeat)), 1)


class _Voice:
    """Readings of an instant in, packets of all who would have told of them out."""

    def __init__(self, thrusters: ThrusterMessages, system_id: int, offset_s: float, px4: bool) -> None:
        self._thrusters = thrusters
        self._system_id = system_id
        self._offset_s = offset_s
        self._px4 = px4
        self._sequences: Counter[tuple[int, int]] = Counter()
        self._measured_s: float | None = None

    def packets(self, instant: Sequence[Reading], time_s: float) -> Iterator[Packet]:
        boot_s = time_s - self._offset_s
        for reading in instant:
            if isinstance(reading, BodyVelocity):
                yield self._velocity(reading, boot_s)
            elif (message := told(reading, boot_s)) is not None:
                yield self._packet(message, self._system_id, AUTOPILOT)
        for message in self._thrusters.commands(_commands(instant), boot_s):
            yield self._packet(message, self._system_id, AUTOPILOT)
        for message in self._thrusters.reports(_reports(instant), boot_s):
            yield self._packet(message, self._system_id, AUTOPILOT)

    def _velocity(self, reading: BodyVelocity, boot_s: float) -> Packet:
        if self._px4:
            return self._packet(_odometry(reading, boot_s), self._system_id, ODOMETER)
        since_s = USUAL_INTERVAL_S if self._measured_s is None else boot_s - self._measured_s
        self._measured_s = boot_s
        interval_s = since_s if 0.0 < since_s < INTERVAL_MAX_S else USUAL_INTERVAL_S
        return self._packet(_position_delta(reading, interval_s), *DVL_EXTENSION)

    def _packet(self, message: Told, system_id: int, component_id: int) -> Packet:
        layout, fields = message
        sequence = self._sequences[system_id, component_id] % 256
        self._sequences[system_id, component_id] += 1
        return Packet(layout.message_id, system_id, component_id, layout.payload.pack(*fields), sequence)


def _position_delta(reading: BodyVelocity, interval_s: float) -> Told:
    """Without a time, as the extensions send it; a velocity that was logged had the bottom."""
    way_m = (interval_s * component for component in reading.velocity_mps)
    return formats.VISION_POSITION_DELTA, (0, round(1e6 * interval_s), 0.0, 0.0, 0.0, *way_m, 100.0)


def _odometry(reading: BodyVelocity, boot_s: float) -> Told:
    unknown, upright = float("nan"), (1.0, 0.0, 0.0, 0.0)
    motion = (unknown,) * 3, upright, reading.velocity_mps, (unknown,) * 3, (unknown,) * 42
    frames = MAV_FRAME_BODY_FRD, MAV_FRAME_BODY_FRD, 0, ESTIMATED_BY_VISION, 100
    return formats.ODOMETRY, (round(1e6 * boot_s), *chain.from_iterable(motion), *frames)


def _commands(instant: Sequence[Reading]) -> list[ThrusterCommand]:
    return [reading for reading in instant if isinstance(reading, ThrusterCommand)]


def _reports(instant: Sequence[Reading]) -> list[ThrusterReport]:
    return [reading for reading in instant if isinstance(reading, ThrusterReport)]

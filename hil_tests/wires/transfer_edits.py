"""DroneCAN transfers that are changed on their way: put together, changed, and cut into frames anew.

Frames of a transfer that may change are held until it is complete, and go out together with its last one. It keeps
its source, priority and transfer id; CRC and toggle bits are made right. Source: DroneCAN specification, part 4.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from drivers.can.dronecan.decoder import SPEED_LIMIT_RPM
from drivers.can.dronecan.esc_status import ESC_STATUS, SPEED_MAX_RPM, pack_status, unpack_status
from drivers.can.dronecan.setpoints import RAW_COMMAND, RPM_COMMAND, Setpoints
from drivers.can.dronecan.thruster import DroneCanThruster, commanded_by
from drivers.can.dronecan.transfer import (
    END_OF_TRANSFER,
    MESSAGE_MASK,
    SOURCE_MASK,
    START_OF_TRANSFER,
    TRANSFER_ID_MASK,
    DataType,
    TransferReceiver,
    split,
)
from drivers.can.frame import CanFrame
from drivers.command import CommandScale
from hil_tests.wires.frame_faults import Due
from hil_tests.wires.thruster_values import ThrusterValue
from hil_tests.wires.way import Towards

PRIORITY_SHIFT, PRIORITY_MASK = 24, 0x1F
# esc.Status: what stands before the bits of the speed, in bytes
BEFORE_SPEED = 10


class Edit(ABC):
    """What is changed in the payloads of one data type."""

    data_type: DataType

    @abstractmethod
    def payload(self, since_s: float, source: int, payload: bytes) -> bytes | None:
        """What a payload becomes, itself if it is as it should be; None: the transfer does not come."""

    @abstractmethod
    def active(self, since_s: float, newest: bytes | None) -> bool:
        """Whether there is something to change in transfers like the newest of a node; None: there was none yet."""


class SpeedEdit(Edit):
    """Speeds in esc.Status.

    Args:
        thrusters: of the bus.
        values: by thruster; those that have faults.
    """

    data_type = ESC_STATUS

    def __init__(self, thrusters: Sequence[DroneCanThruster], values: Mapping[int, ThrusterValue]) -> None:
        self._concerned = {one.esc_index: (one, values[one.thruster]) for one in thrusters if one.thruster in values}

    def active(self, since_s: float, newest: bytes | None) -> bool:
        status = None if newest is None else unpack_status(newest)
        if status is None:
            return any(value.active(since_s) for _, value in self._concerned.values())
        return status.esc_index in self._concerned and self._concerned[status.esc_index][1].active(since_s)

    def payload(self, since_s: float, source: int, payload: bytes) -> bytes | None:
        status = unpack_status(payload)
        if status is None or status.esc_index not in self._concerned or abs(status.speed_rpm) > SPEED_LIMIT_RPM:
            return payload
        thruster, value = self._concerned[status.esc_index]
        if thruster.node_id not in (None, source):
            return payload
        true_rpm = thruster.speed_rpm(status.speed_rpm)
        said_rpm = value.said(since_s, true_rpm)
        if said_rpm is None or said_rpm == true_rpm:
            return None if said_rpm is None else payload
        changed = pack_status(status._replace(speed_rpm=reported_rpm(thruster, said_rpm)))
        return payload[:BEFORE_SPEED] + changed[BEFORE_SPEED:]


class CommandEdit(Edit):
    """Commands in esc.RawCommand or esc.RPMCommand, which come for all ESCs at once.

    Args:
        message: which of them.
        thrusters, values: as of `SpeedEdit`.
    """

    def __init__(
        self, message: Setpoints, thrusters: Sequence[DroneCanThruster], values: Mapping[int, ThrusterValue]
    ) -> None:
        self.data_type = message.data_type
        self._message = message
        self._concerned = [
            (one, values[one.thruster]) for one in commanded_by(thrusters, message) if one.thruster in values
        ]

    def active(self, since_s: float, newest: bytes | None) -> bool:
        return any(value.active(since_s) for _, value in self._concerned)

    def payload(self, since_s: float, source: int, payload: bytes) -> bytes | None:
        numbers = self._message.unpack(payload)
        if numbers is None:
            return payload
        disarmed = not any(numbers)
        changed = list(numbers)
        for thruster, value in self._concerned:
            # where a message of zeros means disarmed, one number in it would make commands of all the zeros
            if thruster.esc_index >= len(numbers) or (disarmed and not thruster.bidirectional_command):
                continue
            true = thruster.scale.fraction(numbers[thruster.esc_index])
            if true is not None and (said := value.said_among_others(since_s, true)) != true:
                changed[thruster.esc_index] = self._number(thruster.scale, said)
        return payload if changed == numbers else self._message.pack(changed)

    def _number(self, scale: CommandScale, fraction: float) -> int:
        number = round(wire_value(scale, fraction))
        return min(self._message.maximum, max(self._message.minimum, number))


def reported_rpm(thruster: DroneCanThruster, speed_rpm: float) -> int:
    """What an ESC reports at a speed, the inverse of `DroneCanThruster.speed_rpm`."""
    ahead = abs(speed_rpm) if not thruster.signed else -speed_rpm if thruster.reverse else speed_rpm
    return round(min(SPEED_MAX_RPM, max(-SPEED_MAX_RPM, ahead)))


def wire_value(scale: CommandScale, fraction: float) -> float:
    """A command in the unit of the wire, at most full thrust; neutral where it has no such direction."""
    bounded = min(1.0, max(-1.0, fraction))
    above = -bounded if scale.reverse else bounded
    end = scale.maximum if above > 0.0 else scale.minimum
    return scale.neutral if end == scale.neutral else scale.value(bounded)


class TransferEdits:
    """All transfers of a bus, one frame after the other.

    Args:
        thrusters: of the bus.
        speeds, commands: by thruster; those that have faults.
    """

    def __init__(
        self,
        thrusters: Sequence[DroneCanThruster],
        speeds: Mapping[int, ThrusterValue],
        commands: Mapping[int, ThrusterValue],
    ) -> None:
        to_devices = [CommandEdit(message, thrusters, commands) for message in (RAW_COMMAND, RPM_COMMAND)]
        self._edits: dict[tuple[Towards, int], Edit] = {}
        if speeds:
            self._edits[Towards.AUTOPILOT, ESC_STATUS.key] = SpeedEdit(thrusters, speeds)
        if commands:
            self._edits |= {(Towards.DEVICES, one.data_type.key): one for one in to_devices}
        self._streams: dict[tuple[Towards, int], _Stream] = {}

    @property
    def renumbers(self) -> bool:
        """Whether transfer ids are no longer those that came in."""
        return any(stream.renumbers for stream in self._streams.values())

    def take(self, since_s: float, due: Due) -> list[Due]:
        """What goes on when a frame comes: itself, nothing yet, or a whole transfer."""
        frame = due.frame
        edit = self._edits.get((due.towards, frame.identifier & MESSAGE_MASK))
        if edit is None or not _is_of_transfer(frame):
            return [due]
        key = due.towards, frame.identifier
        stream = self._streams.get(key)
        if stream is None:
            stream = self._streams[key] = _Stream(edit, frame.identifier)
        return stream.take(since_s, due)


def _is_of_transfer(frame: CanFrame) -> bool:
    """Whether a frame belongs to a transfer of a node that has a node id."""
    plain = frame.extended and not frame.error and not frame.fd
    return plain and bool(frame.data) and frame.identifier & SOURCE_MASK != 0


class _Stream:
    """Transfers of one type from one node."""

    def __init__(self, edit: Edit, identifier: int) -> None:
        self._edit = edit
        self._source = identifier & SOURCE_MASK
        self._priority = identifier >> PRIORITY_SHIFT & PRIORITY_MASK
        self._receiver = TransferReceiver(edit.data_type, Counter())
        self._newest: bytes | None = None
        self._holding = False
        self._held: list[Due] = []
        self._withheld = 0

    @property
    def renumbers(self) -> bool:
        return self._withheld & TRANSFER_ID_MASK != 0 or bool(self._held)

    def take(self, since_s: float, due: Due) -> list[Due]:
        tail = due.frame.data[-1]
        broken = []
        if tail & START_OF_TRANSFER:
            broken = self._released(due.at_s)
            self._holding = self._edit.active(since_s, self._newest)
        payload = self._receiver.accept(due.frame.data, due.frame.time_s)
        said = payload
        if payload is not None:
            self._newest = payload
            if self._holding or not self._edit.active(since_s, payload):  # else it has begun before the onset
                said = self._edit.payload(since_s, self._source, payload)
        if not self._holding:
            return [*broken, self._renumbered(due)]
        self._held.append(due)
        if not tail & END_OF_TRANSFER:
            return broken
        if payload is None or said is payload:
            return broken + self._released(due.at_s)
        self._held = []
        return broken + self._sent(said, tail, due)

    def _released(self, at_s: float) -> list[Due]:
        """What was held, as it came but now."""
        held, self._held = self._held, []
        return [self._renumbered(one).arriving(at_s) for one in held]

    def _sent(self, payload: bytes | None, tail: int, due: Due) -> list[Due]:
        if payload is None:
            self._withheld += 1
            return []
        frames = split(
            self._edit.data_type,
            payload,
            source_node=self._source,
            transfer_id=tail - self._withheld,
            priority=self._priority,
            time_s=due.frame.time_s,
        )
        return [due._replace(frame=frame) for frame in frames]

    def _renumbered(self, due: Due) -> Due:
        """With the transfer id that counts on from what has gone out."""
        if not self._withheld & TRANSFER_ID_MASK:
            return due
        *data, tail = due.frame.data
        transfer_id = tail - self._withheld & TRANSFER_ID_MASK
        changed = bytes([*data, tail & ~TRANSFER_ID_MASK | transfer_id])
        return due._replace(frame=replace(due.frame, data=changed))

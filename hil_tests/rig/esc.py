"""Simulated DroneCAN nodes on any python-can bus: eight ESCs, and the autopilot that commands them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import can

from drivers.can.frame import CanFrame
from hil_tests.rig.bus_clock import Unsent
from hil_tests.rig.dronecan_nodes import (
    FIRST_ESC_NODE,
    HOLD_S,
    MESSAGE_TYPE_MASK,
    RAW_COMMAND_BITS,
    DroneCanCommander,
    DroneCanEscs,
    DroneCanReceiver,
)
from hil_tests.rig.esc_messages import EscReport
from hil_tests.rig.thruster import T200
from hil_tests.rig.vehicle import THRUSTERS, Vehicle


def raw_command_filter() -> dict[str, Any]:
    """A python-can filter that lets only esc.RawCommand through."""
    return {"can_id": RAW_COMMAND_BITS, "can_mask": MESSAGE_TYPE_MASK, "extended": True}


class DroneCanPort:
    """Sends frames to, and takes whole DroneCAN messages from, a python-can bus.

    Args:
        bus: open, owned and closed by the caller.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._receiver = DroneCanReceiver()

    def send(self, time_s: float, frames: Iterable[Unsent]) -> None:
        """Frames of a node, stamped where the bus keeps stamps."""
        for frame in frames:
            self._bus.send(can.Message(timestamp=time_s, arbitration_id=frame.identifier, data=frame.data))

    def frames(self) -> Iterator[CanFrame]:
        """Those with 29-bit identifier that have come by now; never waits."""
        while (message := self._bus.recv(timeout=0.0)) is not None:
            if message.is_extended_id and not message.is_error_frame:
                yield CanFrame(message.timestamp, message.arbitration_id, bytes(message.data))

    def receive(self) -> list[Any]:
        """All messages that are complete by now, as `dronecan` transfers; never waits."""
        transfers = (self._receiver.take(frame.identifier, frame.data) for frame in self.frames())
        return [transfer for transfer in transfers if transfer is not None]


class CommandNode:
    """The autopilot's side of the bus: broadcasts thruster commands.

    Args:
        bus: open, owned by the caller.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._port = DroneCanPort(bus)
        self._commander: DroneCanCommander | None = None

    def publish(self, time_s: float, commands: Sequence[float]) -> None:
        """Send one command of -1 to 1 per thruster, and the node's own status when it is due."""
        self._commander = self._commander or DroneCanCommander(range(len(commands)))
        self._port.send(time_s, self._commander.publish(time_s, commands))


class EscBank:
    """Eight ESC nodes: obey the newest esc.RawCommand, report esc.Status each.

    Args:
        bus: open, owned by the caller; give it `raw_command_filter()` to spare the rest.
        vehicle: whose thrusters they drive and watch.
        hold_s: how long a command is good for.
    """

    def __init__(self, bus: can.BusABC, vehicle: Vehicle, hold_s: float = HOLD_S) -> None:
        self._port = DroneCanPort(bus)
        self._vehicle = vehicle
        self._escs = DroneCanEscs(
            range(THRUSTERS),
            range(FIRST_ESC_NODE, FIRST_ESC_NODE + THRUSTERS),
            [T200.rated_power_w] * THRUSTERS,
            hold_s,
        )

    @property
    def dropped(self) -> int:
        """Commands that were broken."""
        return self._escs.dropped

    def commands(self, time_s: float) -> list[float]:
        """What the ESCs apply now, -1 to 1 each."""
        self._escs.take(time_s, self._port.frames())
        return self._escs.commands(time_s)

    def report(self, time_s: float, window_s: float) -> None:
        """Send the esc.Status of every thruster, and each node's own status when it is due."""
        for place, thruster in enumerate(self._vehicle.thrusters):
            measured = thruster.measure(window_s)
            report = EscReport(measured.speed_rpm, self._vehicle.battery.voltage_v, measured.supply_a)
            self._port.send(time_s, self._escs.report(time_s, place, report))

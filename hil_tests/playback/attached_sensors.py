"""Sensors that speak for themselves, around a real autopilot: a DVL and an acoustic positioning system."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.mavlink.signing import Signing
from hil_tests.rig import acoustic, dvl
from hil_tests.rig.acoustic import AcousticSystem
from hil_tests.rig.dvl import DopplerLog
from hil_tests.rig.profile_sections import Sensors
from hil_tests.rig.vehicle import Motion

STEP_S = 0.02  # shorter than from ping to ping


class AttachedSensors:
    """Motion in, packets out. They begin anew whenever the motion is known again.

    Args:
        sensors: which there are.
        seed: of their noise.
        signing: of their packets; None: they are not signed.
    """

    def __init__(self, sensors: Sensors, seed: int, signing: Signing | None) -> None:
        self._sensors, self._seed, self._signing = sensors, seed, signing
        self._senders: dict[tuple[int, int], mavlink.MAVLink] = {}
        self._at_work: _AtWork | None = None

    def due(self, time_s: float, motion: Motion | None, system_id: int) -> list[bytes]:
        """Packets that are due.

        Args:
            time_s: now, unix seconds.
            motion: of the vehicle; None: it is not known, and nothing is said.
            system_id: of the vehicle.
        """
        if motion is None:
            self._at_work = None
            return []
        if self._at_work is None:
            self._at_work = _AtWork(self._sensors, self._seed, time_s)
        return [self._packed(time_s, *said) for said in self._at_work.messages(time_s, motion, system_id)]

    def _packed(self, time_s: float, message: Any, system_id: int, component_id: int) -> bytes:
        sender = self._senders.setdefault(
            (system_id, component_id), mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        )
        packet = bytes(message.pack(sender))
        sender.seq = (sender.seq + 1) % 256
        return packet if self._signing is None else self._signing.sign(packet, time_s)


class _AtWork:
    """The sensors from when the motion was known."""

    def __init__(self, sensors: Sensors, seed: int, start_s: float) -> None:
        self._dvl = DopplerLog(sensors.dvl, seed) if sensors.dvl else None
        self._acoustic = AcousticSystem(sensors.acoustic, seed) if sensors.acoustic else None
        self._start_s, self._steps = start_s, 0

    def messages(self, time_s: float, motion: Motion, system_id: int) -> Iterator[tuple[Any, int, int]]:
        """Each with system and component of its sender."""
        while (since_s := self._steps * STEP_S) <= time_s - self._start_s:
            self._steps += 1
            velocity = self._dvl and self._dvl.due(since_s, motion)
            if velocity:
                yield velocity, dvl.SYSTEM_ID, dvl.COMPONENT_ID
            fix = self._acoustic and self._acoustic.due(since_s, self._start_s + since_s, motion)
            if fix:
                yield fix, system_id, acoustic.COMPONENT_ID

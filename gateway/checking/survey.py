"""Who speaks on a MAVLink link, and who of them is let in: bytes in, one entry for each sender out."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from drivers.mavlink.autopilot import AUTOPILOT_COMPONENT, AUTOPILOT_INVALID
from drivers.mavlink.formats import HEARTBEAT
from drivers.mavlink.frames import Frame, FrameScanner, Gate, is_signed
from drivers.mavlink.vehicle import heartbeat
from drivers.readings import AutopilotHeartbeat
from gateway.supervision.autopilots import AutopilotKind, kind_of

MAV_TYPE_GCS = 6


@dataclass(slots=True)
class Sender:
    """One component of one system, as far as it was heard.

    Attributes:
        system_id, component_id: its ids.
        packets, signed: how many, and how many of them with a signature, right or wrong.
        refused: those that the gateway would not read, by cause.
        heartbeat: its newest one, whoever it is; None before the first.
    """

    system_id: int
    component_id: int
    packets: int = 0
    signed: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    heartbeat: AutopilotHeartbeat | None = None

    @property
    def autopilot(self) -> bool:
        """Whether its heartbeat is that of an autopilot."""
        beat = self.heartbeat
        return beat is not None and beat.autopilot != AUTOPILOT_INVALID and self.component_id == AUTOPILOT_COMPONENT

    @property
    def refusal(self) -> str:
        """The cause for which all that it said was refused, the most frequent one; "" if anything was let in."""
        if self.refused.total() < self.packets:
            return ""
        return max(self.refused, key=lambda cause: self.refused[cause])

    def name(self) -> str:
        """Its kind and its ids."""
        beat = self.heartbeat
        if beat is None or not (self.autopilot or beat.vehicle_type == MAV_TYPE_GCS):
            return f"component {self.component_id} of system {self.system_id}"
        if beat.vehicle_type == MAV_TYPE_GCS:
            return f"ground station (system {self.system_id})"
        if kind_of(beat) is not AutopilotKind.OTHER:
            return f"{kind_of(beat)} (system {self.system_id})"
        kind = f"MAV_AUTOPILOT {beat.autopilot}, MAV_TYPE {beat.vehicle_type}"
        return f"autopilot of another kind (system {self.system_id}, {kind}: it gets advice only)"


class MavlinkSurvey:
    """Listens, and lets in what the gateway would.

    Args:
        gate: that of the gateway; None: all are let in.

    Attributes:
        senders: by system and component id.
    """

    def __init__(self, gate: Gate | None) -> None:
        self.senders: dict[tuple[int, int], Sender] = {}
        self._gate = gate
        self._scanner = FrameScanner((), Counter(), self)

    def feed(self, data: bytes, time_s: float) -> None:
        """Takes what was received, cut anywhere."""
        self._scanner.feed(data, time_s)

    def refusal(self, frame: Frame, packet: bytes, time_s: float) -> str:
        """Notes a packet; see `Gate`."""
        refusal = "" if self._gate is None else self._gate.refusal(frame, packet, time_s)
        source = (frame.system_id, frame.component_id)
        sender = self.senders.setdefault(source, Sender(*source))
        sender.packets += 1
        sender.signed += is_signed(packet)
        if refusal:
            sender.refused[refusal] += 1
        if frame.message_id == HEARTBEAT.message_id:
            begin = frame.end - len(packet)
            payload = packet[frame.payload_start - begin : frame.payload_end - begin]
            sender.heartbeat = heartbeat(HEARTBEAT.unpack(payload), *source, time_s)
        return refusal

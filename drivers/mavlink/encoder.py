"""The gateway's messages to MAVLink bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.formats import TIMESYNC
from drivers.mavlink.frames import frame_at
from drivers.mavlink.messages import (
    FILTER_IDS_MAX,
    TEXT_MAX,
    CanFilterModify,
    CommandAck,
    CommandLong,
    CompanionHeartbeat,
    ComputerStatus,
    NamedValue,
    OutgoingMessage,
    StatusText,
    TimeSync,
)
from drivers.mavlink.signing import Signing

COMPANION_COMPONENT = 192  # MAV_COMP_ID_ONBOARD_COMPUTER2
# What fields hold that have no value, by the width of the field
UINT8_UNUSED, UINT32_UNUSED, INT8_UNUSED, INT16_UNUSED = 0xFF, 0xFFFF_FFFF, 0x7F, 0x7FFF
CORES = 8


class MavlinkEncoder:
    """Outgoing messages to MAVLink 2 frames, numbered in sequence.

    Args:
        system_id: the vehicle's, 1..254. Never 255: ArduSub would take us for its ground station, and its failsafe
            for a lost ground station would never come.
        component_id: ours, 2..255; 1 is the autopilot itself.
        signing: signs every frame; None: none is signed.

    Raises:
        ValueError: an id out of these bounds.
    """

    def __init__(
        self, system_id: int, component_id: int = COMPANION_COMPONENT, signing: Signing | None = None
    ) -> None:
        if not 1 <= system_id <= 254:
            raise ValueError(f"system_id must be the vehicle's, 1..254, got {system_id}")
        check_component(component_id)
        self._link = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._signing = signing
        self._text_id = 0

    def encode(self, message: OutgoingMessage, time_s: float | None = None) -> bytes:
        """One frame, or those of a text's chunks one after the other; each takes the next sequence number.

        Args:
            message: what to say.
            time_s: now, unix; only signatures need it.

        Raises:
            ValueError: not one of the messages that the gateway sends, or to be signed without a time.
        """
        return b"".join(self._signed(self._frame(part), time_s) for part in self._parts(message))

    def _frame(self, part: Any) -> bytes:
        frame: bytes = part.pack(self._link)
        self._link.seq = (self._link.seq + 1) % 256
        return frame

    def _signed(self, frame: bytes, time_s: float | None) -> bytes:
        if self._signing is None:
            return frame
        if time_s is None:
            raise ValueError("time_s must be given where frames are signed, got None")
        return self._signing.sign(frame, time_s)

    def _parts(self, message: OutgoingMessage) -> list[Any]:
        if isinstance(message, StatusText) and len(message.text) > TEXT_MAX:
            return self._chunks(message.severity, message.text.encode("ascii"))
        build = _GENERATED.get(type(message))
        if build is None:
            raise ValueError(f"message must be one of {OutgoingMessage}, got {message!r}")
        return [build(message)]

    def _chunks(self, severity: int, text: bytes) -> list[Any]:
        """Only a NUL ends a chunked text: one that fills its last chunk is followed by an empty one."""
        self._text_id = self._text_id % 0xFFFF + 1
        return [
            dialect.MAVLink_statustext_message(severity, text[start : start + TEXT_MAX], self._text_id, place)
            for place, start in enumerate(range(0, len(text) + 1, TEXT_MAX))
        ]


def frames_of(data: bytes) -> Iterator[bytes]:
    """The frames of what `encode` gave, one by one."""
    start = 0
    while start < len(data) and (frame := frame_at(data, start)) is not None:
        yield data[start : frame.end]
        start = frame.end


class _TargetedTimesync(dialect.MAVLink_timesync_message):  # type: ignore[misc]  # pymavlink has no types
    """TIMESYNC with the target that pymavlink's own has not: routers send it there only."""

    def __init__(self, message: TimeSync) -> None:
        super().__init__(message.answered_ns, message.asked_ns)
        self._target = (message.target_system, message.target_component)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        payload = TIMESYNC.payload.pack(self.tc1, self.ts1, *self._target)
        frame: bytes = self._pack(mav, TIMESYNC.crc_extra, payload, force_mavlink1=force_mavlink1)
        return frame


def _heartbeat(message: CompanionHeartbeat) -> Any:
    return dialect.MAVLink_heartbeat_message(
        type=dialect.MAV_TYPE_ONBOARD_CONTROLLER,
        autopilot=dialect.MAV_AUTOPILOT_INVALID,
        base_mode=0,
        custom_mode=0,
        system_status=message.state,
        mavlink_version=3,
    )


def _command_long(message: CommandLong) -> Any:
    return dialect.MAVLink_command_long_message(
        message.target_system, message.target_component, message.command, message.confirmation, *message.parameters
    )


def _command_ack(message: CommandAck) -> Any:
    return dialect.MAVLink_command_ack_message(
        message.command,
        message.result,
        target_system=message.target_system,
        target_component=message.target_component,
    )


def _can_filter_modify(message: CanFilterModify) -> Any:
    return dialect.MAVLink_can_filter_modify_message(
        message.target_system,
        message.target_component,
        message.bus,
        message.operation,
        len(message.ids),
        _filled(list(message.ids), FILTER_IDS_MAX, 0),
    )


def _named_value(message: NamedValue) -> Any:
    boot_ms = round(message.boot_s * 1000.0) % 2**32
    return dialect.MAVLink_named_value_float_message(boot_ms, message.name.encode("ascii"), message.value)


def _computer_status(status: ComputerStatus) -> Any:
    memory_used, memory_total = status.memory_mib or (UINT32_UNUSED, UINT32_UNUSED)
    storage_used, storage_total = status.storage_mib or (UINT32_UNUSED, UINT32_UNUSED)
    return dialect.MAVLink_onboard_computer_status_message(
        time_usec=round(status.unix_s * 1e6),
        uptime=round(status.uptime_s * 1e3) % 2**32,
        type=0,  # mission computer, the primary one
        cpu_cores=_filled([_within(load, 0, 100) for load in status.cpu_percent], CORES, UINT8_UNUSED),
        cpu_combined=[UINT8_UNUSED] * 10,
        gpu_cores=[UINT8_UNUSED] * 4,
        gpu_combined=[UINT8_UNUSED] * 10,
        temperature_board=INT8_UNUSED,
        temperature_core=_filled([_within(one, -128, 126) for one in status.core_celsius], CORES, INT8_UNUSED),
        fan_speed=[INT16_UNUSED] * 4,
        ram_usage=memory_used,
        ram_total=memory_total,
        storage_type=[UINT32_UNUSED] * 4,
        storage_usage=_filled([storage_used], 4, UINT32_UNUSED),
        storage_total=_filled([storage_total], 4, UINT32_UNUSED),
        link_type=[UINT32_UNUSED] * 6,
        link_tx_rate=[UINT32_UNUSED] * 6,
        link_rx_rate=[UINT32_UNUSED] * 6,
        link_tx_max=[UINT32_UNUSED] * 6,
        link_rx_max=[UINT32_UNUSED] * 6,
    )


def _filled(values: list[int], size: int, unused: int) -> list[int]:
    return (values + [unused] * size)[:size]


def _within(value: float, lowest: int, highest: int) -> int:
    return round(max(lowest, min(value, highest)))


_GENERATED: Mapping[type[Any], Callable[[Any], Any]] = {
    CompanionHeartbeat: _heartbeat,
    StatusText: lambda message: dialect.MAVLink_statustext_message(message.severity, message.text.encode("ascii")),
    CommandLong: _command_long,
    CommandAck: _command_ack,
    NamedValue: _named_value,
    TimeSync: _TargetedTimesync,
    ComputerStatus: _computer_status,
    CanFilterModify: _can_filter_modify,
}


def check_component(component_id: int) -> None:
    """Refuses a component id that the gateway cannot have.

    Raises:
        ValueError: out of 2..255.
    """
    if not 2 <= component_id <= 255:
        raise ValueError(f"component id must lie in 2..255 (1 is the autopilot), got {component_id}")

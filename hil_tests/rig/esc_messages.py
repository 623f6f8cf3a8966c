"""PX4's ESC messages, which pymavlink's dialect lacks, in the form of its generated ones (MAVLink common.xml)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from struct import pack

from pymavlink.dialects.v20 import ardupilotmega as mavlink

ESC_INFO_ID, ESC_STATUS_ID = 290, 291
ESCS_PER_MESSAGE = 4
KELVIN = 273.15


@dataclass(frozen=True, slots=True)
class EscReport:
    """What one ESC says of itself; the speed with its sign."""

    speed_rpm: float
    voltage_v: float
    current_a: float
    temperature_k: float = 300.0
    error_count: int = 0


class _EscMessage(mavlink.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """A message whose payload is packed already."""

    def __init__(self, message_id: int, name: str, crc_extra: int, payload: bytes) -> None:
        super().__init__(message_id, name)
        self._packed, self._closing = payload, crc_extra

    def pack(self, mav: mavlink.MAVLink, force_mavlink1: bool = False) -> bytes:
        """As the generated messages do."""
        packed: bytes = self._pack(mav, self._closing, self._packed, force_mavlink1=force_mavlink1)
        return packed


def esc_status(boot_s: float, reports: Sequence[EscReport], first: int) -> mavlink.MAVLink_message:
    """ESC_STATUS of up to four ESCs, from index `first` on."""
    four = _four(reports, first)
    values = [
        round(1e6 * boot_s),
        *(round(one.speed_rpm) for one in four),
        *(one.voltage_v for one in four),
        *(one.current_a for one in four),
        first,
    ]
    return _EscMessage(ESC_STATUS_ID, "ESC_STATUS", 10, pack("<Q4i4f4fB", *values))


def esc_info(boot_s: float, reports: Sequence[EscReport], first: int) -> mavlink.MAVLink_message:
    """ESC_INFO of the same four; nothing failed, all online, on CAN (ESC_CONNECTION_TYPE 5)."""
    four = _four(reports, first)
    online = (1 << min(len(reports) - first, ESCS_PER_MESSAGE)) - 1
    values = [
        round(1e6 * boot_s),
        *(one.error_count for one in four),
        round(boot_s) % 2**16,
        *(0 for _ in four),
        *(round(100.0 * (one.temperature_k - KELVIN)) for one in four),
        first, len(reports), 5, online,
    ]  # fmt: skip
    return _EscMessage(ESC_INFO_ID, "ESC_INFO", 251, pack("<Q4IH4H4h4B", *values))


def _four(reports: Sequence[EscReport], first: int) -> list[EscReport]:
    present = list(reports[first : first + ESCS_PER_MESSAGE])
    return present + [EscReport(0.0, 0.0, 0.0, KELVIN)] * (ESCS_PER_MESSAGE - len(present))

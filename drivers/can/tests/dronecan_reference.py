"""The `dronecan` package as an independent second opinion, spoken to in our frames."""

import dronecan
from dronecan.transport import Frame, Transfer

from drivers.can.dronecan.esc_status import EscStatus
from drivers.can.frame import CanFrame

esc = dronecan.uavcan.equipment.esc


def encode(payload, source_node, transfer_id, time_s=0.0):
    transfer = Transfer(transfer_id, source_node, payload=payload, transfer_priority=16)
    return [CanFrame(time_s, frame.message_id, bytes(frame.bytes)) for frame in transfer.to_frames()]


def decode(frames):
    transfer = Transfer()
    transfer.from_frames([Frame(frame.identifier, bytearray(frame.data)) for frame in frames])
    return transfer


def status(values: EscStatus):
    return esc.Status(
        error_count=values.error_count,
        voltage=values.voltage_v,
        current=values.current_a,
        temperature=values.temperature_k,
        rpm=values.speed_rpm,
        power_rating_pct=values.power_percent,
        esc_index=values.esc_index,
    )

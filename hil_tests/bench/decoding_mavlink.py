"""MAVLink: an autopilot's bytes to readings by our decoder, and to message objects by pymavlink."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.command import CommandScale
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.readings import Attitude, Reading, ThrusterReport
from hil_tests.bench.timing import Comparison

MESSAGES = 1500
PERIOD_S = 0.02
PULSES = CommandScale(1100.0, 1500.0, 1900.0)


def mavlink_stream() -> Comparison:
    """An autopilot's stream as it comes over UDP, one message a datagram: only messages that the gateway reads."""
    datagrams = _autopilot_stream(MESSAGES // 5)
    thrusters = [
        MavlinkThruster(index + 1, servo_channel=index + 1, command_scale=PULSES, esc_index=index)
        for index in range(4)
    ]

    def ours() -> list[Reading]:
        decoder = MavlinkDecoder(thrusters)
        readings: list[Reading] = []
        for number, datagram in enumerate(datagrams):
            readings += decoder.decode(datagram, 0.2 * PERIOD_S * number)
        return readings

    def theirs() -> list[Any]:
        parser = mavlink.MAVLink(None)
        messages: list[Any] = []
        for datagram in datagrams:
            messages += parser.parse_buffer(datagram) or ()
        return messages

    def agree(readings: Sequence[Reading], messages: Sequence[Any]) -> bool:
        rolls = [reading.roll_rad for reading in readings if isinstance(reading, Attitude)]
        speeds = [rpm for message in messages if message.get_type().startswith("ESC_") for rpm in message.rpm]
        own = [reading.speed_rpm for reading in readings if isinstance(reading, ThrusterReport)]
        return own == speeds and rolls == [m.roll for m in messages if m.get_type() == "ATTITUDE"]

    return Comparison("MAVLink to readings", "pymavlink parse_buffer", "message", len(datagrams), ours, theirs, agree)


def _autopilot_stream(ticks: int) -> list[bytes]:
    """Five messages a tick after one HEARTBEAT, packed by pymavlink."""
    autopilot = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    heartbeat = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_SUBMARINE, 3, 0x51, 19, 4, 3)
    messages = [heartbeat]
    for tick in range(ticks):
        boot_ms = 1000 + 20 * tick
        pulses = [1500 + (tick + channel) % 400 for channel in range(8)] + [0] * 8
        rpm = [1000 + (7 * tick + esc) % 500 for esc in range(4)]
        messages += [
            mavlink.MAVLink_attitude_message(boot_ms, 0.001 * (tick % 500), 0.2, 0.3, 0.01, 0.02, 0.03),
            mavlink.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *pulses),
            mavlink.MAVLink_esc_telemetry_1_to_4_message(
                [30] * 4, [1550] * 4, [150] * 4, [0] * 4, rpm, [tick % 65536] * 4
            ),
            mavlink.MAVLink_global_position_int_message(
                boot_ms, 474_000_000 + tick, 85_000_000, -1000, -1000, 10, 20, 30, 9000
            ),
            mavlink.MAVLink_local_position_ned_message(boot_ms, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3),
        ]
    return [_packed(autopilot, message) for message in messages]


def _packed(autopilot: Any, message: Any) -> bytes:
    data: bytes = message.pack(autopilot)
    autopilot.seq = (autopilot.seq + 1) % 256
    return data

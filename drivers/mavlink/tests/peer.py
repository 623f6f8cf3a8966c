"""An autopilot for the tests: pymavlink's own encoder, and PX4's ESC messages in the same form."""

from __future__ import annotations

import struct

from pymavlink.dialects.v20 import ardupilotmega as dialect


class EscStatusMessage(dialect.MAVLink_message):
    """ESC_STATUS as pymavlink would have generated it, written from common.xml independently of the driver."""

    id = 291
    crc_extra = 10

    def __init__(self, index, time_usec, rpm, voltage, current):
        super().__init__(291, "ESC_STATUS")
        self.payload = struct.pack("<Q4i4f4fB", time_usec, *rpm, *voltage, *current, index)

    def pack(self, mav, force_mavlink1=False):
        return self._pack(mav, self.crc_extra, self.payload, force_mavlink1=force_mavlink1)


class EscInfoMessage(dialect.MAVLink_message):
    """ESC_INFO, likewise."""

    id = 290
    crc_extra = 251

    def __init__(self, index, time_usec, count, error_count, temperature, flags=(0, 0, 0, 0)):
        super().__init__(290, "ESC_INFO")
        self.payload = struct.pack(
            "<Q4IH4H4h4B", time_usec, *error_count, 1, *flags, *temperature, index, count, 4, 15
        )

    def pack(self, mav, force_mavlink1=False):
        return self._pack(mav, self.crc_extra, self.payload, force_mavlink1=force_mavlink1)


class Peer:
    """Packs messages with running sequence numbers."""

    def __init__(self, system=1, component=1, key=None):
        self.mav = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        if key is not None:
            self.mav.signing.secret_key = key
            self.mav.signing.sign_outgoing = True

    def pack(self, message, mavlink1=False):
        data = message.pack(self.mav, force_mavlink1=mavlink1)
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def heartbeat(self, autopilot=3, vehicle_type=12, base_mode=0x51, custom_mode=19, state=4, **options):
        message = dialect.MAVLink_heartbeat_message(vehicle_type, autopilot, base_mode, custom_mode, state, 3)
        return self.pack(message, **options)

    def attitude(self, boot_ms=1000, roll=0.1, **options):
        return self.pack(dialect.MAVLink_attitude_message(boot_ms, roll, 0.2, 0.3, 0.4, 0.5, 0.6), **options)

    def servo_output(self, pulses_us, time_us=1_000_000, port=0, **options):
        channels = list(pulses_us) + [0] * (16 - len(pulses_us))
        return self.pack(dialect.MAVLink_servo_output_raw_message(time_us, port, *channels), **options)

    def actuator_output(self, outputs, time_us=1_000_000):
        actuators = list(outputs) + [0.0] * (32 - len(outputs))
        return self.pack(dialect.MAVLink_actuator_output_status_message(time_us, len(outputs), actuators))

    def esc_telemetry(self, group=0, temperature=(20, 0, 0, 0), voltage=(1600, 0, 0, 0), current=(150, 0, 0, 0),
                      rpm=(900, 0, 0, 0), count=(1, 0, 0, 0)):  # fmt: skip
        first = 1 + 4 * group
        message = getattr(dialect, f"MAVLink_esc_telemetry_{first}_to_{first + 3}_message")
        return self.pack(message(temperature, voltage, current, (0, 0, 0, 0), rpm, count))

    def gps_input(self, latitude=437_000_000, longitude=73_000_000, altitude=-12.5, accuracy=0.8, ignored=0,
                  fix_type=3, gps_id=0, time_us=0, **options):  # fmt: skip
        message = dialect.MAVLink_gps_input_message(
            time_us, gps_id, ignored, 0, 0, fix_type, latitude, longitude, altitude, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0,
            accuracy, 1.0, 255,
        )  # fmt: skip
        return self.pack(message, **options)

    def gps_raw(self, latitude=437_000_000, longitude=73_000_000, altitude=-12_500, accuracy=800, fix_type=3,
                time_us=5_000_000, **options):  # fmt: skip
        message = dialect.MAVLink_gps_raw_int_message(
            time_us, fix_type, latitude, longitude, altitude, 100, 100, 0, 0, 12, 0, accuracy
        )
        return self.pack(message, **options)

    def acknowledgement(self, command, result, target_system=0, target_component=0):
        message = dialect.MAVLink_command_ack_message(command, result, 255, 0, target_system, target_component)
        return self.pack(message)


def messages_in(data):
    """What pymavlink reads from bytes."""
    return dialect.MAVLink(None).parse_buffer(data) or []

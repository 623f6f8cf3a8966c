"""An armed ArduSub that says 100 messages a second, lies still, and notes when the kernel delivered each text."""

from __future__ import annotations

import time
from dataclasses import dataclass
from threading import Event, Thread

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.live.stamped_socket import received, stamping_socket

RATE_HZ = 100
DEPTH_PA = 150_000.0


@dataclass(frozen=True, slots=True)
class Text:
    """A STATUSTEXT of the gateway: unix time of its arrival, and what it says."""

    time_s: float
    text: str


class Autopilot(Thread):
    """Speaks and listens from `start` to `stop`.

    Args:
        gateway: where its messages go to.

    Attributes:
        texts: in order of their arrival.
        heard: set when the gateway has said anything.
        sent: messages so far.
    """

    def __init__(self, gateway: tuple[str, int]) -> None:
        super().__init__(name="autopilot", daemon=True)
        self.texts: list[Text] = []
        self.heard = Event()
        self.sent = 0
        self._gateway = gateway
        self._socket = stamping_socket()
        self._mavlink = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._over = Event()

    def run(self) -> None:
        """Until `stop`, at an even pace."""
        begin_s, number = time.monotonic(), 0
        while not self._over.wait(max(0.0, begin_s + number / RATE_HZ - time.monotonic())):
            self._send(_message(number))
            number += 1
            self._listen()
        self._listen()
        self._socket.close()

    def stop(self) -> None:
        """Comes back when it has ended."""
        self._over.set()
        self.join()

    def _send(self, message: mavlink.MAVLink_message) -> None:
        self._socket.sendto(message.pack(self._mavlink), self._gateway)
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        self.sent += 1

    def _listen(self) -> None:
        for data, stamp_ns in received(self._socket):
            for message in self._mavlink.parse_buffer(data) or []:
                self.heard.set()
                self._take(message, stamp_ns * 1e-9)

    def _take(self, message: mavlink.MAVLink_message, time_s: float) -> None:
        match message.get_type():
            case "STATUSTEXT":
                self.texts.append(Text(time_s, message.text))
            case "COMMAND_LONG":
                self._send(mavlink.MAVLink_command_ack_message(message.command, mavlink.MAV_RESULT_ACCEPTED))


def _message(number: int) -> mavlink.MAVLink_message:
    """What is due: half of all are of the inertial unit, a quarter of the attitude, the rest of six other kinds."""
    boot_ms = 10_000 + number * 1000 // RATE_HZ
    if number % RATE_HZ == 0:
        return mavlink.MAVLink_heartbeat_message(12, 3, 0x81, 19, 4, 3)
    if number % 2:
        return mavlink.MAVLink_raw_imu_message(1000 * boot_ms, 0, 0, -1000, 0, 0, 0, 0, 0, 0)
    if number % 4:
        return mavlink.MAVLink_attitude_message(boot_ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return _rarer(number, boot_ms)


def _rarer(number: int, boot_ms: int) -> mavlink.MAVLink_message:
    match number // 4 % 5:
        case 0:
            return mavlink.MAVLink_vision_position_delta_message(1000 * boot_ms, 200_000, [0.0] * 3, [0.0] * 3, 90.0)
        case 1:
            return mavlink.MAVLink_scaled_pressure2_message(boot_ms, DEPTH_PA / 100.0, 0.0, 1200)
        case 2:
            return mavlink.MAVLink_local_position_ned_message(boot_ms, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0)
        case 3:
            return mavlink.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *[1500] * 8, *[0] * 8)
        case _:
            return mavlink.MAVLink_vfr_hud_message(0.0, 0.0, 0, 50, -5.0, 0.0)

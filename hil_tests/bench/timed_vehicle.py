"""The other end of the link: an autopilot that notes when the kernel delivered each text, whenever it is read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from threading import Event, Thread

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.bench.timed_detector import SPEED_RPM, WANTED_RPM
from hil_tests.live.stamped_socket import received, stamping_socket

RATE_HZ = 20.0


class TimedVehicle(Thread):
    """An armed ArduSub with eight thrusters.

    Args:
        gateway: where its messages go to.

    Attributes:
        texts: unix time in nanoseconds at which the text of a change arrived, by the number of the change.
    """

    def __init__(self, gateway: tuple[str, int]) -> None:
        super().__init__(name="vehicle", daemon=True)
        self.texts: dict[int, int] = {}
        self._gateway = gateway
        self._socket = stamping_socket()
        self._mavlink = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._over = Event()

    def run(self) -> None:
        """Speaks and listens until `stop`."""
        for n in range(10**9):
            if self._over.wait(1.0 / RATE_HZ):
                break
            for message in self._telemetry(n):
                self._socket.sendto(message.pack(self._mavlink), self._gateway)
                self._mavlink.seq = (self._mavlink.seq + 1) % 256
            self._listen()
        self._listen()
        self._socket.close()

    def stop(self) -> None:
        """Comes back when it has ended."""
        self._over.set()
        self.join()

    def _telemetry(self, n: int) -> Iterator[mavlink.MAVLink_message]:
        if n % round(RATE_HZ) == 0:
            yield mavlink.MAVLink_heartbeat_message(12, 3, 0x81, 19, 4, 3)
        yield mavlink.MAVLink_servo_output_raw_message(round(n * 1e6 / RATE_HZ) + 1, 0, *[1700] * 8, *[0] * 8)
        escs = [20] * 4, [1600] * 4, [300] * 4, [100] * 4, [SPEED_RPM] * 4, [(n + 1) % 65536] * 4
        yield mavlink.MAVLink_esc_telemetry_1_to_4_message(*escs)
        yield mavlink.MAVLink_esc_telemetry_5_to_8_message(*escs)

    def _listen(self) -> None:
        for data, stamp_ns in received(self._socket):
            for message in self._mavlink.parse_buffer(data) or []:
                found = re.search(r"want (\d+)", message.text) if message.get_type() == "STATUSTEXT" else None
                if found is not None:
                    self.texts[int(found[1]) - WANTED_RPM] = stamp_ns

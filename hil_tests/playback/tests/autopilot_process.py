"""A simulated autopilot with its hull as a process of its own, over UDP: what a real one's simulator would be.

    python -m hil_tests.playback.tests.autopilot_process PORT FILE

It sends to PORT of the loopback and answers whoever it hears from there, until its input ends; then it writes what it
has heard to FILE. Its thrusters are told what to do at servo outputs; nothing of it is on a CAN bus.
"""

from __future__ import annotations

import json
import select
import socket
import sys
import time
from collections import Counter
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.profiles.loading import load_profile
from hil_tests.rig.world import World
from hil_tests.scenario.document import Scenario

STEP_S = 0.01
SCENARIO = Scenario(
    duration_s=60.0,
    mission={"style": "still", "steps": [{"at_s": 0.0, "sticks": {"forward": 0.4, "right": 0.1}}]},
)


def main() -> None:
    port, file = int(sys.argv[1]), sys.argv[2]
    profile = load_profile("bench_rov")
    start_s = time.time()
    world = World(SCENARIO, profile, start_s)
    heard: Counter[str] = Counter()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.setblocking(False)
        while not select.select([sys.stdin], [], [], STEP_S)[0]:
            _take(link, world, heard)
            _step(world, time.time())
            for _, datagram in world.datagrams():
                if _sender(datagram) == (1, 1):  # its sensors are played by those whom this is for
                    link.sendto(datagram, ("127.0.0.1", port))
    motion = world.vehicle.hull.motion
    told = {
        "heard": heard,
        "forward_mps": motion.forward_mps,
        "texts": [text.text for text in world.notes.texts],
        "mode": world.modes[-1].mode,
    }
    Path(file).write_text(json.dumps(told), encoding="utf-8")


def _step(world: World, time_s: float) -> None:
    world.advance(time_s)
    world.to_devices(world.sent_by_autopilot())
    world.sent_by_devices()


def _take(link: socket.socket, world: World, heard: Counter[str]) -> None:
    parser = mavlink.MAVLink(None)
    parser.robust_parsing = True
    while True:
        try:
            datagram = link.recv(4096)
        except (BlockingIOError, ConnectionRefusedError):
            return
        world.to_autopilot(time.time(), datagram)
        for message in parser.parse_buffer(datagram) or []:
            heard[f"{message.get_type()} {message.get_srcSystem()}/{message.get_srcComponent()}"] += 1


def _sender(datagram: bytes) -> tuple[int, int]:
    return datagram[5], datagram[6]


if __name__ == "__main__":
    main()

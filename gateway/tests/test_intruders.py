"""The running gateway against nodes on the bus that should not be there."""

from __future__ import annotations

import asyncio

import can

from drivers.can.dronecan import EscStatus, NodeStatus, encode_esc_status, encode_node_status, encode_raw_command
from drivers.can.frame import CanFrame
from gateway.config import parse
from gateway.pipeline import Factories
from gateway.run import run
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector
from gateway.tests.live_vehicle import free_port, until, vehicle

STAND_INS = Factories(thruster=ThresholdDetector)


class Intruders:
    """A second ESC with index 0, a second commander, and two devices with node id 31.

    Args:
        bus: that they send on.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    async def live(self) -> None:
        """Sends until it is cancelled."""
        for n in range(10_000):
            self._send(encode_esc_status(EscStatus(0, 16.0, 1.0, 300.0, 5, 5, 0), 99, n))
            self._send(encode_raw_command([-5, -5], 98, n))
            for count, uptime_s in ((0, 5), (9, 500)):
                self._send(encode_node_status(NodeStatus(uptime_s), 31, n + count))
            await asyncio.sleep(0.05)

    def _send(self, frames: list[CanFrame]) -> None:
        for frame in frames:
            self._bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=True))


async def test_the_pilot_hears_of_every_one_of_them(tmp_path):
    port, stop = free_port(), asyncio.Event()
    config = parse(TWO_THRUSTERS.replace("udpin:127.0.0.1:0", f"udpin:127.0.0.1:{port}"), tmp_path)
    async with vehicle(port) as simulated:
        running = asyncio.create_task(run(config, stop=stop, factories=STAND_INS))
        await until(lambda: simulated.texts)
        assert simulated.texts == [(6, "Watching 2 thrusters")]
        intruders = asyncio.create_task(Intruders(simulated.bus).live())
        wanted = {
            (4, "T1 ESC index 0 claimed by nodes 20 and 99"),
            (4, "can0 commands from nodes 10 and 98"),
            (4, "can0 node 31 id used by two devices"),
        }
        await until(lambda: wanted <= set(simulated.texts))
        intruders.cancel()
        stop.set()
        summary = await running
    assert summary.levels["thruster 1 esc index"].name == "SUSPECT"
    assert not any(text.startswith(("T1 entangled", "T2 entangled")) for _, text in simulated.texts)

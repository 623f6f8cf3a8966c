"""The simulated DroneCAN nodes get whatever a bus full of faults carries."""

from __future__ import annotations

import random

import pytest

from drivers.can.frame import CanFrame
from hil_tests.rig.dronecan_nodes import AUTOPILOT_NODE, RAW_COMMAND_BITS, DroneCanCommander, DroneCanEscs

COMMANDED = (20 << 24) | RAW_COMMAND_BITS | AUTOPILOT_NODE
WHOLE = 0xC0  # tail byte: the transfer begins and ends with this frame


def escs() -> DroneCanEscs:
    return DroneCanEscs([0, 1], [11, 12], [350.0, 350.0])


def hear(nodes: DroneCanEscs, *payloads: bytes) -> None:
    nodes.take(1.0, [CanFrame(1.0, COMMANDED, data, extended=True) for data in payloads])


@pytest.mark.parametrize(
    "payloads",
    [(b"\x01\xc0",), (b"\x00\x00\x80", b"", b"\x00\x40"), (b"\x80", b"\x60")],
    ids=["8 of 14 bits", "a frame without its tail byte", "no checksum"],
)
def test_a_command_that_is_too_short_is_dropped_and_counted(payloads: tuple[bytes, ...]) -> None:
    nodes = escs()
    hear(nodes, *payloads)
    assert nodes.dropped == 1
    assert nodes.commands(1.0) == [0.0, 0.0]


def test_commands_are_obeyed_again_after_any_bytes_at_all() -> None:
    nodes, chance = escs(), random.Random(7)
    hear(nodes, *(chance.randbytes(chance.randint(0, 7)) + bytes([WHOLE | n % 32]) for n in range(2000)))
    assert nodes.dropped > 100
    hear(nodes, *(frame.data for frame in DroneCanCommander([0, 1]).publish(1.0, [0.5, -0.25])[:1]))
    assert nodes.commands(1.0) == pytest.approx([0.5, -0.25], abs=1e-3)

"""A recorded dive on a real kernel's bus, as a node of its own hears it."""

from __future__ import annotations

import asyncio
from pathlib import Path

import can
import pytest

from gateway.config import parse
from gateway.tests.recorded_dives import dronecan, settings, write_candump
from hil_tests.bridge.permission import Granted
from hil_tests.playback.fault_words import parse_fault
from hil_tests.playback.log_player import Pace
from hil_tests.playback.log_session import LogSession, play_logs
from hil_tests.playback.recorded import DiveLogs
from hil_tests.vcan.interface import INTERFACE

pytestmark = pytest.mark.vcan
SECONDS = 0.5  # as many frames as a socket's buffer holds


async def test_it_is_heard_frame_by_frame_but_for_what_faults_take_away(tmp_path: Path):
    """A virtual bus needs no leave; as fast as it goes, no frame is lost or overtaken."""
    frames = list(dronecan(SECONDS))
    write_candump(tmp_path / "dive.log", frames)
    session = LogSession(
        dive=DiveLogs(("dive.log",), tmp_path),
        config=parse(settings("dronecan"), tmp_path),
        faults=parse_fault("thruster 2 rpm off at_s=0.25"),
        channels={"can0": INTERFACE},
        granted=Granted(),
        pace=Pace(float("inf")),
    )
    with can.Bus(INTERFACE, "socketcan") as node:
        account = await play_logs(session, lambda _: None, asyncio.Event())
        heard = []
        while (message := node.recv(0.2)) is not None:
            heard.append((message.arbitration_id, bytes(message.data)))
    left = [one for one in frames if one.time_s - frames[0].time_s < 0.25 or one.identifier & 0x7F != 22]
    assert heard == [(frame.identifier, frame.data) for frame in left]
    assert f"can0: {len(left)} sent" in account

"""Plays the frames of one bus at their own pace, in a process of its own."""

from __future__ import annotations

import socket
import time
from contextlib import suppress
from dataclasses import dataclass

from drivers.can.frame import CanFrame
from drivers.can.packets import packed
from hil_tests.live.buses import Buses
from hil_tests.live.traffic import UNWANTED, Fault, Plan, is_onset, traffic
from hil_tests.playback.player import play


@dataclass(frozen=True, slots=True)
class Played:
    """What one sender came to.

    Attributes:
        frames, wanted: all, and those that are for the gateway.
        late_s: how late the latest was.
        onsets: faults, and the unix times at which they first showed.
    """

    frames: int
    wanted: int
    late_s: float
    onsets: tuple[tuple[Fault, float], ...]


def play_bus(bus: int, plan: Plan, buses: Buses) -> Played:
    """Play one bus to its end."""
    due = plan.faults(bus)
    onsets: list[tuple[Fault, float]] = []
    frames = others = 0
    with buses.sender(bus) as opened:

        def send(frame: CanFrame) -> None:
            nonlocal frames, others
            frames += 1
            others += frame.identifier == UNWANTED
            if due and is_onset(frame, due[0]):
                onsets.append((due.pop(0), time.time()))
            _put(opened, packed(frame))

        late_s = play(traffic(bus, plan), send)
    return Played(frames, frames - others, late_s, tuple(onsets))


def _put(opened: socket.socket, packet: bytes) -> None:
    """Where the bus takes no more at once, its frames wait, as those of an ESC do."""
    while True:
        with suppress(BlockingIOError, ConnectionRefusedError):
            opened.send(packet)
            return
        time.sleep(0.0005)

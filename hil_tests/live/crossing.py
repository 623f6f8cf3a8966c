"""Plays frames into both ends of a bridge at an even pace, and notes when the kernel has each at the other end."""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CanFrame
from drivers.can.packets import packed
from hil_tests.live.bridge_buses import BridgedBus
from hil_tests.live.latency import Latency, latency
from hil_tests.live.stamped_socket import received

IDENTIFIER = 0x1404_0A00
# what has not come by then is lost
LAST_S = 0.5
# no longer is waited before both ends are looked at again
LOOK_S = 0.0002
# A bus that was held up carries no more frames a second afterwards than before: what is later than this stays so.
CATCH_UP_S = 0.001


@dataclass(frozen=True, slots=True)
class Way:
    """What became of the frames that went one way.

    Attributes:
        sent, lost, overtaken: of them; overtaken are those that came after a later one.
        took: from before it was sent to its arrival at the other end, as the kernel stamps it.
    """

    sent: int
    lost: int
    overtaken: int
    took: Latency


class Player:
    """Who plays at one bus, and hears what the bridge brings.

    Args:
        opened: on the bus; stamps what it receives.
        frames: how many are sent in all.
    """

    def __init__(self, opened: socket.socket, frames: int) -> None:
        self.sent_ns: NDArray[np.int64] = np.zeros(frames, dtype=np.int64)
        self.heard: list[tuple[int, int]] = []
        self._socket = opened
        self._number = 0
        self._head = packed(CanFrame(0.0, IDENTIFIER, bytes(8)))[:8]

    def send(self) -> None:
        """The next frame; it says which one it is."""
        packet = self._head + self._number.to_bytes(8)
        self.sent_ns[self._number] = time.time_ns()
        self._put(packet)
        self._number += 1

    def listen(self) -> None:
        """What has come by now."""
        self.heard += [(int.from_bytes(data[8:16]), stamp_ns) for data, stamp_ns in received(self._socket)]

    def _put(self, packet: bytes) -> None:
        while True:
            try:
                self._socket.send(packet)
                return
            except BlockingIOError:  # the bus takes no more now
                time.sleep(LOOK_S)


def crossed(buses: tuple[BridgedBus, BridgedBus], rate_hz: float, seconds: float) -> tuple[Way, Way, float]:
    """Both ways of a bridge that runs, at the same time.

    Args:
        buses: its own.
        rate_hz: frames a second, each way.
        seconds: for so long.

    Returns:
        From the first bus to the second, from the second to the first, and the time that it took to play them, in
        seconds: longer where the machine was busy with something else.
    """
    count = int(rate_hz * seconds)
    with buses[0].node() as near, buses[1].node() as far:
        players = Player(near, count), Player(far, count)
        taken_s = _play(players, rate_hz, count)
    return _way(players[0], players[1]), _way(players[1], players[0]), taken_s


def _play(players: tuple[Player, Player], rate_hz: float, count: int) -> float:
    begin_s = due_s = time.monotonic()
    for number in range(2 * count):  # in turns
        _listen(players)
        while (wait_s := due_s - time.monotonic()) > 0.0:
            time.sleep(min(wait_s, LOOK_S))
            _listen(players)
        players[number % 2].send()
        due_s = max(due_s, time.monotonic() - CATCH_UP_S) + 0.5 / rate_hz
    end_s = time.monotonic()
    while time.monotonic() < end_s + LAST_S:
        _listen(players)
        time.sleep(LOOK_S)
    return end_s - begin_s


def _listen(players: tuple[Player, Player]) -> None:
    for player in players:
        player.listen()


def _way(source: Player, target: Player) -> Way:
    numbers = np.array([number for number, _ in target.heard], dtype=np.int64)
    stamps_ns = np.array([stamp_ns for _, stamp_ns in target.heard], dtype=np.int64)
    taken_s = 1e-9 * (stamps_ns - source.sent_ns[numbers]) if len(numbers) else np.empty(0)
    return Way(
        sent=len(source.sent_ns),
        lost=len(source.sent_ns) - len(np.unique(numbers)),
        overtaken=int((np.diff(numbers) <= 0).sum()),
        took=latency(taken_s.tolist()),
    )

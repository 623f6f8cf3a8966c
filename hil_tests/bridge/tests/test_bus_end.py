"""One bus of a bridge in every kind of trouble: what waits, what is dropped and counted, what is told."""

from __future__ import annotations

import pytest

from drivers.can.frame import CanFrame
from drivers.can.port import CanPortError
from drivers.clock import Clock
from hil_tests.bridge.bus_end import (
    KEEP_S,
    NOT_VIRTUAL,
    QUEUE_FULL,
    QUEUE_MAX,
    REFUSED,
    REOPEN_MAX_S,
    TOO_LATE,
    BusEnd,
)
from hil_tests.bridge.tests.ends import Port

BUS_OFF = CanFrame(0.0, 0x40, bytes(8), extended=False, error=True)


class Bench:
    """A bus end, its clock, and the ports that it is given one after the other."""

    def __init__(self, *ports, virtual=False):
        self.now_s = 100.0
        self.ports, self.states = list(ports), []
        self.clock = Clock(wall=lambda: self.now_s, monotonic=lambda: self.now_s)
        self.end = BusEnd("can1", self._open, self.clock, self._on_state, virtual=virtual)

    def _on_state(self, state):
        self.states.append((state.up, state.detail))

    def _open(self, _clock, _lost):
        port = self.ports.pop(0)
        if port is None:
            raise CanPortError("no such CAN interface")
        return port

    def after(self, seconds):
        self.now_s += seconds
        self.end.act()


def frames(first, count):
    return [CanFrame(100.0, number, b"", extended=True) for number in range(first, first + count)]


def put(end, several, prompt=True):
    for frame in several:
        end.put(frame, prompt)


def test_a_full_bus_gets_all_frames_in_their_order_when_it_has_room():
    port = Port(room=3)
    bench = Bench(port)
    bench.end.open()
    put(bench.end, frames(0, 10))
    assert [frame.identifier for frame in port.taken] == [0, 1, 2]
    port.room = 4  # but those that wait go first
    put(bench.end, frames(10, 1))
    assert len(port.taken) == 3
    bench.after(0.001)
    assert len(port.taken) == 7
    port.room = 100
    bench.after(0.001)
    assert [frame.identifier for frame in port.taken] == list(range(11))
    assert bench.end.sent == 11 and not bench.end.dropped
    assert bench.end.transit.figures().max_ms == pytest.approx(2.0, abs=0.01)


def test_what_waits_is_bounded_in_number():
    bench = Bench(Port(room=0))
    bench.end.open()
    put(bench.end, frames(0, QUEUE_MAX + 7))
    assert bench.end.dropped == {QUEUE_FULL: 7}


def test_what_waits_is_bounded_in_time():
    port = Port(room=0)
    bench = Bench(port)
    bench.end.open()
    put(bench.end, frames(0, 5))
    bench.now_s += 0.9 * KEEP_S
    put(bench.end, frames(5, 2))
    port.room = 10
    bench.after(0.2 * KEEP_S)
    assert [frame.identifier for frame in port.taken] == [5, 6]
    assert bench.end.dropped == {TOO_LATE: 5}


def test_a_frame_that_the_interface_never_takes_costs_nothing_else():
    port = Port(refusing=True)
    bench = Bench(port)
    bench.end.open()
    put(bench.end, [CanFrame(100.0, 1, bytes(12), fd=True), *frames(2, 1)])
    assert [frame.identifier for frame in port.taken] == [2]
    assert bench.end.dropped == {REFUSED: 1}


def test_a_bus_that_goes_away_is_opened_again_and_again():
    first, second = Port(room=1), Port()
    bench = Bench(first, None, None, second)
    bench.end.open()
    put(bench.end, frames(0, 3))  # two of them wait
    first.gone = "interface is down"
    put(bench.end, frames(3, 1))
    assert bench.end.read() == []
    assert first.closed and bench.end.away == 1
    put(bench.end, frames(4, 2))
    assert bench.end.dropped == {"can1 is away": 5}
    for wait_s in (0.1, 0.1, 0.2):
        assert bench.end.next_s - bench.now_s == pytest.approx(wait_s)
        bench.after(wait_s + 1e-6)
    put(bench.end, frames(6, 1))
    assert [frame.identifier for frame in second.taken] == [6]
    assert bench.states == [(True, ""), (False, "interface is down"), (True, "")]


def test_it_is_asked_for_less_and_less_often():
    bench = Bench(Port(gone="interface is down"), *[None] * 20)
    bench.end.open()
    bench.end.read()
    waits_s = []
    for _ in range(10):
        waits_s.append(bench.end.next_s - bench.now_s)
        bench.after(waits_s[-1] + 1e-6)
    assert waits_s[-1] == pytest.approx(REOPEN_MAX_S)


def test_a_bus_that_fails_while_frames_are_sent_is_lost_too():
    port = Port()
    bench = Bench(port, Port())
    bench.end.open()
    port.gone = "no such CAN interface"
    put(bench.end, frames(0, 2))
    assert bench.end.dropped == {"can1 is away": 2} and bench.end.away == 1
    bench.after(0.2)
    assert bench.end.port is not None


def test_what_came_before_a_bus_failed_is_not_lost():
    port = Port(coming=frames(0, 3), gone="interface is down")
    bench = Bench(port)
    bench.end.open()
    assert [frame.identifier for frame in bench.end.read()] == [0, 1, 2]
    assert bench.states == [(True, ""), (False, "interface is down")]


def test_error_frames_are_told_and_go_no_further():
    port = Port(coming=[*frames(0, 1), BUS_OFF, *frames(1, 1)])
    bench = Bench(port)
    bench.end.open()
    assert [frame.identifier for frame in bench.end.read()] == [0, 1]
    assert bench.end.errors == {"bus-off": 1} and bench.end.received == 2
    assert [up for up, _ in bench.states] == [True, False, True]


def test_data_after_a_bus_off_says_that_it_is_over():
    port = Port(coming=[BUS_OFF])
    bench = Bench(port)
    bench.end.open()
    assert bench.end.read() == [] and bench.end.read() == []
    port.coming = frames(0, 1)
    assert len(bench.end.read()) == 1
    assert [up for up, _ in bench.states] == [True, False, True]


def test_a_bus_that_does_not_open_says_how_to_mend_it():
    bench = Bench(None)
    with pytest.raises(CanPortError, match=r"can1 does not open: no such CAN interface; bring it up: sudo ip link"):
        bench.end.open()
    assert bench.states == []


def test_frames_that_a_fault_has_held_do_not_count_as_slow():
    bench = Bench(Port())
    bench.end.open()
    bench.now_s += 1.0
    put(bench.end, frames(0, 1), prompt=False)
    assert bench.end.sent == 1 and bench.end.transit.figures().max_ms != bench.end.transit.figures().max_ms


@pytest.mark.parametrize("virtual", [False, True])
def test_an_error_frame_of_a_fault_goes_onto_a_virtual_bus_only(virtual):
    port = Port()
    bench = Bench(port, virtual=virtual)
    bench.end.open()
    put(bench.end, [BUS_OFF], prompt=False)
    assert (len(port.taken), bench.end.dropped) == ((1, {}) if virtual else (0, {NOT_VIRTUAL: 1}))

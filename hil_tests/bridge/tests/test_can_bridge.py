"""The bridge between two buses, over real sockets: transparent, unless its wire is not."""

from __future__ import annotations

import time
from random import Random

import pytest

from drivers.can.frame import CanFrame
from drivers.can.port import CanPortError
from drivers.clock import Clock
from hil_tests.bridge.bus_end import BusEnd
from hil_tests.bridge.bus_frame import packed
from hil_tests.bridge.can_bridge import CanBridge, bridged
from hil_tests.bridge.holding import held
from hil_tests.bridge.tests.ends import BrokenWire, HoldingWire, Port, bridged_sockets
from hil_tests.bridge.tests.test_bus_frame import MESSAGES, kernel_packet

ANY = list(map(kernel_packet, MESSAGES.values()))


def sent_through(bridge_wire, packets_of_can0, packets_of_can1):
    """What comes out at can1 and at can0, and the bridge's figures."""
    with bridged_sockets(bridge_wire) as (bridge, can0, can1):
        out_of_can0, out_of_can1 = [], []
        for one, other in zip(packets_of_can0, packets_of_can1, strict=True):
            can0.send(one)
            can1.send(other)
            out_of_can1.append(can1.recv(72))
            out_of_can0.append(can0.recv(72))
    return out_of_can1, out_of_can0, bridge.figures()


def test_every_kind_of_frame_passes_both_ways_as_it_is():
    backwards = ANY[::-1]
    out_of_can1, out_of_can0, figures = sent_through(HoldingWire(), ANY, backwards)
    assert (out_of_can1, out_of_can0) == (ANY, backwards)
    for way in ("can0 to can1", "can1 to can0"):
        told = figures.ways[way]
        assert (told.received, told.sent, told.dropped) == (len(ANY), len(ANY), {})
        assert 0.0 < told.transit.median_ms <= told.transit.p99_ms <= told.transit.max_ms < 1000.0
    assert "8 in, 8 out, within" in figures.lines()[0]


def test_bursts_pass_in_their_order_through_a_queue_that_is_full_again_and_again():
    random, count = Random(7), 2000
    sent = [packed(CanFrame(0.0, random.getrandbits(29), random.randbytes(8))) for _ in range(count)]
    with bridged_sockets(HoldingWire()) as (bridge, can0, can1):
        out = []
        for start in range(0, count, 100):
            for packet in sent[start : start + 100]:
                can0.send(packet)  # a unix socket holds some ten of them: the bridge has to wait
            out += [can1.recv(72) for _ in range(100)]
        assert out == sent
        assert bridge.figures().ways["can0 to can1"].dropped == {}


def test_what_is_no_frame_is_dropped_and_counted():
    with bridged_sockets(HoldingWire()) as (bridge, can0, can1):
        for packet in (b"", b"x" * 15, b"x" * 16, ANY[0]):
            can0.send(packet)
        assert can1.recv(72) == ANY[0]
        assert bridge.figures().ways["can0 to can1"].dropped == {"malformed frame": 3}


def test_what_the_wire_holds_comes_when_it_is_due():
    with bridged_sockets(HoldingWire(hold_s=0.05)) as (bridge, can0, can1):
        begin_s = time.monotonic()
        can0.send(ANY[0])
        assert can1.recv(72) == ANY[0]
        assert 0.05 <= time.monotonic() - begin_s < 1.0
        transit = bridge.figures().ways["can0 to can1"].transit
        assert transit.max_ms != transit.max_ms  # that was the fault's time, not the bridge's


def test_a_wire_that_fails_is_told_to_whoever_stops_the_bridge():
    with (
        pytest.raises(RuntimeError, match="the wire broke"),
        bridged_sockets(BrokenWire()) as (bridge, can0, _),
    ):
        can0.send(ANY[0])
        end_s = time.monotonic() + 5.0
        while bridge.running and time.monotonic() < end_s:
            time.sleep(0.005)
        assert not bridge.running


def test_after_a_stop_nothing_passes_and_another_does_no_harm():
    with bridged_sockets(HoldingWire()) as (bridge, can0, _):
        bridge.stop()
        bridge.stop()
        assert not bridge.running
        with pytest.raises(OSError, match=r"refused|reset|closed"):
            can0.send(ANY[0])


def test_a_bus_that_does_not_open_leaves_the_other_closed():
    port = Port()

    def fail(_clock, _lost):
        raise CanPortError("interface is down")

    clock = Clock()
    ends = BusEnd("can0", lambda _clock, _lost: port, clock), BusEnd("can1", fail, clock)
    with pytest.raises(CanPortError, match="can1 does not open: interface is down"):
        CanBridge(*ends, HoldingWire(), clock).start()
    assert port.closed


def test_a_bridge_has_two_buses():
    end = BusEnd("can0", lambda _clock, _lost: Port(), Clock())
    with pytest.raises(ValueError, match="two buses, got can0 twice"):
        CanBridge(end, end, HoldingWire(), Clock())


def test_an_interface_is_the_end_of_one_bridge_only():
    with held("nocan0", "nocan1"), pytest.raises(CanPortError, match="nocan1 is an end of another bridge"):
        held("nocan1", "nocan2").__enter__()
    with held("nocan1"):
        pass


def test_an_interface_that_is_not_there_is_named():
    with (
        pytest.raises(CanPortError, match="nocan0 does not open"),
        bridged("nocan0", "nocan1", HoldingWire(), Clock()),
    ):
        pass

"""The live benchmark: what it plays, what it lets through, how it counts, and a short run of all of it."""

from __future__ import annotations

import socket
from collections import Counter
from itertools import pairwise, takewhile

import pytest
from rich.console import Console

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.packets import packed
from drivers.clock import Clock
from drivers.readings import ThrusterReport
from gateway.config_sections import CanBus
from hil_tests.bench import live
from hil_tests.live.autopilot import Text
from hil_tests.live.buses import Buses, udp_opener
from hil_tests.live.latency import latency, told
from hil_tests.live.measure import Run, live_run
from hil_tests.live.traffic import FAULT_S, SLOWED, UNWANTED, Fault, Load, Plan, is_onset, traffic
from hil_tests.loopback import free_port


def second_of(bus, plan):
    return list(takewhile(lambda frame: frame.time_s < 1.0, traffic(bus, plan)))


@pytest.mark.parametrize(
    ("load", "frames", "wanted"), [("USUAL", 650, 650), ("FILTERED", 7500, 650), ("WANTED", 7501, 7501)]
)
def test_a_second_of_each_load(load, frames, wanted):
    played = second_of(1, Plan(Load[load], 2.0, learn_s=1.0))
    assert len(played) == frames
    assert sum(frame.identifier != UNWANTED for frame in played) == wanted
    assert all(earlier.time_s <= later.time_s for earlier, later in pairwise(played))
    decoder = DroneCanDecoder([DroneCanThruster(5 + index, index) for index in range(4)])
    readings = [reading for frame in played for reading in decoder.decode(frame)]
    assert {reading.thruster for reading in readings} == {5, 6, 7, 8}
    assert not decoder.drops


def test_thrusters_are_slowed_one_after_the_other():
    plan = Plan(Load.USUAL, 6.0, learn_s=2.0)
    assert [plan.faults(bus) for bus in (0, 1)] == [[Fault(2.0, 1), Fault(4.0, 2), Fault(6.0, 3)], []]
    decoder = DroneCanDecoder([DroneCanThruster(1 + index, index) for index in range(4)])
    reports = [
        reading
        for frame in traffic(0, plan)
        for reading in decoder.decode(frame)
        if isinstance(reading, ThrusterReport) and reading.thruster == 2
    ]
    before, after = (next(one for one in reports if one.time_s >= at_s) for at_s in (3.98, 4.0))
    assert after.speed_rpm == pytest.approx(SLOWED * before.speed_rpm, rel=0.02)
    last, again = (next(one for one in reports if one.time_s >= 4.0 + FAULT_S + at_s) for at_s in (-0.02, 0.0))
    assert last.speed_rpm == pytest.approx(SLOWED * again.speed_rpm, rel=0.02)


def test_an_onset_is_of_the_node_and_not_before_its_time():
    fault = Fault(2.0, 3)
    node = 22
    for identifier, time_s, shows in ((node, 2.0, True), (node, 1.98, False), (node + 1, 2.0, False)):
        assert is_onset(CanFrame(time_s, 0x040A00 | identifier, b"x"), fault) is shows


async def test_the_kernel_lets_through_what_is_wanted():
    wanted = [CanFilter(0x0406_00, 0xFFFF_80, extended=True), CanFilter(0x123, 0x7FF, extended=False)]
    offered = [
        CanFrame(0.0, identifier, bytes([number]), extended)
        for number, (identifier, extended) in enumerate(
            [
                (0x1404_060B, True),
                (0x1404_068B, True),
                (0x1404_0A0B, True),
                (0x123, False),
                (0x123, True),
                (0x124, False),
            ]
        )
    ]
    channel, counters = str(free_port()), Counter()
    port = udp_opener(CanBus(name="a", channel=channel, protocol="dronecan"))(wanted, Clock(), counters)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for frame in [*offered, offered[0]]:
            sender.sendto(packed(frame), ("127.0.0.1", int(channel)))
    heard = [(one.identifier, one.data, one.extended) for one in (await port.receive()).frames()]
    port.close()
    passed = [one for one in [*offered, offered[0]] if any(each.matches(one) for each in wanted)]
    assert heard == [(one.identifier, one.data, one.extended) for one in passed]
    assert len(passed) == 3
    assert not counters


def finding(thruster, time_s, level="FAULT"):
    return {"subject": f"thruster {thruster}", "time_s": time_s, "level": level}


def test_a_fault_is_told_when_its_text_comes_before_the_next():
    onsets = ((Fault(10.0, 1), 110.0), (Fault(12.0, 2), 112.0), (Fault(14.0, 3), 114.0))
    texts = (Text(109.9, "T1 old"), Text(110.25, "T1 entangled?"), Text(112.5, "T1 ok again"), Text(117.0, "T3 late"))
    findings = (
        finding(1, 109.0),
        finding(1, 110.05, "SUSPECT"),
        finding(1, 110.1),
        finding(2, 112.2),
        finding(3, 114.1),
    )
    run = Run(0, 0, 0, 0.0, 0.0, 0.0, 0.0, onsets, texts, findings)
    [only] = told(run)
    assert (only.fault.thruster, only.shown_s, only.decided_s, only.told_s) == (1, 110.0, 110.1, 110.25)


def test_latencies_are_milliseconds():
    assert latency([0.1, 0.2, 0.3]).median_ms == pytest.approx(200.0)
    assert latency([0.1, 0.2, 0.3]).max_ms == pytest.approx(300.0)
    assert latency([]).median_ms != latency([]).median_ms


def test_a_short_run_of_all_of_it():
    udp = Buses("UDP", "virtual", (str(free_port()), str(free_port())))
    plan = Plan(Load.USUAL, 2.0, learn_s=1.0)
    run = live_run(plan, udp)
    assert run.sent == run.wanted == run.received == 2 * 3 * 650
    assert 0.0 < run.cpu_share < 2.0
    assert run.memory_mib > 50.0
    assert [fault for fault, _ in run.onsets] == [Fault(1.0, 1)]
    assert run.texts[0].text == "Watching 8 thrusters, speed and navigation"
    figures = live._figures(plan, run, udp.medium)
    console = Console(record=True, width=120)
    console.print(live.live_table([figures]))
    said = console.export_text()
    assert "3900" in said and "0 of 1" in said

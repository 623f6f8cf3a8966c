"""The benchmark of the bridge: a short run of both, and what is counted where frames are lost or overtaken."""

from __future__ import annotations

import pytest
from rich.console import Console

from hil_tests.bench import bridge
from hil_tests.live.bridge_buses import BridgedBus
from hil_tests.live.bridging import Bridge
from hil_tests.live.crossing import Player, Way, _way
from hil_tests.live.latency import latency
from hil_tests.loopback import free_port


@pytest.fixture
def players():
    bus = BridgedBus("bus", free_port(), free_port())
    with bus.node() as opened:
        yield Player(opened, 4), Player(opened, 4)


def test_what_never_came_is_lost_and_what_came_late_was_overtaken(players):
    source, target = players
    source.sent_ns[:] = [0, 1_000_000, 2_000_000, 3_000_000]
    target.heard = [(0, 500_000), (3, 4_000_000), (2, 5_000_000)]
    assert _way(source, target) == Way(4, 1, 1, latency([0.0005, 0.001, 0.003]))


def test_a_way_on_which_nothing_came(players):
    way = _way(*players)
    assert (way.sent, way.lost, way.overtaken) == (4, 4, 0)


def test_a_short_run_of_both_bridges():
    figures = [bridge.measured(one, seconds=0.2, rate_hz=500.0) for one in Bridge]
    ours = figures[0]
    for way in (ours.there, ours.back):
        assert (way.sent, way.lost, way.overtaken) == (100, 0, 0)
        assert 0.0 < way.took.median_ms <= way.took.max_ms
    assert figures[1].there.lost < 100
    console = Console(record=True, width=120)
    console.print(bridge.bridge_table(figures))
    said = console.export_text()
    assert "0 / 0" in said and "python-can" in said

"""Which heartbeats can be those of an autopilot."""

from __future__ import annotations

from collections import Counter

import pytest

from drivers.mavlink.autopilot import AutopilotChoice
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.tests.peer import Peer


@pytest.mark.parametrize("system", [0, 255])
def test_who_has_an_id_of_no_vehicle_is_no_autopilot(system):
    decoder = MavlinkDecoder([])
    assert decoder.decode(Peer(system=system).heartbeat(), 1.0) == []
    assert decoder.autopilot_system is None
    assert decoder.drops["system id of no vehicle"] == 1


@pytest.mark.parametrize("system", [0, 255])
def test_it_is_no_rival_of_the_one_that_is(system):
    drops = Counter()
    choice = AutopilotChoice(None, drops)
    for second, one in enumerate([1, system, 1, system]):
        choice.heartbeat(one, float(second))
    assert (choice.system_id, choice.rivals) == (1, (1,))
    assert drops == {"system id of no vehicle": 2}


@pytest.mark.parametrize("system", [1, 254])
def test_vehicles_have_all_other_ids(system):
    decoder = MavlinkDecoder([])
    assert len(decoder.decode(Peer(system=system).heartbeat(), 1.0)) == 1
    assert decoder.autopilot_system == system

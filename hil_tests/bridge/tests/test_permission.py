"""Never onto a real vehicle by accident: every combination of what is touched, what was said, and what is heard."""

from __future__ import annotations

from itertools import product

import pytest

from hil_tests.bridge.permission import ABSENT, Bus, Granted, HeardAutopilot, Touched, refusals, refusals_heard
from hil_tests.bridge.transmission import parse_transmission

REAL, VIRTUAL = Bus("can0", False, "can"), Bus("vcan0", True, "vcan")
ALL, SOME = parse_transmission("all"), parse_transmission("node:20-27")
ENDPOINT = "udpin:0.0.0.0:14550"
DISARMED, ARMED = HeardAutopilot("ArduSub (system 1)", False), HeardAutopilot("ArduSub (system 1)", True)

BUSES = [(), (VIRTUAL,), (REAL,), (VIRTUAL, REAL), (VIRTUAL, VIRTUAL)]
TOUCHED = [
    Touched(buses, bridge=bridge, lacking=lacking, mavlink=mavlink, arms=arms)
    for buses, bridge, lacking, mavlink, arms in product(
        BUSES, (False, True), ((), ("123",)), (None, ENDPOINT), (False, True)
    )
]
GRANTED = [Granted(*said) for said in product((None, SOME, ALL), (False, True), (False, True))]
HEARD = [(), (DISARMED,), (ARMED,), (DISARMED, ARMED)]


def may_transmit(touched, granted):
    """The first three rows of the module's table, said once more and otherwise."""
    if all(bus.virtual for bus in touched.buses) or granted.transmit is ALL:
        return True
    return granted.transmit is SOME and not touched.bridge and not touched.lacking


def is_safe(touched, granted, heard):
    """The other rows."""
    if all(bus.virtual for bus in touched.buses) and touched.mavlink is None:
        return True
    known = granted.no_autopilot != bool(heard)
    armed = touched.arms or ARMED in heard
    return known and (granted.while_armed or not armed)


@pytest.mark.parametrize("touched", TOUCHED, ids=str)
def test_it_begins_only_where_every_rule_is_kept(touched):
    for granted, heard in product(GRANTED, HEARD):
        if touched.lacking and granted.transmit is ALL:
            continue  # nothing is lacking then
        told = refusals(touched, granted) + refusals_heard(touched, granted, heard)
        assert (not told) == (may_transmit(touched, granted) and is_safe(touched, granted, heard)), (granted, heard)


def test_without_any_flag_nothing_real_is_ever_touched():
    for touched, heard in product(TOUCHED, HEARD):
        told = refusals(touched, Granted()) + refusals_heard(touched, Granted(), heard)
        if touched.real_buses:
            assert told
        if touched.mavlink is not None and (ARMED in heard or not heard):
            assert told


SAID = [
    (
        Touched((Bus("vcan0", False, ABSENT),)),
        Granted(),
        (),
        "no interface vcan0 is here",
        "ip link add vcan0 type vcan",
    ),
    (Touched((VIRTUAL, Bus("can7", False, ABSENT)), bridge=True), Granted(ALL), (), "no interface can7", "`ip link`"),
    (Touched((REAL,)), Granted(), (), "can0 is a real bus (can)", "--transmit node:20-27, --transmit 14040A0B,7E0"),
    (
        Touched((REAL, Bus("can1", False, "can")), bridge=True),
        Granted(),
        (),
        "and can1 is a real",
        "be: --transmit all",
    ),
    (
        Touched((REAL, VIRTUAL), bridge=True),
        Granted(SOME),
        (),
        "--bridge can0:vcan0",
        "--transmit all, not node:20-27",
    ),
    (
        Touched((REAL,), lacking=tuple(f"{one:03X}" for one in range(10))),
        Granted(SOME),
        (),
        "sends 000, 001, 002, 003, 004, 005, 006, 007 and 2 more",
        "add them",
    ),
    (Touched(mavlink=ENDPOINT, arms=True), Granted(), (DISARMED,), "the mission arms", "--while-armed"),
    (Touched(mavlink=ENDPOINT), Granted(), (ARMED,), "ArduSub (system 1) reports armed", "disarm it"),
    (
        Touched(mavlink=ENDPOINT),
        Granted(),
        (ARMED, HeardAutopilot("PX4 (system 2)", True)),
        "and PX4 (system 2) report armed",
        "--while-armed",
    ),
    (Touched(mavlink=ENDPOINT), Granted(), (), f"no autopilot is heard on {ENDPOINT}", "mend the endpoint"),
    (Touched((REAL,)), Granted(ALL), (), "no endpoint of the autopilot is named", "--mavlink, or say --no-autopilot"),
    (
        Touched(mavlink=ENDPOINT),
        Granted(no_autopilot=True),
        (DISARMED,),
        "--no-autopilot was said, but ArduSub (system 1) is heard",
        "leave it out",
    ),
]


@pytest.mark.parametrize(("touched", "granted", "heard", "seen", "way_out"), SAID)
def test_a_refusal_says_what_was_seen_and_the_way_out(touched, granted, heard, seen, way_out):
    told = refusals(touched, granted) or refusals_heard(touched, granted, heard)
    assert len(told) == 1
    assert seen in told[0] and way_out in told[0]


def test_all_that_is_wrong_is_said_at_once():
    touched = Touched((REAL, Bus("can1", False, "can")), bridge=True, mavlink=ENDPOINT, arms=True)
    assert len(refusals(touched, Granted(SOME))) == 2

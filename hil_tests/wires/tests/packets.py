"""Faults and packets for the tests of MAVLink wires."""

from __future__ import annotations

from math import inf

from hil_tests.scenario.failures import kinds_of
from hil_tests.scenario.fault import Fault, Subject
from hil_tests.wires.way import Towards

START_S = 1_700_000_000.0


def fault(target, failure, *, at_s=0.0, until_s=inf, ramp_s=0.0, thruster=None, axis=None, **given):
    """A fault as a scenario's file gives it: quantities that are left out have their defaults."""
    row = kinds_of(target)[failure]
    values = {quantity.name: given.get(quantity.name, quantity.default) for quantity in row.quantities}
    assert None not in values.values() and given.keys() <= values.keys()
    return Fault(
        subject=Subject(target, str(target), thruster), failure=failure, at_s=at_s, until_s=until_s, ramp_s=ramp_s,
        values=values, axis=axis,
    )  # fmt: skip


def played(wire, packets, towards=Towards.GATEWAY):
    """What arrives at last of (seconds since the start, packet), in the order of arrival."""
    arrived = []
    for at_s, packet in packets:
        while wire.next_s() < START_S + at_s:
            arrived += wire.due(wire.next_s())
        wire.put(START_S + at_s, packet, towards)
        arrived += wire.due(START_S + at_s)
    while wire.next_s() < START_S + 1e6:
        arrived += wire.due(wire.next_s())
    return [passed.item for passed in arrived if passed.towards is towards]

"""Each failure of each signal, in each message that carries it: written and read by pymavlink."""

from __future__ import annotations

from math import remainder
from pathlib import Path
from statistics import pstdev

import pytest

from drivers.mavlink.tests.peer import Peer, messages_in
from gateway.config import parse
from hil_tests.scenario.failures import SENSORS, Target, kinds_of
from hil_tests.wires.distortion import Distortion
from hil_tests.wires.mavlink_wire import MavlinkWire
from hil_tests.wires.tests.carriers import CARRIERS
from hil_tests.wires.tests.packets import START_S, fault
from hil_tests.wires.way import Towards

CONFIG = """
[vehicle]
name = "test"
[mavlink]
endpoint = "udpin:127.0.0.1:14660"
[[thruster]]
number = 1
command = { link = "mavlink", servo_channel = 9 }
rpm = { link = "mavlink", esc_index = 6, signed = true }
[[thruster]]
number = 2
command = { link = "mavlink", actuator = 2, minimum = 1100, neutral = 1500, maximum = 1900 }
rpm = { link = "mavlink", rpm_sensor = 2 }
"""
THRUSTERS = {"ESC_TELEMETRY_5_TO_8": 1, "SERVO_OUTPUT_RAW": 1, "RPM": 2, "ACTUATOR_OUTPUT_STATUS": 2}
ONSET_S, END_S = 3.0, 6.0
TIMES_S = [0.3 * n for n in range(30)]
RANDOM = {"noise", "garbage"}
SPECIAL = {"no_lock", "reset"}
SIZES = {
    Target.DVL: 0.3, Target.DEPTH: 0.5, Target.ACCELEROMETER: 1.0, Target.GYROSCOPE: 0.1, Target.HEADING: 20.0,
    Target.POSITION: 3.0, Target.RPM: 100.0, Target.COMMAND: 0.1,
}  # fmt: skip
CASES = [
    (carrier, failure)
    for carrier in CARRIERS
    for failure in kinds_of(carrier.target)
    if failure not in SPECIAL
]  # fmt: skip


def ids(value):
    return getattr(value, "name", value)


@pytest.fixture(scope="module")
def config():
    return parse(CONFIG, Path())


def sized(target, failure):
    """Quantities that a failure needs, of a size that suits the signal."""
    sizes = {"interval_s": 1.0, "delay_s": 0.7, "factor": 0.7, "share": 0.25, "period_s": 1.0}
    return {
        quantity.name: sizes.get(quantity.name, SIZES[target]) for quantity in kinds_of(target)[failure].quantities
    }


def passed(wire, carrier, packets, towards=Towards.GATEWAY):
    """(time, message or None): what pymavlink reads of what comes out."""
    arrived = []
    for time_s, packet in packets:
        wire.put(START_S + time_s, packet, towards)
        messages = messages_in(b"".join(one.item for one in wire.due(START_S + time_s)))
        assert len(messages) <= 1
        arrived.append((time_s, messages[0] if messages else None))
    return arrived


def told(carrier, value):
    """A value as a message can tell it."""
    if value is None:
        return None
    if carrier.target is Target.COMMAND:
        return tuple(max(-1.0, min(one, 1.0)) for one in value)
    return tuple(map(abs, value)) if carrier.target is Target.RPM else value


def differing(carrier, one, other):
    """By how much two values differ at most."""
    return max(abs(off(carrier, a - b)) for a, b in zip(one, other, strict=True))


def off(carrier, error):
    """An error, headings around the circle."""
    return remainder(error, 360.0) if carrier.target is Target.HEADING else error


def packets_of(carrier):
    peer = Peer()
    return [(time_s, peer.pack(carrier.make(time_s, carrier.value(time_s)))) for time_s in TIMES_S]


@pytest.mark.parametrize(("carrier", "failure"), CASES, ids=ids)
def test_each_failure_tells_what_it_should_and_only_while_it_lasts(carrier, failure, config):
    trouble = fault(
        carrier.target, failure, at_s=ONSET_S, until_s=END_S, thruster=THRUSTERS.get(carrier.name),
        **sized(carrier.target, failure),
    )  # fmt: skip
    wire, oracle = MavlinkWire([trouble], START_S, config=config), Distortion([trouble])
    packets = packets_of(carrier)
    before = [carrier.read(messages_in(packet)[0]) for _, packet in packets]
    errors = []
    for (time_s, message), true in zip(passed(wire, carrier, packets), before, strict=True):
        wanted = told(carrier, oracle.value(time_s, true))
        value = None if message is None else carrier.read(message)
        if not trouble.active(time_s):
            assert value == true
        elif failure in RANDOM:
            errors.append(off(carrier, value[0] - (true[0] if failure == "noise" else 0.0)))
        elif wanted is not None:
            assert differing(carrier, value, wanted) <= carrier.close
        elif carrier.silent == "withheld":
            assert message is None
        else:
            assert message is not None
            assert carrier.silent == "repeated" or value is None
    if failure in RANDOM:
        assert 0.2 * SIZES[carrier.target] < pstdev(errors) < 6.0 * SIZES[carrier.target]


def test_the_carriers_cover_all_sensors():
    assert {carrier.target for carrier in CARRIERS} == SENSORS | {Target.RPM, Target.COMMAND}

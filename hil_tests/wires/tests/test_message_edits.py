"""Vendor messages and VESC frames changed on their way: cantools and the gateway's decoder read what was wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path

import cantools
import pytest
from crccheck.crc import Crc8Autosar, Crc8SaeJ1850
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.can.messages.bit_field import BitField
from drivers.can.vesc_messages import Status, Status4, encode_command
from drivers.readings import ThrusterReport
from gateway.config import Config, load, parse
from gateway.wiring import can_decoder
from hil_tests.scenario.failures import Target, kinds_of
from hil_tests.wires.bit_writer import with_number
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.protection import Protection
from hil_tests.wires.tests.can_traffic import START_S, fault, passed, wire
from hil_tests.wires.way import Towards

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[2] / "gateway" / "examples"
DATABASE = cantools.database.load_file(HERE / "thruster_bus.dbc")
INTERVAL_S = 0.02
CONFIG = """
[vehicle]
name = "tests"

[[can]]
name = "can0"
interface = "socketcan"
channel = "can0"
protocol = "dbc"
database = "thruster_bus.dbc"

[[thruster]]
number = 1
command = { link = "can0", signal = "Command.First", minimum = -100, neutral = 0, maximum = 100 }
rpm = { link = "can0", signal = "Status.Speed", unit = "rpm", voltage = "Status.Voltage" }

[[thruster]]
number = 2
command = { link = "can0", signal = "Command.Second", minimum = -100, neutral = 0, maximum = 100, reverse = true }
rpm = { link = "can0", signal = "Paged.Rate", unit = "rps", reverse = true }

[[thruster]]
number = 3
command = { link = "can0", signal = "ThirdCommand.Third", minimum = -100, neutral = 0, maximum = 100 }
rpm = { link = "can0", signal = "Counted.Pulses", unit = "pulse_count", pole_pairs = 6, signed = false }
"""


@pytest.fixture(scope="module")
def config() -> Config:
    return parse(CONFIG, HERE)


@pytest.fixture(scope="module")
def signals(config: Config) -> CanSignals:
    return CanSignals.of(config, "can0")


def frames(name: str, count: int, values: Callable[[int], dict[str, float]], padding: int = 0) -> list[CanFrame]:
    """Frames of a message as cantools encodes it; bits of no signal are `padding`."""
    message = DATABASE.get_message_by_name(name)
    return [
        CanFrame(
            START_S + INTERVAL_S * n,
            message.frame_id,
            message.encode(values(n), padding=bool(padding)),
            message.is_extended_frame,
        )
        for n in range(count)
    ]


def decoded(name: str, arrived: Iterable[CanFrame]) -> list[dict[str, float]]:
    message = DATABASE.get_message_by_name(name)
    return [message.decode(frame.data) for frame in arrived]


def xor(data: bytes) -> int:
    value = 0
    for byte in data:
        value ^= byte
    return value


# By which checksum: written here anew, not that of the wire.
CHECKS: dict[str, Callable[[bytes], int]] = {
    "crc8_j1850": Crc8SaeJ1850.calc,
    "crc8_autosar": Crc8Autosar.calc,
    "sum8": lambda data: sum(data) % 256,
    "sum8_complement": lambda data: (256 - sum(data) % 256) % 256,
    "xor8": xor,
}


def checked_statuses(check: Callable[[bytes], int], count: int) -> list[CanFrame]:
    """Status with a counter, and the checksum over what stands before it."""
    plain = frames(
        "Status",
        count,
        lambda n: {"Speed": 1000 + n, "Voltage": 15.5, "RollingCounter": (250 + n) % 256, "CRC8": 0},
    )
    return [
        CanFrame(one.time_s, one.identifier, one.data[:7] + bytes([check(one.data[:7])]), extended=False)
        for one in plain
    ]


def complaints(arrived: Sequence[CanFrame], check: Callable[[bytes], int]) -> list[str]:
    """Of a receiver that checks checksum and counter."""
    broken = [f"checksum of {n}" for n, one in enumerate(arrived) if one.data[7] != check(one.data[:7])]
    counters = [one.data[6] for one in arrived]
    jumps = [f"{a} to {b}" for a, b in pairwise(counters) if b != (a + 1) % 256]
    return broken + jumps


@pytest.mark.parametrize("name", CHECKS)
def test_a_changed_frame_has_the_checksum_that_its_sender_would_have_given_it(name: str, signals: CanSignals) -> None:
    through = wire(fault("bias", "thruster 1 rpm", at_s=1.0, bias_rpm=-3000.0), signals=signals)
    sent = checked_statuses(CHECKS[name], 100)
    arrived = passed(through, sent)
    assert not complaints(arrived, CHECKS[name])
    assert arrived[:49] == sent[:49]
    told = decoded("Status", arrived)
    assert [one["Speed"] for one in told[51:]] == [n - 2000 for n in range(51, 100)]
    assert all(one["Voltage"] == 15.5 for one in told)
    assert set(through.counts) == {"rpm of thruster 1 changed"}


def test_frames_that_are_withheld_leave_no_hole_in_the_counter_then_or_later(signals: CanSignals) -> None:
    check = CHECKS["crc8_j1850"]
    through = wire(fault("slow", "thruster 1 rpm", at_s=1.0, until_s=3.0, interval_s=0.1), signals=signals)
    arrived = passed(through, checked_statuses(check, 200))
    assert len(arrived) == 200 - 80
    assert not complaints(arrived, check)


def test_a_checksum_that_is_not_known_is_left_and_counted(signals: CanSignals) -> None:
    through = wire(fault("bias", "thruster 1 rpm", bias_rpm=1.0), signals=signals)
    sent = checked_statuses(lambda data: (sum(data) * 7 + 3) % 256, 20)
    arrived = passed(through, sent)
    assert [one.data[7] for one in arrived] == [one.data[7] for one in sent]
    assert through.counts["checksum of Status not known, left as it was"] >= 18


def test_an_algorithm_can_be_named_and_a_wrong_name_is_refused(config: Config) -> None:
    signals = CanSignals.of(config, "can0", algorithms={"Status": "xor8"})
    (status,) = (one for one in signals.messages if one.layout.identifier == 512)
    assert status.protection == Protection("Status", 8, BitField(48, 8), 256, BitField(56, 8), "xor8")
    with pytest.raises(ValueError, match=r"algorithm = 'crc' of Status: want one of crc8_j1850, "):
        CanSignals.of(config, "can0", algorithms={"Status": "crc"})


def test_the_counter_of_a_command_begins_anew_where_the_database_says(signals: CanSignals) -> None:
    (command,) = (one for one in signals.messages if one.layout.identifier == 256)
    assert command.protection == Protection("Command", 8, BitField(8, 4), 15, BitField(0, 8))


def test_commands_in_one_message_are_changed_alone_each_in_its_own_bits(signals: CanSignals) -> None:
    check = CHECKS["crc8_autosar"]
    sent = [
        CanFrame(one.time_s, one.identifier, bytes([check(one.data[1:])]) + one.data[1:], extended=False)
        for one in frames(
            "Command",
            60,
            lambda n: {"Checksum": 0, "AliveCounter": n % 15, "Mode": 5, "First": 40.0, "Second": -20.0},
            padding=1,
        )
    ]
    through = wire(
        fault("scale", "thruster 1 command", at_s=0.5, factor=-0.5),
        fault("off", "thruster 2 command", at_s=0.5),
        signals=signals,
    )
    arrived = passed(through, sent, Towards.DEVICES)
    told = decoded("Command", arrived)
    assert [one["First"] for one in told] == [40.0 if n < 25 else -20.0 for n in range(60)]
    second = [one["Second"] for one in told]
    assert (second[:48], second[50:]) == ([-20.0] * 48, [0.0] * 10)  # kept for half a second
    assert [one["AliveCounter"] for one in told] == [n % 15 for n in range(60)]
    assert {one["Mode"] for one in told} == {5}
    assert all(one.data[0] == check(one.data[1:]) for one in arrived)
    assert {one.data[6:] for one in arrived} == {sent[0].data[6:]}  # bits of no signal
    assert passed(wire(fault("off", "thruster 1 command"), signals=signals), sent) == sent


def test_other_pages_of_a_multiplexed_message_pass_as_they_are(signals: CanSignals) -> None:
    sent = frames(
        "Paged", 20, lambda n: {"Page": 1, "Rate": -10.5} if n % 2 else {"Page": 2, "Temperature": 21.5}, padding=1
    )
    arrived = passed(wire(fault("wrong", "thruster 2 rpm", value_rpm=-90.0), signals=signals), sent)
    assert arrived[::2] == sent[::2]
    assert [one["Rate"] for one in decoded("Paged", arrived[1::2])] == [1.5] * 10
    assert [one.data[5:] for one in arrived] == [one.data[5:] for one in sent]


def test_a_count_of_pulses_runs_on_without_a_jump_at_the_end_of_the_fault(
    signals: CanSignals, config: Config
) -> None:
    sent = frames("Counted", 300, lambda n: {"Pulses": (65000 + 10 * n) % 65536, "Flags": 0xABCD})
    through = wire(fault("scale", "thruster 3 rpm", at_s=2.0, until_s=4.0, factor=0.5), signals=signals)
    arrived = passed(through, sent)
    told = speeds(config, arrived, 3)
    assert told[:99] == [pytest.approx(5000.0, rel=1e-3)] * 99
    assert told[101:199] == [pytest.approx(2500.0, rel=1e-3)] * 98
    assert told[201:] == [pytest.approx(5000.0, rel=1e-3)] * 98
    assert {one["Flags"] for one in decoded("Counted", arrived)} == {0xABCD}


def test_a_count_that_was_withheld_for_long_goes_on_with_the_true_one(signals: CanSignals, config: Config) -> None:
    sent = frames("Counted", 400, lambda n: {"Pulses": 10 * n, "Flags": 0})
    arrived = passed(wire(fault("off", "thruster 3 rpm", at_s=2.0, until_s=6.0), signals=signals), sent)
    assert len(arrived) == 200
    assert arrived[100:] == sent[300:]
    assert speeds(config, arrived, 3)[-90:] == [pytest.approx(5000.0, rel=1e-3)] * 90


def speeds(config: Config, arrived: Iterable[CanFrame], number: int) -> list[float]:
    """What the gateway reads; it must have nothing to complain of."""
    decoder = can_decoder(config.can[0], config.thruster)
    readings = [one for frame in arrived for one in decoder.decode(frame)]
    assert not decoder.drops
    return [
        one.speed_rpm
        for one in readings
        if isinstance(one, ThrusterReport) and one.thruster == number and one.speed_rpm is not None
    ]


def vesc_frames(count: int) -> list[CanFrame]:
    """Of the example's first thruster: commands, and two packets of status."""
    made = []
    for n in range(count):
        time_s = START_S + INTERVAL_S * n
        made += [
            encode_command("duty", 0.4, 10, time_s),
            Status(7000.0, 3.5, 0.4).frame(10, time_s),
            Status4(300.0, 310.0, 2.0).frame(10, time_s),
        ]
    return made


def test_vesc_speeds_and_commands() -> None:
    config = load(EXAMPLES / "vesc.toml")
    thruster = config.thruster[0]
    assert (thruster.command.control, thruster.command.controller_id) == ("duty", 10)
    signals = CanSignals.of(config, config.can[0].name)
    rpm, command = (f"thruster {thruster.number} {what}" for what in ("rpm", "command"))
    faults = [fault("scale", rpm, factor=0.5), fault("scale", command, factor=0.5)]
    sent = vesc_frames(5)
    arrived = passed(CanWire(config.can[0].name, signals, faults, START_S), sent)
    before, after = speeds(config, sent, thruster.number), speeds(config, arrived, thruster.number)
    assert after == [0.5 * one for one in before]
    assert [one.data[4:] for one in arrived] == [one.data[4:] for one in sent]
    arrived = passed(CanWire(config.can[0].name, signals, faults, START_S), sent, Towards.DEVICES)
    assert [one.data for one in arrived[::3]] == [encode_command("duty", 0.2, 10).data] * 5
    assert arrived[1::3] == sent[1::3]


@pytest.mark.parametrize("target", [Target.RPM, Target.COMMAND])
def test_every_failure_of_the_table_acts_on_vendor_messages_too(target: Target, signals: CanSignals) -> None:
    check = CHECKS["sum8"]
    towards = Towards.AUTOPILOT if target is Target.RPM else Towards.DEVICES
    commands = frames(
        "Command",
        80,
        lambda n: {"Checksum": 0, "AliveCounter": n % 15, "Mode": 0, "First": 40.0 + 0.1 * n, "Second": 0},
    )
    sent = checked_statuses(check, 80) if target is Target.RPM else commands
    for failure, row in kinds_of(target).items():
        needed = {one.name: 30.0 if "rpm" in one.name else 0.3 for one in row.quantities if one.default is None}
        through = wire(fault(failure, f"thruster 1 {target}", at_s=0.3, **needed), signals=signals)
        arrived = passed(through, sent, towards)
        assert [one.data for one in arrived] != [one.data for one in sent], failure
        assert target is Target.COMMAND or not complaints(arrived, check)


def test_a_second_sender_says_the_same_identifier_with_other_data(signals: CanSignals) -> None:
    check = CHECKS["crc8_j1850"]
    sent = checked_statuses(check, 100)
    through = wire(fault("node_conflict", at_s=1.0, node=1), signals=signals)
    arrived = passed(through, sent)
    second = [one for one in decoded("Status", arrived) if one["Speed"] == 0]
    assert len(second) == through.counts["frames of a second device"] == len(arrived) - 100
    assert 45 <= len(second) <= 50
    assert all(one.data[7] == check(one.data[:7]) for one in arrived)
    with pytest.raises(ValueError, match=r"node = 9 of can0 node conflict: .* want one of \[1, 2, 3\]"):
        wire(fault("node_conflict", node=9), signals=signals)


@settings(max_examples=200, deadline=None)
@given(
    data=st.binary(min_size=8, max_size=8),
    first=st.integers(0, 63),
    bits=st.integers(1, 32),
    big_endian=st.booleans(),
    number=st.integers(0, 2**32 - 1),
)
def test_a_number_is_written_where_it_is_read_and_nowhere_else(
    data: bytes, first: int, bits: int, big_endian: bool, number: int
) -> None:
    bits = min(bits, 64 - first)
    field = BitField(first, bits, big_endian)
    wanted = number % (1 << bits)
    written = with_number(data, field, wanted)
    assert field.reader(8)(written) == wanted
    assert with_number(written, field, field.reader(8)(data)) == data

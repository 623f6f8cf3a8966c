"""Our ESC messages against the `dronecan` package, both ways."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.can.dronecan.esc_status import ESC_STATUS, EscStatus, encode_esc_status, pack_status, unpack_status
from drivers.can.dronecan.setpoints import RAW_COMMAND, encode_raw_command
from drivers.can.tests import dronecan_reference as reference

commands = st.lists(st.integers(-8192, 8191), max_size=20)


def statuses_of(halves):
    integers = [st.integers(-131072, 131071), st.integers(0, 127), st.integers(0, 31)]
    return st.builds(EscStatus, st.integers(0, 0xFFFF_FFFF), halves, halves, halves, *integers)


def half(sign, bits):
    return struct.unpack("<e", (sign << 15 | bits).to_bytes(2, "little"))[0]


# The package flushes subnormal numbers to zero, sends infinity as 65504, and has its own bit pattern for NaN.
finite_halves = st.just(0.0) | st.builds(half, st.integers(0, 1), st.integers(0x0400, 0x7BFF))
finite_statuses = statuses_of(finite_halves)
statuses = statuses_of(finite_halves | st.sampled_from([math.nan, math.inf, -math.inf]))
nodes = st.integers(1, 127)
transfer_ids = st.integers(0, 31)


def same(a, b):
    return a == b or (math.isnan(a) and math.isnan(b))


def test_signatures_are_those_of_the_definitions():
    assert reference.esc.RawCommand.get_data_type_signature() == RAW_COMMAND.data_type.signature
    assert reference.esc.Status.get_data_type_signature() == ESC_STATUS.signature
    assert reference.esc.RawCommand.default_dtid == RAW_COMMAND.data_type.identifier
    assert reference.esc.Status.default_dtid == ESC_STATUS.identifier


@given(commands, nodes, transfer_ids)
@settings(max_examples=40)
def test_raw_command_goes_out_as_the_package_sends_it(values, node, transfer_id):
    theirs = reference.encode(reference.esc.RawCommand(cmd=values), node, transfer_id)
    assert encode_raw_command(values, node, transfer_id, priority=16) == theirs


@given(commands, nodes, transfer_ids)
@settings(max_examples=40)
def test_the_package_reads_our_raw_command(values, node, transfer_id):
    transfer = reference.decode(encode_raw_command(values, node, transfer_id))
    assert [int(value) for value in transfer.payload.cmd] == values
    assert (transfer.source_node_id, transfer.transfer_id, transfer.transfer_priority) == (node, transfer_id, 7)


@given(commands)
def test_commands_survive_packing(values):
    assert RAW_COMMAND.unpack(RAW_COMMAND.pack(values)) == values


@given(finite_statuses, nodes, transfer_ids)
@settings(max_examples=40)
def test_status_goes_out_as_the_package_sends_it(values, node, transfer_id):
    theirs = reference.encode(reference.status(values), node, transfer_id)
    assert encode_esc_status(values, node, transfer_id) == theirs


@given(statuses, nodes, transfer_ids)
@settings(max_examples=40)
def test_the_package_reads_our_status(values, node, transfer_id):
    payload = reference.decode(encode_esc_status(values, node, transfer_id)).payload
    assert (payload.error_count, payload.rpm) == (values.error_count, values.speed_rpm)
    assert (payload.power_rating_pct, payload.esc_index) == (values.power_percent, values.esc_index)
    assert same(payload.voltage, values.voltage_v)
    assert same(payload.current, values.current_a)
    assert same(payload.temperature, values.temperature_k)


@given(statuses)
def test_status_survives_packing(values):
    back = unpack_status(pack_status(values))
    for name in EscStatus._fields:
        assert same(getattr(back, name), getattr(values, name)), name


@pytest.mark.parametrize("size", [size for size in range(64) if size not in {(14 * n + 7) // 8 for n in range(21)}])
def test_commands_of_an_impossible_length_are_none(size):
    assert RAW_COMMAND.unpack(bytes(size)) is None


@pytest.mark.parametrize("size", [size for size in range(64) if size != 14])
def test_a_status_of_an_impossible_length_is_none(size):
    assert unpack_status(bytes(size)) is None


@pytest.mark.parametrize("value", [65519.9, 65520.0, 1e9, -65520.0, math.inf, -math.inf])
def test_a_float_beyond_half_precision_goes_out_as_infinity(value):
    back = unpack_status(pack_status(EscStatus(0, value, 0.0, 0.0, 0, 0, 0)))
    assert back.voltage_v == (65504.0 if abs(value) < 65520.0 else math.copysign(math.inf, value))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"error_count": -1}, "error_count must lie in 0..4294967295, got -1"),
        ({"speed_rpm": 131072}, "speed_rpm"),
        ({"speed_rpm": -131073}, "speed_rpm"),
        ({"power_percent": 128}, "power_percent"),
        ({"esc_index": 32}, "esc_index"),
    ],
)
def test_a_status_that_does_not_fit_the_wire_is_refused(fields, message):
    values = {"error_count": 0, "speed_rpm": 0, "power_percent": 0, "esc_index": 0} | fields
    with pytest.raises(ValueError, match=message):
        pack_status(EscStatus(voltage_v=0.0, current_a=0.0, temperature_k=0.0, **values))


@pytest.mark.parametrize(
    ("values", "node", "priority", "message"),
    [
        ([8192], 10, 7, "-8192..8191, got 8192"),
        ([-8193], 10, 7, "-8193"),
        ([0] * 21, 10, 7, "at most 20, got 21"),
        ([0], 0, 7, "source_node must lie in 1..127, got 0"),
        ([0], 128, 7, "source_node"),
        ([0], 10, 32, "priority must lie in 0..31, got 32"),
    ],
)
def test_a_command_that_does_not_fit_the_wire_is_refused(values, node, priority, message):
    with pytest.raises(ValueError, match=message):
        encode_raw_command(values, node, 0, priority=priority)

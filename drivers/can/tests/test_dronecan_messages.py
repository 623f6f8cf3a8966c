"""RPMCommand, StatusExtended and NodeStatus against the `dronecan` package, both ways."""

from __future__ import annotations

import dronecan
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.bus_readings import Health, NodeMode
from drivers.can.dronecan import (
    EscStatusExtended,
    NodeStatus,
    encode_node_status,
    encode_raw_command,
    encode_rpm_command,
    encode_status_extended,
)
from drivers.can.dronecan.esc_status import STATUS_EXTENDED, pack_status_extended, unpack_status_extended
from drivers.can.dronecan.node_status import NODE_STATUS, pack_node_status, unpack_node_status
from drivers.can.dronecan.setpoints import RAW_COMMAND, RPM_COMMAND
from drivers.can.tests import dronecan_reference as reference

speeds_rpm = st.lists(st.integers(-131_072, 131_071), max_size=20)
nodes = st.integers(1, 127)
transfer_ids = st.integers(0, 31)
extended = st.builds(
    EscStatusExtended,
    st.integers(0, 127),
    st.integers(0, 127),
    st.integers(-256, 255),
    st.integers(0, 511),
    st.integers(0, 0x7FFFF),
    st.integers(0, 31),
)
node_statuses = st.builds(
    NodeStatus,
    st.integers(0, 0xFFFF_FFFF),
    st.sampled_from(Health),
    st.sampled_from(NodeMode),
    st.integers(0, 0xFFFF),
)


def their_extended(values: EscStatusExtended):
    return reference.esc.StatusExtended(
        input_pct=values.input_percent,
        output_pct=values.output_percent,
        motor_temperature_degC=values.motor_temperature_c,
        motor_angle=values.motor_angle_deg,
        status_flags=values.status_flags,
        esc_index=values.esc_index,
    )


def their_node_status(values: NodeStatus):
    return dronecan.uavcan.protocol.NodeStatus(
        uptime_sec=values.uptime_s,
        health=values.health,
        mode=values.mode,
        sub_mode=0,
        vendor_specific_status_code=values.vendor_status,
    )


@pytest.mark.parametrize(
    ("theirs", "ours"),
    [
        (reference.esc.RPMCommand, RPM_COMMAND.data_type),
        (reference.esc.StatusExtended, STATUS_EXTENDED),
        (dronecan.uavcan.protocol.NodeStatus, NODE_STATUS),
    ],
)
def test_signatures_are_those_of_the_definitions(theirs, ours):
    assert (theirs.default_dtid, theirs.get_data_type_signature()) == (ours.identifier, ours.signature)
    assert (theirs.get_max_bitlen() + 7) // 8 in (ours.payload_max, ours.payload_max + 1)  # + 1: a length of 5 bits


@given(speeds_rpm, nodes, transfer_ids)
@settings(max_examples=30)
def test_rpm_command_goes_out_as_the_package_sends_it_and_comes_back(values, node, transfer_id):
    theirs = reference.encode(reference.esc.RPMCommand(rpm=values), node, transfer_id)
    ours = encode_rpm_command(values, node, transfer_id, priority=16)
    assert ours == theirs
    assert [int(value) for value in reference.decode(ours).payload.rpm] == values
    assert RPM_COMMAND.unpack(RPM_COMMAND.pack(values)) == values


@given(extended, nodes, transfer_ids)
@settings(max_examples=30)
def test_status_extended_goes_out_as_the_package_sends_it_and_comes_back(values, node, transfer_id):
    assert encode_status_extended(values, node, transfer_id) == reference.encode(
        their_extended(values), node, transfer_id
    )
    assert unpack_status_extended(pack_status_extended(values)) == values


@given(node_statuses, nodes, transfer_ids)
@settings(max_examples=30)
def test_node_status_goes_out_as_the_package_sends_it_and_comes_back(values, node, transfer_id):
    assert encode_node_status(values, node, transfer_id) == reference.encode(
        their_node_status(values), node, transfer_id
    )
    assert unpack_node_status(pack_node_status(values)) == values


@given(st.sampled_from([RAW_COMMAND, RPM_COMMAND]), st.data())
@settings(max_examples=40)
def test_a_column_of_words_is_the_words_one_by_one(message, data):
    number = st.integers(message.minimum, message.maximum)
    several = data.draw(st.lists(st.lists(number, min_size=1, max_size=20), min_size=1, max_size=4))
    packed = [message.pack(numbers) for numbers in several]
    columns = np.frombuffer(b"".join(one.ljust(45, b"\0") for one in packed), np.uint8).reshape(-1, 45)
    index = data.draw(st.integers(0, 19))
    words = message.word_column(columns, index)
    for row, numbers in enumerate(several):
        if index < len(numbers):
            assert int(words[row]) == message.words(packed[row])[index]
            assert message.number(words)[row] == numbers[index]


@pytest.mark.parametrize("size", range(9))
def test_a_payload_of_another_length_is_none(size):
    assert (unpack_node_status(bytes(size)) is None) == (size != 7)
    assert (unpack_status_extended(bytes(size)) is None) == (size != 7)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: encode_rpm_command([131_072], 1, 0), "each command must lie in -131072..131071, got 131072"),
        (lambda: encode_rpm_command([0] * 21, 1, 0), "commands must be at most 20, got 21"),
        (lambda: encode_raw_command([0], 0, 0), "source_node must lie in 1..127, got 0"),
        (lambda: encode_node_status(NodeStatus(-1), 1, 0), "uptime_s must lie in 0..4294967295, got -1"),
        (lambda: encode_node_status(NodeStatus(0, vendor_status=65_536), 1, 0), "vendor_status"),
        (lambda: encode_status_extended(EscStatusExtended(128, 0, 0, 0, 0, 0), 1, 0), "input_percent must lie in"),
        (lambda: encode_status_extended(EscStatusExtended(0, 0, 256, 0, 0, 0), 1, 0), "motor_temperature_c"),
        (lambda: encode_status_extended(EscStatusExtended(0, 0, 0, 0, 1 << 19, 0), 1, 0), "status_flags"),
        (lambda: encode_status_extended(EscStatusExtended(0, 0, 0, 0, 0, 32), 1, 0), "esc_index"),
    ],
)
def test_what_does_not_fit_the_wire_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()

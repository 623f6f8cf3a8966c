"""Nodes of a DroneCAN bus: how they are, and those that should not be there; a healthy bus accuses nobody."""

from __future__ import annotations

import random

import pytest

from drivers.bus_readings import (
    BabblingNode,
    CommanderConflict,
    EscCondition,
    EscConflict,
    Health,
    NodeHealth,
    NodeIdConflict,
    NodeMode,
)
from drivers.can.dronecan import (
    DroneCanDecoder,
    DroneCanThruster,
    EscStatus,
    EscStatusExtended,
    NodeStatus,
    encode_esc_status,
    encode_node_status,
    encode_raw_command,
    encode_rpm_command,
    encode_status_extended,
)
from drivers.can.frame import CanFrame
from drivers.readings import ThrusterCommand, ThrusterReport

THREE = [DroneCanThruster(number, esc_index) for number, esc_index in ((3, 0), (1, 1), (2, 4))]
PINNED = [DroneCanThruster(3, 2, node_id=20)]


def feed(decoder, frames):
    return [reading for frame in frames for reading in decoder.decode(frame)]


def others(readings):
    return [one for one in readings if not isinstance(one, ThrusterCommand | ThrusterReport)]


def of_kind(readings, kind):
    return [one for one in readings if isinstance(one, kind)]


class Device:
    """What one device on the bus sends: it counts its messages by itself, from some number on."""

    def __init__(self, node: int, esc_index: int = 0, count: int = 0, started_s: float = 0.0) -> None:
        self.node, self.esc_index, self.started_s = node, esc_index, started_s
        self.statuses = self.nodes = self.commands = count

    def status(self, time_s: float) -> list[CanFrame]:
        self.statuses += 1
        values = EscStatus(0, 16.0, 2.0, 300.0, 1000, 50, self.esc_index)
        return encode_esc_status(values, self.node, self.statuses, time_s=time_s)

    def node_status(self, time_s: float, health=Health.OK, mode=NodeMode.OPERATIONAL) -> list[CanFrame]:
        self.nodes += 1
        values = NodeStatus(int(time_s - self.started_s), health, mode)
        return encode_node_status(values, self.node, self.nodes, time_s=time_s)

    def command(self, time_s: float, encode=encode_raw_command) -> list[CanFrame]:
        self.commands += 1
        return encode([100] * 5, self.node, self.commands, time_s=time_s)


# Who speaks for an ESC


def test_two_nodes_that_claim_one_index_are_told_at_once_and_every_ten_seconds():
    decoder, first, second = DroneCanDecoder(THREE), Device(11), Device(12)
    frames = [frame for n in range(1250) for one in (first, second) for frame in one.status(100.0 + 0.02 * n)]
    readings = feed(decoder, frames)
    conflicts = of_kind(readings, EscConflict)
    assert [round(one.time_s, 2) for one in conflicts] == [100.02, 110.02, 120.02]
    assert {(one.thruster, one.esc_index, one.node_ids, one.node_id) for one in conflicts} == {(3, 0, (11, 12), None)}
    assert len(of_kind(readings, ThrusterReport)) == 1250 and decoder.drops == {"duplicate source": 1250}


def test_a_third_claimant_is_told_when_it_comes():
    decoder, three = DroneCanDecoder(THREE), [Device(node) for node in (11, 12, 13)]
    readings = []
    for n in range(100):
        for one in three[: 2 if n < 50 else 3]:
            readings += feed(decoder, one.status(100.0 + 0.02 * n))
    assert [one.node_ids for one in of_kind(readings, EscConflict)] == [(11, 12), (11, 12, 13)]


@pytest.mark.parametrize("silence_s", [0.5, 3.5])
def test_a_successor_is_no_conflict(silence_s):
    """An ESC that restarts with another node id, or is changed: once the new one speaks, the old one never does."""
    decoder, old, new = DroneCanDecoder(THREE), Device(11), Device(12)
    readings = [one for n in range(50) for one in feed(decoder, old.status(100.0 + 0.02 * n))]
    later = [one for n in range(250) for one in feed(decoder, new.status(101.0 + silence_s + 0.02 * n))]
    assert others([*readings, *later]) == []
    assert len(later) >= 50


def test_the_wrong_node_is_told_at_once_and_with_the_right_one():
    decoder, wrong, right = DroneCanDecoder(PINNED), Device(21, 2), Device(20, 2)
    readings = feed(decoder, [*wrong.status(1.0), *wrong.status(1.1), *right.status(1.2), *wrong.status(1.3)])
    assert others(readings) == [EscConflict(1.0, 3, 2, (21,), 20), EscConflict(1.2, 3, 2, (20, 21), 20)]
    assert len(of_kind(readings, ThrusterReport)) == 1 and decoder.drops == {"unknown node": 3}


def test_one_node_with_four_escs_claims_four_indices():
    decoder = DroneCanDecoder([DroneCanThruster(index + 1, index) for index in range(4)])
    device = Device(11)
    for n in range(200):
        device.esc_index = n % 4
        assert others(feed(decoder, device.status(0.005 * n))) == []


# Who commands


def test_two_commanders_are_told_whichever_message_they_use():
    decoder, pilot, other = DroneCanDecoder(THREE), Device(10), Device(99, count=5)
    readings = feed(decoder, [*pilot.command(0.0), *other.command(0.1, encode_rpm_command), *pilot.command(0.2)])
    assert others(readings) == [CommanderConflict(0.2, (10, 99))]


def test_a_thruster_is_commanded_by_the_message_that_it_is_configured_for():
    wired = [DroneCanThruster(1, 0, maximum_rpm=2000.0), DroneCanThruster(2, 1), DroneCanThruster(3, 2, reverse=True)]
    wired += [DroneCanThruster(4, 3, maximum_rpm=4000.0, reverse=True), DroneCanThruster(5, 6, maximum_rpm=4000.0)]
    decoder = DroneCanDecoder(wired)
    speeds = encode_rpm_command([1000, 5, 5, 1000, 0, 0], 10, 0, time_s=1.0)
    counts = encode_raw_command([5, 8191, 8191], 10, 0, time_s=1.0)
    assert feed(decoder, speeds) == [ThrusterCommand(1.0, 1, 0.5), ThrusterCommand(1.0, 4, -0.25)]
    assert feed(decoder, counts) == [ThrusterCommand(1.0, 2, 1.0), ThrusterCommand(1.0, 3, -1.0)]
    assert feed(decoder, encode_rpm_command([2500], 10, 1, time_s=1.1)) == []
    assert decoder.drops == {"command missing": 3, "command out of range": 1}


# How nodes are


def test_health_is_told_on_every_change_and_now_and_then_with_the_thrusters():
    decoder, device = DroneCanDecoder(THREE), Device(11, esc_index=4)
    readings = feed(decoder, device.node_status(1.0))
    feed(decoder, device.status(1.5))
    for n in range(2, 12):
        readings += feed(decoder, device.node_status(float(n), Health.CRITICAL if n == 10 else Health.OK))
    said = [(one.time_s, one.health, one.thrusters, one.uptime_s) for one in readings]
    ok = Health.OK
    assert said == [
        (1.0, ok, (), 1),
        (2.0, ok, (2,), 2),
        (7.0, ok, (2,), 7),
        (10.0, Health.CRITICAL, (2,), 10),
        (11.0, ok, (2,), 11),
    ]


def test_the_node_of_the_configuration_is_known_before_it_speaks_as_an_esc():
    (health,) = feed(DroneCanDecoder(PINNED), Device(20).node_status(5.0, mode=NodeMode.MAINTENANCE))
    assert health == NodeHealth(5.0, 20, Health.OK, NodeMode.MAINTENANCE, 5, (3,))


def test_condition_is_told_when_flags_change_and_now_and_then():
    decoder, flags, told = DroneCanDecoder(THREE), 0, []
    for n in range(40):
        flags = 0x40000 if n >= 10 else 0
        values = EscStatusExtended(60, 55, 41, 5, flags, 1)
        told += feed(decoder, encode_status_extended(values, 11, n, time_s=0.2 * n))
    assert [round(one.time_s, 1) for one in told] == [0.0, 2.0, 7.0]
    assert told[1] == EscCondition(2.0, 1, 60, 55, pytest.approx(314.15), 0x40000)


def test_the_condition_of_another_node_or_esc_is_dropped():
    decoder = DroneCanDecoder(PINNED)
    assert feed(decoder, encode_status_extended(EscStatusExtended(0, 0, 0, 0, 0, 2), 21, 0)) == []
    assert feed(decoder, encode_status_extended(EscStatusExtended(0, 0, 0, 0, 0, 7), 20, 0)) == []
    assert decoder.drops == {"unknown node": 1, "unknown ESC": 1}


# Two devices with one node id


@pytest.mark.parametrize(
    ("count", "started_s", "apart_s"), [(7, 0.0, 0.4), (0, 0.0, 0.4), (0, 60.0, 0.4), (16, 3.0, 0)]
)
def test_two_devices_with_one_node_id_are_told_within_ten_seconds(count, started_s, apart_s):
    """Switched on together, so that they count alike; or one after the other."""
    decoder, first, second = DroneCanDecoder(THREE), Device(11), Device(11, count=count, started_s=started_s)
    readings = []
    for n in range(100, 130):
        readings += feed(decoder, [*first.node_status(float(n)), *second.node_status(n + apart_s)])
    told = of_kind(readings, NodeIdConflict)
    assert 1 <= told[0].time_s - 100.0 <= 10.0 and told[0].node_id == 11
    assert len(told) >= 2


@pytest.mark.parametrize("loss", [0.0, 0.02, 0.3])
def test_one_device_is_not_two_with_losses_repetitions_and_restarts(loss):
    chance, decoder, device = random.Random(1), DroneCanDecoder(THREE), Device(11)
    told = []
    for n in range(1200):
        time_s = n + 0.05 * chance.random()
        if n % 200 == 150:
            device = Device(11, started_s=time_s)
        frames = device.node_status(time_s)
        if chance.random() < loss:
            continue
        told += feed(decoder, frames)
        if chance.random() < 0.2:
            told += feed(decoder, frames)  # CAN may deliver a frame twice
    assert of_kind(told, NodeIdConflict) == []
    assert decoder.drops["repeated transfer"] > 100


# A node that babbles


def test_a_node_that_fills_the_bus_babbles_and_eight_escs_do_not():
    decoder, escs, babbler = DroneCanDecoder(THREE), [Device(20 + index, index) for index in range(8)], Device(30, 1)
    quiet = [one for n in range(100) for esc in escs for one in feed(decoder, esc.status(0.02 * n))]
    assert of_kind(quiet, BabblingNode) == []
    readings = [one for n in range(2000) for one in feed(decoder, babbler.status(10.0 + n / 2000))]
    (told,) = of_kind(readings, BabblingNode)
    assert (told.node_id, told.frames_per_s) == (30, 3000) and 10.4 < told.time_s < 10.6


@pytest.mark.parametrize("data", [b"", bytes(7) + b"\x80", bytes(6) + b"\xc0", bytes(7) + b"\xe0"])
def test_a_node_status_that_is_none_is_counted(data):
    decoder = DroneCanDecoder(THREE)
    assert list(decoder.decode(CanFrame(0.0, 341 << 8 | 20, data))) == []
    assert decoder.drops == {"wrong length": 1}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"maximum_rpm": 0.0}, "maximum_rpm must be positive, got 0.0"),
        ({"maximum_rpm": 100.0, "bidirectional_command": False}, "bidirectional_command must be True"),
    ],
)
def test_an_impossible_rpm_command_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        DroneCanThruster(1, 0, **options)

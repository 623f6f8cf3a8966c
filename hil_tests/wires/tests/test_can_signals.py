"""Speeds and commands of DroneCAN ESCs changed on their way: two independent decoders read what was wanted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf
from pathlib import Path
from typing import Any

import pytest
from dronecan import transport

from drivers.bus_readings import NodeIdConflict
from drivers.can.dronecan import (
    DroneCanDecoder,
    DroneCanThruster,
    EscStatus,
    NodeStatus,
    encode_esc_status,
    encode_node_status,
    encode_raw_command,
    encode_rpm_command,
)
from drivers.can.frame import CanFrame
from drivers.readings import Reading, ThrusterCommand, ThrusterReport
from gateway.config import load
from hil_tests.scenario.failures import Target, kinds_of
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.tests.can_traffic import START_S, fault, passed, wire
from hil_tests.wires.way import Towards

EXAMPLES = Path(__file__).parents[3] / "gateway" / "examples"
THRUSTERS = tuple(DroneCanThruster(number, number - 1) for number in range(1, 9))
EVERY = frozenset(range(1, 9))
SIGNALS = CanSignals("dronecan", THRUSTERS, speeds=EVERY, commands=EVERY)
INTERVAL_S = 0.02
RPM, COMMAND = "thruster 3 rpm", "thruster 3 command"


def statuses(count: int, index: int = 2, node: int = 13, rpm: int = 1000) -> list[CanFrame]:
    """esc.Status of one ESC, three frames each, a fifth of a millisecond apart; the speed goes up by 1 each time."""
    frames = []
    for n in range(count):
        status = EscStatus(7, 15.5, 2.25, float("nan"), rpm + n, 33, index)
        whole = encode_esc_status(status, node, n, time_s=START_S + INTERVAL_S * n)
        frames += [
            CanFrame(frame.time_s + 0.0002 * place, frame.identifier, frame.data) for place, frame in enumerate(whole)
        ]
    return frames


def commands(count: int, numbers: Sequence[int] = (100, -200, 4096, 0, 8191, -8191, 1, 2)) -> list[CanFrame]:
    """esc.RawCommand for eight ESCs."""
    return [
        frame for n in range(count) for frame in encode_raw_command(numbers, 10, n, time_s=START_S + INTERVAL_S * n)
    ]


def changing_commands(count: int) -> list[CanFrame]:
    """As `commands`, with another one for thruster 3 each time."""
    return [
        frame
        for n in range(count)
        for frame in encode_raw_command([0, 0, 4000 + n] + [0] * 5, 10, n, time_s=START_S + INTERVAL_S * n)
    ]


def decoded(frames: Iterable[CanFrame], thrusters: Sequence[DroneCanThruster] = THRUSTERS) -> list[Reading]:
    """Readings of our decoder, which must have nothing to complain of."""
    decoder = DroneCanDecoder(thrusters)
    readings = [reading for frame in frames for reading in decoder.decode(frame)]
    assert not decoder.drops
    return readings


def reference(frames: Iterable[CanFrame]) -> list[Any]:
    """Messages of the `dronecan` package; a broken transfer raises."""
    manager, messages = transport.TransferManager(), []
    for frame in frames:
        whole = manager.receive_frame(transport.Frame(frame.identifier, frame.data, ts_monotonic=frame.time_s))
        if whole:
            transfer = transport.Transfer()
            transfer.from_frames(whole)
            messages.append(transfer.payload)
    return messages


def speeds(frames: Iterable[CanFrame], number: int = 3) -> list[float | None]:
    return [one.speed_rpm for one in decoded(frames) if isinstance(one, ThrusterReport) and one.thruster == number]


def commanded(frames: Iterable[CanFrame], number: int = 3) -> list[float]:
    return [one.fraction for one in decoded(frames) if isinstance(one, ThrusterCommand) and one.thruster == number]


def test_a_changed_speed_is_read_by_both_decoders_and_all_else_stays_as_it_was() -> None:
    through = wire(fault("bias", RPM, at_s=0.5, bias_rpm=-1500.0), signals=SIGNALS)
    sent = statuses(50)
    arrived = passed(through, sent)
    assert speeds(arrived) == [1000 + n if n < 25 else n - 500 for n in range(50)]
    ours, theirs = reference(sent), reference(arrived)
    assert [one.rpm for one in theirs] == speeds(arrived)
    for before, after in zip(ours, theirs, strict=True):
        for name in ("error_count", "voltage", "current", "power_rating_pct", "esc_index"):
            assert getattr(before, name) == getattr(after, name)
    assert [frame.identifier for frame in arrived] == [frame.identifier for frame in sent]
    assert [frame.data[-1] for frame in arrived] == [frame.data[-1] for frame in sent]
    assert through.counts == {"rpm of thruster 3 changed": 25}


def test_frames_of_a_changed_transfer_come_with_its_last_one_and_others_at_once() -> None:
    sent = statuses(3) + statuses(3, index=4, node=15)
    sent.sort(key=lambda frame: frame.time_s)
    arrived = passed(wire(fault("scale", RPM, factor=0.5), signals=SIGNALS), sent)
    of_3 = [frame for frame in arrived if frame.identifier & 0x7F == 13]
    assert [frame.time_s for frame in of_3] == [
        pytest.approx(START_S + INTERVAL_S * n + 0.0004, abs=1e-6) for n in range(3) for _ in range(3)
    ]
    others = [frame for frame in sent if frame.identifier & 0x7F == 15]
    assert [frame for frame in arrived if frame.identifier & 0x7F == 15][3:] == others[3:]
    assert speeds(arrived, 5) == [1000, 1001, 1002]


def test_a_reverse_thruster_and_one_without_sign_are_changed_as_they_are_read() -> None:
    thrusters = (DroneCanThruster(3, 2, reverse=True), DroneCanThruster(4, 3, signed=False))
    signals = CanSignals("dronecan", thrusters, speeds=frozenset({3, 4}))
    arrived = passed(wire(fault("wrong", RPM, value_rpm=500.0), signals=signals), statuses(2))
    assert [one.rpm for one in reference(arrived)] == [-500, -500]
    arrived = passed(wire(fault("wrong", "thruster 4 rpm", value_rpm=-500.0), signals=signals), statuses(2, index=3))
    assert [one.rpm for one in reference(arrived)] == [500, 500]


def test_speeds_that_are_withheld_leave_no_hole_in_the_transfer_ids() -> None:
    through = wire(fault("slow", RPM, at_s=1.0, until_s=9.0, interval_s=0.64), signals=SIGNALS)
    arrived = passed(through, statuses(500))  # 32 transfers an interval: without renumbering all had the same id
    tails = [frame.data[-1] & 0x1F for frame in arrived[::3]]
    assert tails == [n % 32 for n in range(len(tails))]
    assert speeds(arrived)[50:63] == [1050 + 32 * n for n in range(13)]
    assert speeds(arrived)[63:] == [1450 + n for n in range(50)]
    assert through.counts["rpm of thruster 3 withheld"] == 500 - 50 - 13 - 50


def test_a_transfer_that_is_broken_already_passes_as_it_is() -> None:
    sent = statuses(3)
    del sent[4]  # the middle of the second
    through = wire(fault("scale", RPM, factor=0.5), signals=SIGNALS)
    arrived = passed(through, sent)
    assert [frame.data for frame in arrived[3:5]] == [sent[3].data, sent[4].data]
    assert [one.rpm for one in reference([*arrived[:3], *arrived[5:]])] == [500, 501]


def test_a_transfer_that_has_begun_before_the_onset_passes_as_it_is() -> None:
    sent = statuses(2)
    arrived = passed(wire(fault("wrong", RPM, at_s=0.0203, value_rpm=5.0), signals=SIGNALS), sent)
    assert arrived == sent


def test_a_changed_command_is_read_by_both_decoders_and_only_towards_the_devices() -> None:
    fault_s = fault("scale", COMMAND, at_s=0.09, factor=-2.0)
    sent = commands(10)
    arrived = passed(wire(fault_s, signals=SIGNALS), sent, Towards.DEVICES)
    assert [list(one.cmd) for one in reference(arrived)] == [
        [100, -200, 4096 if n < 5 else -8191, 0, 8191, -8191, 1, 2] for n in range(10)
    ]
    assert commanded(arrived)[:5] == [4096 / 8191] * 5
    assert passed(wire(fault_s, signals=SIGNALS), sent, Towards.AUTOPILOT) == sent


def test_a_command_that_is_off_is_kept_for_half_a_second_and_then_neutral_and_others_go_on() -> None:
    arrived = passed(wire(fault("off", COMMAND, at_s=1.0), signals=SIGNALS), commands(100), Towards.DEVICES)
    said = commanded(arrived)
    assert said[:74] == [4096 / 8191] * 74
    assert said[76:] == [0.0] * 24
    assert commanded(arrived, 5) == [1.0] * 100


def test_rpm_commands_and_neutral_at_half_scale() -> None:
    by_rpm = (DroneCanThruster(3, 2, maximum_rpm=3000.0, reverse=True),)
    signals = CanSignals("dronecan", by_rpm, commands=frozenset({3}))
    sent = encode_rpm_command([0, 0, 1500], 10, 0, time_s=START_S)
    arrived = passed(wire(fault("bias", COMMAND, bias_share=0.25), signals=signals), sent, Towards.DEVICES)
    assert list(reference(arrived)[0].rpm) == [0, 0, 750]
    half = (DroneCanThruster(1, 0, bidirectional_command=False), DroneCanThruster(3, 2, bidirectional_command=False))
    signals = CanSignals("dronecan", half, commands=frozenset({1, 3}))
    wrong = fault("wrong", COMMAND, value_share=0.5)
    arrived = passed(
        wire(wrong, signals=signals), encode_raw_command([4096] * 3, 10, 0, time_s=START_S), Towards.DEVICES
    )
    assert commanded_by(arrived, half) == [0.0, pytest.approx(0.5, abs=1e-3)]
    disarmed = encode_raw_command([0, 0, 0], 10, 0, time_s=START_S)
    assert passed(wire(wrong, signals=signals), disarmed, Towards.DEVICES) == disarmed


def commanded_by(frames: Iterable[CanFrame], thrusters: Sequence[DroneCanThruster]) -> list[float]:
    return [one.fraction for one in decoded(frames, thrusters) if isinstance(one, ThrusterCommand)]


@pytest.mark.parametrize("target", [Target.RPM, Target.COMMAND])
def test_every_failure_in_the_table_leaves_transfers_that_both_decoders_take(target: Target) -> None:
    towards = Towards.AUTOPILOT if target is Target.RPM else Towards.DEVICES
    sent = statuses(80) if target is Target.RPM else changing_commands(80)
    for failure, row in kinds_of(target).items():
        needed = {one.name: 0.5 for one in row.quantities if one.default is None}
        through = wire(fault(failure, f"thruster 3 {target}", at_s=0.3, **needed), signals=SIGNALS)
        arrived = passed(through, sent, towards)
        assert len(reference(arrived)) * len(sent) // 80 == len(arrived)
        assert decoded(arrived)
        assert [frame.data for frame in arrived] != [frame.data for frame in sent], failure


def test_a_second_node_is_found_by_the_gateways_decoder() -> None:
    beats = [encode_node_status(NodeStatus(500 + n), 13, n, time_s=START_S + n)[0] for n in range(15)]
    sent = sorted(statuses(750) + beats, key=lambda frame: frame.time_s)
    through = wire(fault("node_conflict", at_s=3.0, node=13), signals=SIGNALS)
    arrived = passed(through, sent)
    decoder = DroneCanDecoder(THRUSTERS)
    readings = [(frame.time_s - START_S, one) for frame in arrived for one in decoder.decode(frame)]
    conflicts = [at_s for at_s, one in readings if isinstance(one, NodeIdConflict)]
    assert len(conflicts) == 1
    assert 3.0 < conflicts[0] < 10.0
    zeros = [at_s for at_s, one in readings if isinstance(one, ThrusterReport) and one.speed_rpm == 0]
    assert len(zeros) == pytest.approx(600, rel=0.1)
    assert min(zeros) > 3.0
    of_first = set(map(id, sent))
    assert [frame for frame in arrived if id(frame) in of_first] == sent
    assert through.counts["frames of a second device"] == len(arrived) - len(sent)


def test_signals_come_from_the_gateways_configuration() -> None:
    signals = CanSignals.of(load(EXAMPLES / "bluerov2_heavy_dronecan.toml"), "can0")
    assert (signals.protocol, signals.speeds, signals.commands) == ("dronecan", EVERY, EVERY)
    assert [one.esc_index for one in signals.thrusters] == list(range(8))
    with pytest.raises(ValueError, match="bus = 'can7': the configuration has no such CAN bus, known there: can0"):
        CanSignals.of(load(EXAMPLES / "bluerov2_heavy_dronecan.toml"), "can7")


def test_faults_of_other_buses_and_thrusters_are_left_alone() -> None:
    signals = CanSignals("dronecan", THRUSTERS, speeds=frozenset({1}), commands=frozenset())
    through = wire(fault("off", RPM), fault("off", COMMAND), fault("loss", "can1", share=1.0), signals=signals)
    assert passed(through, statuses(5)) == statuses(5)
    assert through.next_s() == inf

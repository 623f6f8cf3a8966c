"""The simulated ESCs, heard by the gateway's own DroneCAN decoder: no code in common with the `dronecan` package."""

from __future__ import annotations

import can
import pytest

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFrame
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.rig.esc import CommandNode, DroneCanPort, EscBank, raw_command_filter
from hil_tests.rig.vehicle import THRUSTERS, Vehicle

CHANNEL = "test_esc"
COMMANDS = [0.5, -0.5, 0.25, 0.1, 0.0, 1.0, -1.0, 0.3]


@pytest.fixture
def buses():
    opened = [
        can.Bus(CHANNEL, interface="virtual", can_filters=filters) for filters in (None, [raw_command_filter()])
    ]
    opened.append(can.Bus(CHANNEL, interface="virtual"))
    yield opened
    for bus in opened:
        bus.shutdown()


def heard(bus: can.BusABC, decoder: DroneCanDecoder) -> list:
    readings = []
    while (message := bus.recv(0.0)) is not None:
        readings += decoder.decode(CanFrame(1.0, message.arbitration_id, bytes(message.data)))
    return readings


def test_commands_reach_the_escs_and_both_sides_the_gateway(buses):
    autopilot_bus, esc_bus, gateway_bus = buses
    vehicle = Vehicle(0.01, seed=1)
    autopilot, escs = CommandNode(autopilot_bus), EscBank(esc_bus, vehicle)
    for step in range(200):
        autopilot.publish(0.01 * step, COMMANDS)
        vehicle.step(0.01 * step, escs.commands(0.01 * step))
    escs.report(2.0, 0.02)

    decoder = DroneCanDecoder([DroneCanThruster(number, number - 1) for number in range(1, THRUSTERS + 1)])
    readings = heard(gateway_bus, decoder)
    commands = [reading for reading in readings if isinstance(reading, ThrusterCommand)]
    reports = [reading for reading in readings if isinstance(reading, ThrusterReport)]
    assert not decoder.drops
    assert len(commands) == 200 * THRUSTERS
    assert [command.fraction for command in commands[-THRUSTERS:]] == pytest.approx(COMMANDS, abs=1e-4)
    assert [report.thruster for report in reports] == list(range(1, THRUSTERS + 1))
    for report, thruster in zip(reports, vehicle.thrusters, strict=True):
        assert report.speed_rpm == pytest.approx(thruster.state.speed_rpm, abs=40.0)
        assert report.current_a == pytest.approx(thruster.state.supply_a, abs=0.3)
        assert report.voltage_v == pytest.approx(vehicle.battery.voltage_v, abs=0.01)
    assert reports[1].speed_rpm < -1000.0 < 1000.0 < reports[0].speed_rpm


def test_escs_stop_when_no_command_comes(buses):
    autopilot_bus, esc_bus, _ = buses
    escs = EscBank(esc_bus, Vehicle(0.01, seed=1), hold_s=0.5)
    assert escs.commands(0.0) == [0.0] * THRUSTERS
    CommandNode(autopilot_bus).publish(1.0, COMMANDS)
    assert escs.commands(1.0) == pytest.approx(COMMANDS, abs=1e-4)
    assert escs.commands(1.4) == pytest.approx(COMMANDS, abs=1e-4)
    assert escs.commands(1.6) == [0.0] * THRUSTERS


def test_a_short_command_leaves_the_other_escs_at_rest(buses):
    autopilot_bus, esc_bus, _ = buses
    escs = EscBank(esc_bus, Vehicle(0.01, seed=1))
    CommandNode(autopilot_bus).publish(0.0, [0.5, 0.5])
    assert escs.commands(0.0) == pytest.approx([0.5, 0.5] + [0.0] * 6, abs=1e-4)


def test_every_node_says_that_it_lives_once_a_second(buses):
    autopilot_bus, esc_bus, listener = buses
    autopilot, escs = CommandNode(autopilot_bus), EscBank(esc_bus, Vehicle(0.01, seed=1))
    for step in range(125):  # 2.5 s at 50 Hz
        autopilot.publish(0.02 * step, COMMANDS)
        escs.report(0.02 * step, 0.02)
    statuses = [t for t in DroneCanPort(listener).receive() if "uptime_sec" in str(t.payload)]
    assert sorted(t.source_node_id for t in statuses) == sorted([*range(10, 19)] * 3)
    assert {t.payload.uptime_sec for t in statuses} == {0, 1, 2}
    assert {t.payload.mode for t in statuses} == {0}  # OPERATIONAL


def test_a_broken_transfer_is_counted_and_skipped(buses):
    autopilot_bus, esc_bus, listener = buses
    CommandNode(autopilot_bus).publish(0.0, COMMANDS)
    frames = [message for _ in range(3) if (message := listener.recv(0.0))]
    frames[1].data[2] ^= 0xFF
    escs = EscBank(esc_bus, Vehicle(0.01, seed=1))
    while esc_bus.recv(0.0):
        pass
    for frame in frames:
        autopilot_bus.send(frame)
    assert escs.commands(0.0) == [0.0] * THRUSTERS
    assert escs.dropped == 1

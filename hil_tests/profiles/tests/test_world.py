"""A whole vehicle in lockstep, as one who listens to its bus and its link gets to know it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.profiles.tests.loopback import START_S, fault, profile, run, world
from hil_tests.rig.world import World
from hil_tests.scenario.document import Mission, Scenario, Step, Sticks

AHEAD = Mission(style="still", steps=(Step(at_s=0.0, sticks=Sticks(forward=0.45), over_s=0.0),))


def readings(frames, count=3) -> list:
    decoder = DroneCanDecoder([DroneCanThruster(number, number - 1) for number in range(1, count + 1)])
    heard = [reading for frame in frames for reading in decoder.decode(frame)]
    assert not decoder.drops
    return heard


def messages(heard) -> list:
    parser = mavlink.MAVLink(None)
    return [message for _, datagram in heard.datagrams for message in parser.parse_buffer(datagram) or []]


def test_the_same_seed_makes_the_same_bytes_and_another_others():
    first, again, other = (run(world("bluerov2_heavy", seed=seed), 2.0) for seed in (3, 3, 4))
    assert first == again
    assert first.commands != other.commands
    assert first.reports != other.reports


def test_frames_are_told_once_in_order_and_never_from_the_future():
    played, step_s = world(), profile("bench_rov").step_s
    for step in range(100):
        time_s = START_S + step_s * step
        played.advance(time_s)
        commands, reports = played.sent_by_autopilot(), played.sent_by_devices()
        played.to_devices(commands)
        stamps = [frame.time_s for frame in (*commands, *reports)]
        assert all(time_s - step_s - 0.001 < stamp <= time_s + 1e-6 for stamp in stamps)
        assert played.sent_by_autopilot() == played.sent_by_devices() == []


def test_no_two_frames_are_on_the_bus_at_once():
    heard = run(world("bluerov2_heavy"), 1.0)
    stamps = sorted(frame.time_s for frame in (*heard.commands, *heard.reports))
    shortest_s = 80e-6  # 29 bits of identifier and not much else, at 1 Mbit/s
    assert min(later - earlier for earlier, later in pairwise(stamps)) > shortest_s


def test_escs_report_each_at_its_own_time_and_all_as_often_as_the_profile_says():
    heard = readings(run(world("bluerov2_heavy"), 2.0).reports, count=8)
    numbers = [one.thruster for one in heard if isinstance(one, ThrusterReport)]
    assert {number: numbers.count(number) for number in range(1, 9)} == dict.fromkeys(range(1, 9), 40)
    assert numbers[:16] == [*range(1, 9), *range(1, 9)]


def test_what_is_told_on_the_bus_is_what_it_did():
    played = world("bluerov2_heavy")
    heard = run(played, 5.0)
    truth = played.truth()
    assert truth.time_s == pytest.approx(START_S + 0.1 * np.arange(51))
    for number in range(1, 9):
        told = readings([*heard.commands, *heard.reports], count=8)
        speeds = [(one.time_s, one.speed_rpm) for one in told if _of(one, ThrusterReport, number)]
        true_rpm = np.interp([time_s for time_s, _ in speeds], truth.time_s, truth.speed_rpm[:, number - 1])
        assert np.median(np.abs(true_rpm - [rpm for _, rpm in speeds])) < 40.0
        fractions = [(one.time_s, one.fraction) for one in told if _of(one, ThrusterCommand, number)]
        true = np.interp([time_s for time_s, _ in fractions], truth.time_s, truth.command[:, number - 1])
        assert np.median(np.abs(true - [fraction for _, fraction in fractions])) < 0.02
    assert truth.speed_rpm == pytest.approx(truth.healthy_rpm)


def _of(reading, kind, number) -> bool:
    return isinstance(reading, kind) and reading.thruster == number


def test_the_truth_holds_together():
    played = world(mission=AHEAD, water={"currents": [{"speed_mps": 0.3, "towards_deg": 90.0}]})
    run(played, 20.0)
    truth = played.truth()
    assert truth.through_water_mps[-1] == pytest.approx(1.22, abs=0.05)
    assert truth.over_ground_mps[-1] == pytest.approx(np.hypot(1.22, 0.3), abs=0.05)
    assert (truth.current_north_mps[-1], truth.current_east_mps[-1]) == pytest.approx((0.0, 0.3), abs=1e-9)
    north_mps = np.diff(truth.north_m[-20:]) / 0.1
    assert north_mps == pytest.approx(truth.through_water_mps[-19:], abs=0.02)
    assert truth.down_m[0] == 5.0
    assert truth.supply_v[-1] < truth.supply_v[0]
    assert truth.command[-1] == pytest.approx([0.45, 0.45, 0.0])


def test_without_commands_the_escs_stop():
    played = world(mission=AHEAD)
    run(played, 4.0)
    for step in range(200, 400):
        played.advance(START_S + 0.02 * step)  # nothing comes through any more
        played.sent_by_autopilot()
    assert played.truth().speed_rpm[-1] == pytest.approx([0.0, 0.0, 0.0], abs=1.0)
    assert played.truth().command[-1, 0] == pytest.approx(0.45)


def test_a_reversed_thruster_turns_its_commands_and_speeds_round_on_the_bus():
    first = profile("bench_rov").thrusters[0].model_copy(update={"reverse": True})
    mirrored = profile("bench_rov").model_copy(update={"thrusters": (first, *profile("bench_rov").thrusters[1:])})
    played = world(mirrored, mission=AHEAD)
    heard = run(played, 4.0)
    told = readings([*heard.commands, *heard.reports])
    assert [one for one in told if _of(one, ThrusterCommand, 1)][-1].fraction == pytest.approx(-0.45, abs=1e-3)
    assert [one for one in told if _of(one, ThrusterReport, 1)][-1].speed_rpm < -1000.0
    assert played.truth().speed_rpm[-1, 0] > 1000.0


def test_all_sensors_of_the_profile_speak_and_no_others():
    kinds = {message.get_type() for message in messages(run(world("bluerov2_heavy"), 2.0))}
    assert {"RAW_IMU", "SCALED_PRESSURE2", "VISION_POSITION_DELTA", "ATTITUDE", "HEARTBEAT"} <= kinds
    assert not {"RAW_IMU", "SCALED_PRESSURE2", "VISION_POSITION_DELTA"} & {
        message.get_type() for message in messages(run(world(), 2.0))
    }
    fixes = [one for one in messages(run(world("paper_portable_auv"), 4.0)) if one.get_type() == "GPS_INPUT"]
    assert 3 <= len(fixes) <= 5


@pytest.mark.parametrize("period_s", [0.02, 0.1])
def test_telemetry_keeps_its_own_pace_however_seldom_it_is_asked_for(period_s):
    heard = run(world("bluerov2_heavy"), 3.0, period_s=period_s)
    stamps = [one.time_boot_ms for one in messages(heard) if one.get_type() == "ATTITUDE"]
    assert {later - earlier for earlier, later in pairwise(stamps)} == {100}


def pack(message) -> bytes:
    return message.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=192))


def test_it_notes_what_comes_in_and_how_its_mode_changes():
    played = world(mission=Mission(style="still"))
    run(played, 1.0)
    surface = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, 9, 0, 0, 0, 0, 0)
    for time_s, message in (
        (1.2, mavlink.MAVLink_statustext_message(2, b"T3 entangled?")),
        (1.3, mavlink.MAVLink_named_value_float_message(0, b"T3", 1.5)),
        (1.4, mavlink.MAVLink_named_value_float_message(0, b"T3", 2.5)),
        (1.5, surface),
    ):
        played.to_autopilot(START_S + time_s, pack(message))
    assert [(text.time_s, text.text) for text in played.notes.texts] == [(START_S + 1.2, "T3 entangled?")]
    assert [(one.time_s, one.value) for one in played.notes.values["T3"]] == [
        (START_S + 1.3, 1.5),
        (START_S + 1.4, 2.5),
    ]
    assert [(one.time_s, one.mode, one.armed) for one in played.modes] == [
        (START_S, "MANUAL", True),
        (START_S + 1.5, "SURFACE", True),
    ]
    run(played, 25.0, from_s=1.6)
    assert played.modes[-1].mode == "ALT_HOLD"  # at the surface ArduSub hands over by itself
    assert played.truth().down_m[-1] < 0.5


def test_with_a_real_autopilot_it_only_plays_devices():
    played = world("bluerov2_heavy", autopilot=False)
    heard = run(played, 2.0)
    assert not heard.commands
    assert len([one for one in readings(heard.reports, count=8) if isinstance(one, ThrusterReport)]) == 320
    assert {message.get_type() for message in messages(heard)} == {"VISION_POSITION_DELTA"}
    commanding = run(world("bluerov2_heavy", mission=AHEAD), 3.0).commands  # as the real one would
    for frame in commanding:
        played.advance(frame.time_s + 2.0)
        played.to_devices([frame])
    assert played.truth().command[-1, :4] == pytest.approx([-0.45, -0.45, 0.45, 0.45], abs=1e-3)
    assert played.truth().through_water_mps[-1] > 1.0


def test_what_it_signs_is_signed():
    key = bytes(range(32))
    scenario = Scenario(duration_s=60.0)
    played = World(scenario, profile("bench_rov"), START_S, key=key)
    heard = run(played, 1.0)
    parser = mavlink.MAVLink(None)
    parser.signing.secret_key = key
    parser.signing.allow_unsigned_callback = lambda *_: False
    parsed = [message for _, datagram in heard.datagrams for message in parser.parse_buffer(datagram)]
    assert parsed
    assert all(message.get_signed() for message in parsed)


def test_scenario_and_profile_must_go_together():
    with pytest.raises(ValueError, match=r"mode = 'SURFACE': want one of MANUAL, ALTCTL"):
        world("bluerov2_heavy_px4", mission=Mission(mode="SURFACE"))
    with pytest.raises(ValueError, match=r"faults on thrusters \[4\]: want numbers from 1 to 3"):
        world("bench_rov", faults=[fault("thruster 4", "off")])

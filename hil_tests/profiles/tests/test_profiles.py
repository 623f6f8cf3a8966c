"""Vehicles that come along, and those of one's own: what they say of themselves is what a gateway hears."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from drivers.readings import ThrusterCommand, ThrusterReport
from gateway.config import parse
from gateway.problems import ConfigError
from gateway.wiring import can_decoder
from hil_tests.profiles import load_profile, parse_profile, profile_names
from hil_tests.profiles.tests.loopback import run, world
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion, Vehicle
from hil_tests.scenario.document import Mission

ENDPOINT = "udpin:127.0.0.1:0"
MINIMAL = "name: Mine\nthrusters:\n  - {name: main, ahead: 1}\n"


def configuration(what, folder=None, **settings):
    where = folder or what.folder
    text = what.gateway_toml(where, interface="virtual", channel="x", endpoint=ENDPOINT, settings=settings)
    return parse(text, where)


def test_all_vehicles_are_there():
    assert profile_names() == [
        "bench_rov",
        "bluerov2",
        "bluerov2_heavy",
        "bluerov2_heavy_px4",
        "paper_hov",
        "paper_portable_auv",
        "paper_saucer_auv",
    ]


@pytest.mark.parametrize("name", profile_names())
def test_what_the_gateway_hears_is_what_the_vehicle_did(name):
    what = load_profile(name)
    config = configuration(what)
    played = world(what, mission=Mission(style="cruising"))
    heard = run(played, 6.0)
    decoder = can_decoder(config.can[0], config.thruster)
    readings = [one for frame in (*heard.commands, *heard.reports) for one in decoder.decode(frame)]
    assert not decoder.drops
    truth = played.truth()
    top_rpm = np.abs(truth.speed_rpm).max()
    for kind, value, true, near in (
        (ThrusterCommand, "fraction", truth.command, 0.02),
        (ThrusterReport, "speed_rpm", truth.speed_rpm, 0.03 * top_rpm),
    ):
        for number in range(1, len(what.thrusters) + 1):
            told = [one for one in readings if isinstance(one, kind) and one.thruster == number]
            assert len(told) >= 55
            meant = np.interp([one.time_s for one in told], truth.time_s, true[:, number - 1])
            assert np.median(np.abs(meant - [getattr(one, value) for one in told])) < near
    voltages_v = [one.voltage_v for one in readings if isinstance(one, ThrusterReport)]
    assert voltages_v[-1] == pytest.approx(truth.supply_v[-1], abs=0.05)


@pytest.mark.parametrize("name", profile_names())
def test_its_gateway_watches_all_that_there_is_to_watch(name):
    what = load_profile(name)
    config = configuration(what)
    assert [thruster.number for thruster in config.thruster] == list(range(1, len(what.thrusters) + 1))
    assert config.speed is not None
    assert (config.navigation is not None) == (what.sensors.dvl is not None)
    assert sum(abs(thruster.ahead) for thruster in config.thruster) > 0.0


@pytest.mark.parametrize("name", profile_names())
def test_it_moves_as_its_curve_of_speeds_says(name):
    what, step_s = load_profile(name), 0.05  # coarse, and good enough for a steady speed
    for command, speed_mps in what.gateway["speed"]["curve"]:
        vehicle = Vehicle(step_s, 1, build=what.build(), motion=Motion(forward_mps=speed_mps))
        commands = vehicle.layout.mix(Sticks(forward=command))
        for step in range(600):
            motion = vehicle.step(step * step_s, commands)
        assert motion.forward_mps == pytest.approx(speed_mps, rel=0.03)


def test_settings_are_laid_over_the_gateways_configuration(tmp_path):
    what = load_profile("bluerov2_heavy")
    config = configuration(what, tmp_path, failsafe={"thruster_fault": "hold"}, speed={"tolerance": 0.3})
    assert [str(action) for action in config.failsafe.thruster_fault] == ["hold"]
    assert config.speed is not None
    assert config.speed.tolerance == 0.3
    assert config.speed.curve is not None


def test_a_database_is_found_from_wherever_the_configuration_lies(tmp_path):
    what = load_profile("paper_hov")
    tables = tomllib.loads(what.gateway_toml(tmp_path))
    assert (tmp_path / tables["can"][0]["database"]).samefile(what.database)
    assert configuration(what, tmp_path).can[0].database.is_file()


def test_a_profile_of_ones_own_is_a_file(tmp_path):
    (tmp_path / "mine.yaml").write_text(MINIMAL)
    assert load_profile("mine.yaml", tmp_path).name == "Mine"
    assert load_profile(tmp_path / "mine.yaml").thrusters[0].ahead == 1.0


def test_thrusters_of_ones_own_and_esc_ids_that_count_on():
    text = """
name: Mine
thruster_types: {slow: {spin_up_s: 0.5}}
thrusters:
  - {name: port, type: slow, ahead: 1, reversible: false}
  - {name: starboard, ahead: 1, esc_index: 5, node: 40, reverse: true}
"""
    what = parse_profile(text, Path())
    assert [one.spin_up_s for one in what.build().each_thruster] == [0.5, 0.08]
    assert [what.esc_index(place) for place in (0, 1)] == [0, 5]
    assert [what.node_id(place) for place in (0, 1)] == [11, 40]
    port, starboard = configuration(what).thruster
    assert (port.command.bidirectional, starboard.command.reverse, starboard.rpm.esc_index) == (False, True, 5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MINIMAL + "hul: {}", r"hul = .*unknown key, did you mean hull\?"),
        (MINIMAL + "hull: {inertial: 3}", r"hull\.inertial = 3: unknown key, did you mean inertia\?"),
        (MINIMAL + "sensors: {dvl: {interval_s: -1}}", "interval_s = -1.0: want seconds above 0"),
        (MINIMAL + "bus: {report_hz: 30}", "report_hz = 30: want 50 divided by 1, 1.5, 2"),
        (MINIMAL + "bus: {protocol: dbc}", 'want a database with protocol "dbc"'),
        (MINIMAL.replace("ahead: 1", "ahead: 2"), r"ahead = 2: should be less than or equal to 1"),
        (MINIMAL.replace("ahead: 1", "type: t500"), "thruster 1: type = 't500': want one of t200"),
        (MINIMAL.replace("ahead: 1", "speed: A.B"), 'has signals: want protocol "dbc"'),
        (MINIMAL + "bus: {protocol: dbc, database: x.dbc}", 'want signals for command and speed with protocol "dbc"'),
        ("name: Mine", "thrusters: missing"),
        (MINIMAL + "name: Other", "there twice"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text, words):
    with pytest.raises(ConfigError, match=words) as raised:
        parse_profile(text, Path(), "mine.yaml")
    assert "mine.yaml:" in str(raised.value)


def test_a_database_that_is_not_there_is_said():
    text = """
name: Mine
bus: {protocol: dbc, database: nowhere.dbc}
thrusters:
  - {name: main, ahead: 1, command: A.B, speed: C.D}
"""
    with pytest.raises(ConfigError, match=r"mine\.yaml:3: bus\.database = nowhere\.dbc: there is no such file"):
        parse_profile(text, Path(), "mine.yaml")


def test_a_name_that_there_is_not_is_said_with_the_nearest():
    with pytest.raises(ConfigError, match=r"bluerov2_hevy: no such vehicle profile, did you mean bluerov2_heavy\?"):
        load_profile("bluerov2_hevy")
    with pytest.raises(ConfigError, match="want the path of a file, or one of bench_rov"):
        load_profile("submarine/of/mine.yaml")

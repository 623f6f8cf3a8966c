"""`gateway commission` as a user meets it: what is printed, what is written, how it ends."""

from __future__ import annotations

import os

import pytest
from click.testing import CliRunner

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from gateway import state
from gateway.cli import main
from gateway.commissioning.tests.made_thrusters import CONFIG, samples
from gateway.config import load
from gateway.tests.recorded_dives import START_S, write_candump

NODE = 20


def frames(thrusters, first=0):
    """What a bus carries of them; `first`: index of the first one's ESC."""
    for n, (time_s, *_) in enumerate(zip(*(one.time_s for one in thrusters), strict=True)):
        commands = [0] * first + [round(8191 * one.command[n]) for one in thrusters]
        yield from encode_raw_command(commands, 10, n % 32, time_s=time_s)
        for index, one in enumerate(thrusters, start=first):
            status = EscStatus(0, 16.0, 3.0, 300.0, round(one.speed_rpm[n]), 50, index)
            yield from encode_esc_status(status, NODE + index, n % 32, time_s=time_s + 0.002 * (1 + index))


def dive(seconds, seed, reach=1.0):
    return [samples(seconds, seed + place, reach=reach, start_s=START_S) for place in (0, 100)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    (folder / "rov.toml").write_text(CONFIG)
    for name in ("long", "short", "other", "foreign"):
        (folder / name).mkdir()
    write_candump(folder / "long" / "can.log", frames(dive(340.0, 1)))
    write_candump(folder / "short" / "can.log", frames(dive(40.0, 1, reach=0.2)))
    write_candump(folder / "other" / "can.log", frames(dive(20.0, 1)[:1], first=4))
    write_candump(folder / "foreign" / "can.log", frames(dive(5.0, 1)), "can5")
    return folder


@pytest.fixture
def commission(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)  # no processes for detectors: they take seconds to begin
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "200")

    def act(*words: str, out: str = str(tmp_path / "out")):
        return CliRunner().invoke(main, ["commission", "rov.toml", *words, "--out", out])

    return act


def test_a_long_dive_gives_a_configuration_that_holds_and_a_state_and_a_page(commission, tmp_path):
    result = commission("long/can.log", "--false-alarms-per-hour", "1")
    assert result.exit_code == 0, result.output
    new = load(tmp_path / "out" / "rov.toml")
    assert 0.8 <= new.detector.thruster.caution <= 4.0
    assert new.files.state == tmp_path / "out" / "vehicle.state"
    assert set(state.load(new.files.state).learnt) == {"thruster 1", "thruster 2"}
    text = (tmp_path / "out" / "rov.toml").read_text()
    assert text.startswith(CONFIG)
    assert "# commissioned: for 1 false alarms per hour, from 0.08 h of healthy dives" in text
    page = (tmp_path / "out" / "commissioning.html").read_text()
    assert "All was learnt" in page
    assert "thruster-2-steps" in page
    for told in ("5.7 minutes of 1 dive", "steady speed", "false alarms, held out", "with the new configuration"):
        assert told in result.stdout


def test_a_short_and_weak_dive_is_refused_with_what_is_missing(commission, tmp_path):
    result = commission("short/can.log")
    assert result.exit_code == 2
    assert "missing: thruster 1: ahead was never commanded beyond +1" in result.stdout
    assert "60 s are wanted: drive back and forth for" in result.stdout
    assert "nothing was learnt, no configuration was written" in result.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["commissioning.html"]
    assert "Nothing was learnt" in (tmp_path / "out" / "commissioning.html").read_text()


def test_a_log_of_another_vehicle_is_told(commission):
    result = commission("other/can.log")
    assert result.exit_code == 2
    assert "missing: thruster 1, thruster 2: it has no sample in these logs" in result.stdout
    assert "Are they of this vehicle" in result.stdout


def test_the_users_own_file_is_never_replaced(commission, folder):
    result = commission("short/can.log", out=".")
    assert result.exit_code == 2
    assert "rov.toml lies there, and stays as it is: want another folder" in result.stderr
    assert (folder / "rov.toml").read_text() == CONFIG


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("none.log",), "none.log: No such file or directory"),
        (("can7=long/can.log",), "want one of the links can0"),
        (("rov.toml",), "rov.toml is no CAN log"),
        (("foreign/can.log",), "nothing in these logs is of a link of the configuration: are they of this vehicle?"),
    ],
)
def test_what_cannot_be_done_is_told_in_a_line(commission, words, told):
    result = commission(*words)
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Traceback" not in result.output


def test_a_rate_of_none_is_refused(commission):
    assert "0.0<x<=100.0" in commission("long/can.log", "--false-alarms-per-hour", "0").output

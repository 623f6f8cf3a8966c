"""On a real bus the gateway listens: what the configuration asks of a controller, and what `gateway check` says."""

import inspect
import json
import os
import stat

import can
import pytest

from drivers.can.interface import LISTEN_ONLY
from gateway.can_source import options_of
from gateway.checking.machine import _manners
from gateway.config import parse
from gateway.config_sections import CanBus
from gateway.problems import ConfigError
from gateway.tests.conftest import TWO_THRUSTERS


def bus(interface="socketcan", **keys):
    return CanBus(name="can0", interface=interface, channel="can7", protocol="dronecan", **keys)


@pytest.fixture
def ip_says(tmp_path, monkeypatch):
    """An `ip` that says this of every interface."""

    def write(**data):
        answer = json.dumps([{"linkinfo": {"info_kind": "can", "info_data": data}}])
        path = tmp_path / "ip"
        path.write_text(f"#!/bin/sh\necho '{answer}'\n")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    return write


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (
            {"ctrlmode": ["LISTEN-ONLY"], "restart_ms": 100},
            ["listen-only: sends nothing, acknowledges nothing", "restarts 0.1 s after bus-off"],
        ),
        (
            {"restart_ms": 0},
            [
                "sends nothing, but acknowledges frames (ip link has listen-only off)",
                "has to be restarted by hand after bus-off",
            ],
        ),
    ],
)
def test_check_says_what_a_controller_does_by_itself(ip_says, data, said):
    ip_says(**data)
    assert list(_manners(bus())) == said


def test_of_an_interface_without_a_controller_nothing_is_said(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))  # no ip
    assert list(_manners(bus())) == list(_manners(bus("virtual"))) == []


def test_adapters_that_can_are_told_to_be_silent():
    assert list(_manners(bus("slcan", listen_only=True))) == ["listen-only: sends nothing, acknowledges nothing"]
    assert list(_manners(bus("slcan"))) == ["sends nothing, but acknowledges frames (listen_only = false)"]
    assert options_of(bus("slcan", listen_only=True, bitrate=500_000)) == {"bitrate": 500_000, "listen_only": True}
    assert options_of(bus("slcan")) == {}


@pytest.mark.parametrize("interface", ["slcan", "vector", "pcan", "seeedstudio"])
def test_python_can_knows_the_options(interface):
    module, name = can.interfaces.BACKENDS[interface]
    driver = getattr(__import__(module, fromlist=[name]), name)
    assert set(LISTEN_ONLY[interface]) <= set(inspect.signature(driver.__init__).parameters)


@pytest.mark.parametrize(
    ("interface", "wanted"),
    [
        ("socketcan", "sudo ip link set gateway tests type can bitrate 1000000 listen-only on"),
        ("virtual", "virtual cannot be told so; those that can: kvaser, nixnet, pcan, seeedstudio, slcan"),
    ],
)
def test_what_cannot_be_told_to_be_silent_is_refused_with_the_way_out(tmp_path, interface, wanted):
    text = TWO_THRUSTERS.replace('"virtual"', f'"{interface}"\nlisten_only = true')
    with pytest.raises(ConfigError, match=wanted) as refused:
        parse(text, tmp_path)
    assert "can[name=can0].listen_only" in str(refused.value)

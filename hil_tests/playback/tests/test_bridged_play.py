"""In the middle of a real link: an autopilot in another process, the gateway as a program, and the bench between."""

from __future__ import annotations

import socket
import subprocess
import sys
from contextlib import contextmanager

import pytest

from hil_tests.bridge.permission import Granted, RefusedError
from hil_tests.bridge.transmission import parse_transmission
from hil_tests.loopback import free_port
from hil_tests.playback.play import play
from hil_tests.playback.way import Way
from hil_tests.report.expectations import checks
from hil_tests.scenario.document import Scenario

CONFIG = """
[vehicle]
name = "Bridged"

[mavlink]
endpoint = "udpin:127.0.0.1:0"

[[thruster]]
number = 1
command = { link = "mavlink", servo_channel = 1 }
rpm = { link = "mavlink", esc_index = 0 }
"""
ARMED = Granted(while_armed=True)


@contextmanager
def an_autopilot(port, tmp_path):
    """It speaks before anybody listens to it for three seconds only: on a slow machine it takes longer to start."""
    words = [sys.executable, "-m", "hil_tests.playback.tests.autopilot_process", str(port), str(tmp_path / "heard")]
    with subprocess.Popen(words, stdin=subprocess.PIPE) as process:
        try:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind(("127.0.0.1", port))
                probe.settimeout(60.0)
                probe.recv(4096)
            yield
        finally:
            process.stdin.close()
            process.wait(30.0)


@pytest.fixture
def bridged(tmp_path):
    (tmp_path / "own.toml").write_text(CONFIG)

    def run(way, **fields):
        scenario = Scenario(gateway={"config": "own.toml"}, **fields)
        return play(scenario, tmp_path / "scenario.yaml", tmp_path / "play", way)

    return run


def test_a_link_that_is_cut_in_the_middle_is_told_and_the_autopilot_hears_of_it(bridged, tmp_path):
    port = free_port()
    way = Way(autopilot=f"udpin:127.0.0.1:{port}", granted=ARMED)
    with an_autopilot(port, tmp_path):
        outcome = bridged(
            way,
            duration_s=14.0,
            faults=[{"at_s": 4, "subject": "mavlink", "failure": "cut", "duration_s": 7}],
            expect=[{"finding": {"subject": "link mavlink", "at_least": "SUSPECT"}, "within_s": 7}],
            never=[
                {"finding": {"subject": "link mavlink", "at_least": "SUSPECT"}, "before_s": "fault"},
                {"command": "*"},
            ],
        )
    assert outcome.broken is None
    assert [check.seen for check in checks(outcome) if not check.passed] == []
    assert outcome.way == f"between udpin:127.0.0.1:{port}"
    assert outcome.wire_counts["MAVLink"]["packets cut off"] > 50
    assert [(mode.mode, mode.armed) for mode in outcome.modes] == [("MANUAL", True)]
    assert outcome.texts[0].text.startswith("Watching 1 thruster")
    assert (tmp_path / "play" / "heard.tlog").stat().st_size > 4_000
    assert any(" in, " in line and "within" in line for line in outcome.gateway_lines)


def test_an_armed_autopilot_is_not_played_with_unless_that_is_said(bridged, tmp_path):
    port = free_port()
    with an_autopilot(port, tmp_path), pytest.raises(RefusedError, match=r"reports armed.*--while-armed"):
        bridged(Way(autopilot=f"udpin:127.0.0.1:{port}"), duration_s=5.0)


@pytest.mark.parametrize(
    "fault", [{"subject": "thruster 1", "failure": "blocked"}, {"subject": "hull", "failure": "net"}]
)
def test_what_only_a_simulated_vehicle_can_have_is_refused_before_anything_is_opened(bridged, fault):
    with pytest.raises(RefusedError, match="only a simulated vehicle"):
        bridged(Way(bridge=("nowhere0", "nowhere1")), duration_s=5.0, faults=[{"at_s": 1, **fault}])


def test_a_bus_that_is_not_virtual_is_not_bridged_without_leave(bridged):
    with pytest.raises(RefusedError, match=r"lo is a real bus.*--transmit all"):
        bridged(Way(bridge=("lo", "nowhere1")), duration_s=5.0)
    with pytest.raises(RefusedError, match="no interface nowhere1 is here"):
        bridged(Way(bridge=("lo", "nowhere1"), granted=Granted(parse_transmission("all"))), duration_s=5.0)

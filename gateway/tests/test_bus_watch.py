"""Nodes of a CAN bus as the pilot hears of them: once, in words that fit, and that it is over."""

from __future__ import annotations

import pytest

from detectors.verdict import Level
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
from drivers.can.dronecan import EscStatus, encode_esc_status
from drivers.mavlink.messages import TEXT_MAX, StatusText
from drivers.readings import AutopilotHeartbeat
from gateway.bus_watch import OVER_S, BusWatch
from gateway.config import parse
from gateway.findings import Finding
from gateway.pipeline import Factories, Pipeline
from gateway.severity import Severity
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector
from gateway.wiring import can_decoder

START_S = 1.7e9


def health(time_s=START_S, state=Health.OK, mode=NodeMode.OPERATIONAL, uptime_s=500, thrusters=(1,)):
    return NodeHealth(time_s, 13, state, mode, uptime_s, thrusters)


@pytest.mark.parametrize(
    ("reading", "subject", "text"),
    [
        (
            EscConflict(START_S, 3, 2, (11, 12), None),
            "thruster 3 esc index",
            "T3 ESC index 2 claimed by nodes 11 and 12",
        ),
        (
            EscConflict(START_S, 12, 19, (111, 112, 113), 111),
            "thruster 12 esc index",
            "T12 ESC index 19 claimed by nodes 111, 112 and 113",
        ),
        (EscConflict(START_S, 3, 2, (21,), 20), "thruster 3 esc index", "T3 ESC index 2 from node 21, want 20"),
        (CommanderConflict(START_S, (10, 11)), "link can0 commands", "can0 commands from nodes 10 and 11"),
        (NodeIdConflict(START_S, 11), "link can0 node 11", "can0 node 11 id used by two devices"),
        (BabblingNode(START_S, 11, 3000), "link can0 node 11 rate", "can0 node 11 sends over 3000 frames/s"),
        (health(state=Health.ERROR), "thruster 1 node", "T1 ESC node 13 says ERROR"),
        (health(mode=NodeMode.SOFTWARE_UPDATE), "thruster 1 node", "T1 ESC node 13 not ready: software update"),
    ],
)
def test_what_is_wrong_is_a_suspicion_in_words_that_fit(reading, subject, text):
    (observation,) = BusWatch().take("can0", reading, disarmed=False)
    assert (observation.subject, observation.level, observation.text()) == (subject, Level.SUSPECT, text)
    assert len(text) <= TEXT_MAX


def test_a_critical_esc_is_a_fault_of_each_of_its_thrusters():
    told = list(BusWatch().take("can0", health(state=Health.CRITICAL, thrusters=(1, 2)), disarmed=True))
    assert [(one.subject, one.level) for one in told] == [
        ("thruster 1 node", Level.FAULT),
        ("thruster 2 node", Level.FAULT),
    ]


@pytest.mark.parametrize(
    ("reading", "disarmed"),
    [
        (health(), False),
        (health(state=Health.WARNING), False),
        (health(state=Health.CRITICAL, thrusters=()), False),
        (health(mode=NodeMode.MAINTENANCE), True),
        (health(mode=NodeMode.INITIALIZATION, uptime_s=3), False),
        (EscCondition(START_S, 1, 50, 50, 300.0, 1), False),
    ],
)
def test_what_is_well_or_nobodys_esc_is_not_told(reading, disarmed):
    assert list(BusWatch().take("can0", reading, disarmed)) == []


def watched(tmp_path, text=TWO_THRUSTERS):
    return Pipeline(parse(text, tmp_path), Factories(thruster=ThresholdDetector))


def told(outcomes):
    return [one.text for one in outcomes if isinstance(one, StatusText) and one.severity < Severity.INFO]


def findings(outcomes, subject):
    return [one for one in outcomes if isinstance(one, Finding) and one.subject == subject]


def test_a_conflict_is_told_once_while_it_lasts_and_when_it_is_over(tmp_path):
    pipeline, outcomes = watched(tmp_path), []
    for n in range(80):
        time_s = START_S + n
        if n % 10 == 0 and n < 40:
            outcomes += pipeline.feed("can0", [EscConflict(time_s, 1, 0, (11, 12), None)])
        outcomes += pipeline.advance(time_s)
    said = [text for text in told(outcomes) if "index" in text or "T1 ESC ok" in text]
    assert said == ["T1 ESC index 0 claimed by nodes 11 and 12", "T1 ESC ok again"]
    worse, over = findings(outcomes, "thruster 1 esc index")
    assert (worse.level, over.level) == (Level.SUSPECT, Level.NORMAL)
    assert OVER_S < over.time_s - (START_S + 30.0) < OVER_S + 6.0


def test_an_esc_that_is_well_again_says_so_itself(tmp_path):
    pipeline, outcomes = watched(tmp_path), []
    for n in range(30):
        state = Health.CRITICAL if 5 <= n < 15 else Health.OK
        outcomes += pipeline.feed("can0", [health(START_S + n, state)])
        outcomes += pipeline.advance(START_S + n + 0.5)
    worse, over = findings(outcomes, "thruster 1 node")
    assert (worse.time_s, worse.level, worse.severity) == (START_S + 5, Level.FAULT, Severity.CRITICAL)
    assert over.level is Level.NORMAL and over.text == "T1 ESC ok again"


def test_one_that_is_not_ready_is_told_of_when_the_vehicle_is_armed(tmp_path):
    pipeline, outcomes = watched(tmp_path), []
    for n in range(20):
        beat = AutopilotHeartbeat(START_S + n, 1, 1, 3, 12, n >= 10, 19, 4)
        outcomes += pipeline.feed("mavlink", [beat])
        outcomes += pipeline.feed("can0", [health(START_S + n + 0.1, mode=NodeMode.MAINTENANCE)])
    (finding,) = findings(outcomes, "thruster 1 node")
    assert finding.text == "T1 ESC node 13 not ready: maintenance"
    assert 10.0 <= finding.time_s - START_S < 11.0


def test_from_the_frames_to_the_pilot(tmp_path):
    config = parse(TWO_THRUSTERS, tmp_path)
    decoder, pipeline, outcomes = can_decoder(config.can[0], config.thruster), watched(tmp_path), []
    for n in range(50):
        for node in (11, 12):
            status = EscStatus(0, 16.0, 2.0, 300.0, 1000, 50, 1)
            for frame in encode_esc_status(status, node, n, time_s=START_S + 0.02 * n):
                outcomes += pipeline.feed("can0", decoder.decode(frame))
    assert told(outcomes) == ["T2 ESC index 1 claimed by nodes 11 and 12"]

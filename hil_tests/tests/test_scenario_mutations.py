"""Whether scenarios would notice: parts of the gateway are broken on purpose, and a play of each must turn red."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from detectors.navigation import accommodation, detector
from detectors.navigation.thresholds import ratio_threshold
from detectors.speed import evidence
from detectors.thruster import ThrusterDetector, adaptive
from detectors.thruster.assessment import thresholds
from gateway.pipeline import Factories
from gateway.silence import SilenceWatch
from gateway.supervision import intervention
from gateway.supervision.actions import Action
from gateway.supervision.autopilots import ARDUSUB_SURFACE, CUSTOM_MODE_ENABLED, REQUESTS, AutopilotKind
from gateway.supervision.intervention import Intervention
from hil_tests.playback.play import play
from hil_tests.profiles.loading import load_profile
from hil_tests.report.expectations import checks
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.loading import load_scenario
from hil_tests.scenario.shelf import scenario_files

TENFOLD = 10.0
# of a vehicle with eight thrusters, what it takes to judge its DVL
ONLY_NAVIGATION = {
    "speed": None,
    "detector": {"speed": None},
    "thruster": tomllib.loads(load_profile("bluerov2_heavy").gateway_toml())["thruster"][:1],
}
HOLD_AT_A_FAULT = {"failsafe": {"thruster_fault": "hold", "delay_s": 0.0}}


def survey(leg_s):
    course = {"headings_deg": [0, 90, 180, 270], "leg_s": leg_s}
    return {"style": "surveying", "mode": "MANUAL", "course": course}


def weeds():
    """The whole chain: found, told, asked of the autopilot, done by it."""
    return Scenario(
        vehicle="bench_rov",
        duration_s=31,
        mission=survey(15),
        gateway={"settings": HOLD_AT_A_FAULT},
        faults=[{"at_s": 24, "subject": "thruster 2", "failure": "entangled", "share": 0.3, "ramp_s": 1}],
        expect=[
            {"finding": {"subject": "thruster 2", "level": "FAULT"}, "within_s": 4},
            {"statustext": "^T2 entangled", "severity": "CRITICAL", "within_s": 5},
            {"command": "hold", "within_s": 5},
            {"mode": "ALT_HOLD"},
        ],
        never=[{"finding": {"at_least": "SUSPECT"}, "before_s": "fault"}],
    )


def net():
    return Scenario(
        vehicle="bench_rov",
        duration_s=42,
        mission=survey(8),
        faults=[{"at_s": 30, "subject": "hull", "failure": "net", "drag_factor": 4, "ramp_s": 1}],
        expect=[
            {"finding": {"subject": "vehicle", "level": "FAULT"}, "within_s": 11},
            {"statustext": "^Speed", "within_s": 12},
        ],
        never=[{"finding": {"subject": "thruster *", "at_least": "FAULT"}}],
    )


def frozen_dvl():
    """The one that ships, with less time to learn in, and little else to judge."""
    [path] = scenario_files(["dvl_frozen_at_zero"])
    shipped = load_scenario(path)
    sooner = tuple(replace(fault, at_s=31.0) for fault in shipped.faults)
    gateway = shipped.gateway.model_copy(update={"settings": ONLY_NAVIGATION})
    return shipped.model_copy(update={"duration_s": 38.0, "faults": sooner, "gateway": gateway})


def biased_dvl():
    """Half a metre a second: nothing else says so than how likely it is."""
    wrong = [{"at_s": 31, "subject": "dvl", "failure": "bias", "bias_mps": 0.5, "axis": "right"}]
    return Scenario(**dict(frozen_dvl()) | {"faults": wrong})


def silent_esc():
    return Scenario(
        vehicle="bench_rov",
        duration_s=11,
        mission=survey(15),
        faults=[{"at_s": 6, "subject": "thruster 2 rpm", "failure": "off"}],
        expect=[
            {"finding": {"subject": "thruster 2 esc", "level": "SUSPECT"}, "within_s": 3},
            {"statustext": "^T2 ESC silent", "within_s": 4},
        ],
    )


SCENARIOS = {one.__name__: one for one in (weeds, net, frozen_dvl, biased_dvl, silent_esc)}


@dataclass(frozen=True, slots=True)
class Mutant:
    """Something that is broken on purpose.

    Attributes:
        scenario: that is to notice.
        missed: how what it then misses begins.
        mutate: breaks it, by a MonkeyPatch.
        settings: laid over the gateway's configuration.
        factories: make its detectors.
    """

    scenario: Callable[[], Scenario]
    missed: frozenset[str]
    mutate: Callable[[pytest.MonkeyPatch], None] = lambda _: None
    settings: dict | None = None
    factories: Factories | None = None


def never_ready(config, commissioned):
    return ThrusterDetector(replace(config, warmup=10**9), commissioned)


def thruster_tenfold(monkeypatch):
    monkeypatch.setattr(adaptive, "thresholds", lambda *judged: TENFOLD * thresholds(*judged))


def speed_tenfold(monkeypatch):
    for name in ("FAULT_AT", "SUSPECT_AT", "REMEMBERED"):
        monkeypatch.setattr(evidence, name, TENFOLD * getattr(evidence, name))


def navigation_tenfold(monkeypatch):
    for module in (detector, accommodation):
        monkeypatch.setattr(module, "ratio_threshold", lambda rate: TENFOLD * ratio_threshold(rate))


def never_asks(monkeypatch):
    monkeypatch.setattr(Intervention, "update", lambda *_, **__: [])


def wrong_mode_number(monkeypatch):
    hold = AutopilotKind.ARDUSUB, Action.HOLD
    wrong = replace(REQUESTS[hold], parameters=(CUSTOM_MODE_ENABLED, float(ARDUSUB_SURFACE)))
    monkeypatch.setattr(intervention, "REQUESTS", {**REQUESTS, hold: wrong})


def hears_no_silence(monkeypatch):
    monkeypatch.setattr(SilenceWatch, "judge", lambda *_: iter(()))


T2_FOUND, T2_TOLD = "FAULT of thruster 2", 'CRITICAL STATUSTEXT "^T2 entangled"'
HOLD_ASKED, HELD = 'command "hold"', "mode ALT_HOLD"
UNSEEN = frozenset({T2_FOUND, T2_TOLD, HOLD_ASKED, HELD})
SLOW, SLOW_TOLD = "FAULT of vehicle", 'STATUSTEXT "^Speed"'
DVL, DVL_TOLD = "FAULT of dvl", 'STATUSTEXT "(?i)dvl"'
ESC, ESC_TOLD = "SUSPECT of thruster 2 esc", 'STATUSTEXT "^T2 ESC silent"'

MUTANTS = {
    "thruster detector off": Mutant(weeds, UNSEEN, factories=Factories(thruster=never_ready)),
    "thruster threshold tenfold": Mutant(weeds, UNSEEN, thruster_tenfold),
    "speed detector off": Mutant(
        net, frozenset({SLOW, SLOW_TOLD}), settings={"speed": None, "detector": {"speed": None}}
    ),
    "speed threshold tenfold": Mutant(net, frozenset({SLOW, SLOW_TOLD}), speed_tenfold),
    "navigation detector off": Mutant(
        frozen_dvl, frozenset({DVL, DVL_TOLD}), settings=ONLY_NAVIGATION | {"navigation": None}
    ),
    "navigation threshold tenfold": Mutant(biased_dvl, frozenset({DVL, DVL_TOLD}), navigation_tenfold),
    "failsafe that never asks": Mutant(weeds, frozenset({HOLD_ASKED, HELD}), never_asks),
    "wrong number of a mode": Mutant(weeds, frozenset({HOLD_ASKED, HELD}), wrong_mode_number),
    "silence that nobody hears": Mutant(silent_esc, frozenset({ESC, ESC_TOLD}), hears_no_silence),
}


def mutated(mutant):
    scenario = mutant.scenario()
    if mutant.settings is None:
        return scenario
    return scenario.model_copy(update={"gateway": scenario.gateway.model_copy(update={"settings": mutant.settings})})


def missed(outcome):
    """What was expected, and did not come about."""
    assert outcome.broken is None
    return [check.expected for check in checks(outcome) if not check.passed]


def told(outcome):
    return [f"{one.time_s - outcome.start_s:.1f} {one.level.name} {one.text}" for one in outcome.findings]


@pytest.mark.parametrize("name", SCENARIOS)
def test_it_is_green_with_the_gateway_as_it_is(name, tmp_path):
    outcome = play(SCENARIOS[name](), Path("scenario.yaml"), tmp_path)
    assert missed(outcome) == [], told(outcome)


@pytest.mark.parametrize("name", MUTANTS)
def test_it_is_red_with_a_gateway_that_is_broken(name, tmp_path, monkeypatch):
    mutant = MUTANTS[name]
    mutant.mutate(monkeypatch)
    outcome = play(mutated(mutant), Path("scenario.yaml"), tmp_path, factories=mutant.factories)
    red = missed(outcome)
    assert len(red) == len(mutant.missed), (red, told(outcome))
    assert all(any(one.startswith(begins) for one in red) for begins in mutant.missed), red


def test_each_scenario_is_turned_red_by_a_mutant_and_each_detector_by_two():
    assert {mutant.scenario for mutant in MUTANTS.values()} == set(SCENARIOS.values())
    for one in ("thruster", "speed", "navigation"):
        assert {f"{one} detector off", f"{one} threshold tenfold"} <= set(MUTANTS)

"""A failsafe that can never come about is told when the configuration is read."""

from __future__ import annotations

import pytest

from gateway.config_sections import Failsafe, Thruster
from gateway.failsafe_settings import KEYS, contradictions, in_words
from gateway.supervision.actions import Action, sends

TABLES = {"mavlink": {}, "speed": {}, "navigation": {}}
SOURCE = {"link": "can0", "esc_index": 0}


def thruster(**direction: float) -> Thruster:
    return Thruster(number=1, command=SOURCE, rpm=SOURCE, **direction)


def told(key: str, *ladder: str, thrusters=(), tables=TABLES) -> list[str]:
    problems = [*contradictions(Failsafe(**{key: list(ladder)}), thrusters, tables)]
    assert all(problem.key == f"failsafe.{key}" for problem in problems)
    return [str(problem) for problem in problems]


@pytest.mark.parametrize("key", KEYS)
def test_advice_needs_nothing(key):
    assert told(key, "warn", tables={}) == []
    assert told(key, "none", tables={}) == []


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("action", list(filter(sends, Action)))
def test_every_action_needs_a_link_to_the_autopilot(key, action):
    without = {name: table for name, table in TABLES.items() if name != "mavlink"}
    assert any("[mavlink]" in one for one in told(key, action, tables=without))
    assert not any("[mavlink]" in one for one in told(key, action))


@pytest.mark.parametrize(("key", "table"), [("speed_fault", "speed"), ("navigation_fault", "navigation")])
def test_what_is_not_watched_asks_for_nothing(key, table):
    without = {name: one for name, one in TABLES.items() if name != table}
    assert any(f"means nothing without a table [{table}]" in one for one in told(key, "hold", tables=without))
    assert told(key, "hold") == []


@pytest.mark.parametrize("action", ["surface", "land", "disarm", "terminate"])
def test_above_hold_a_second_kind_of_evidence_must_be_there(action):
    without = {"mavlink": {}}
    for key in ("thruster_fault", "thrusters_fault"):
        assert any("a table [speed], which can confirm it" in one for one in told(key, action, tables=without))
        assert told(key, action) == []
    (problem,) = told("navigation_fault", action)
    assert 'nothing above "hold" is asked: want "manual" or "hold"' in problem


@pytest.mark.parametrize("action", ["hold", "surface", "land"])
def test_what_needs_vertical_thrust_needs_to_know_which_thrusters_are_vertical(action):
    unknown = [thruster()]
    assert any("down = 1 or -1" in one for one in told("speed_fault", action, thrusters=unknown))
    assert told("speed_fault", action, thrusters=[thruster(down=-1.0)]) == []
    assert told("speed_fault", "manual", thrusters=unknown) == []


def test_each_action_of_a_ladder_is_looked_at():
    problems = told("navigation_fault", "disarm", "surface", "hold", "warn")
    assert len(problems) == 2


def test_what_is_asked_is_told_in_words():
    assert in_words(Failsafe()) == "advice only: nothing is asked of the autopilot"
    failsafe = Failsafe(
        thruster_fault=("surface", "hold"), speed_fault="warn", navigation_fault="manual", delay_s=3.0
    )
    assert in_words(failsafe) == (
        "asked of the autopilot, announced 3 s before: surface, else hold at a fault of a thruster; "
        "manual at a fault of a navigation sensor"
    )

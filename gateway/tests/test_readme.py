"""The README tells the same story as the code."""

import re
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli import main
from gateway.config import parse
from gateway.supervision import intervention_table, levels
from gateway.supervision.actions import Action
from gateway.tests.conftest import SPEED_WATCH, TWO_THRUSTERS

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("diagram", [levels.diagram, intervention_table.diagram])
def test_diagrams_are_drawn_from_the_tables(diagram):
    assert f"```mermaid\n{diagram()}\n```" in README


def test_every_action_is_explained():
    table = README[README.index("| action, the worst wins") : README.index("Two kinds of evidence are")]
    assert set(re.findall(r"`([a-z]+)`", table)) >= set(Action)


def test_failsafe_of_the_readme_is_a_valid_configuration(tmp_path):
    (text,) = re.findall(r"```toml\n(\[failsafe\]\n.*?)```", README, flags=re.DOTALL)
    navigation = "[navigation]\n"
    driving = TWO_THRUSTERS.replace("down = 1", "down = 1\nahead = 1")
    failsafe = parse(driving + SPEED_WATCH + navigation + text, tmp_path).failsafe
    assert failsafe.thruster_fault == (Action.SURFACE, Action.HOLD)
    assert set(tomllib.loads(text)["failsafe"]) <= set(type(failsafe).model_fields)


@pytest.mark.parametrize("command", sorted(set(re.findall(r"^gateway ([a-z]+)", README, flags=re.MULTILINE))))
def test_commands_of_the_readme_exist(command):
    assert CliRunner().invoke(main, [command, "--help"]).exit_code == 0

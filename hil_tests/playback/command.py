"""The commands `gateway hil ...`. What each needs is imported when it is called: `gateway --help` stays quick."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

import click

# Each command with the module that has it.
COMMANDS: Mapping[str, str] = {
    "play": "hil_tests.playback.play_command",
    "play-log": "hil_tests.playback.play_log_command",
    "new": "hil_tests.playback.scenario_commands",
    "check": "hil_tests.playback.scenario_commands",
    "list": "hil_tests.playback.scenario_commands",
    "schema": "hil_tests.playback.scenario_commands",
}


class LateGroup(click.Group):
    """Its commands are imported one by one, when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """In the order in which they are needed."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name."""
        if cmd_name not in COMMANDS:
            return None
        module = import_module(COMMANDS[cmd_name])
        name = cmd_name.replace("-", "_")
        command: click.Command = getattr(module, f"{name}_command", None) or getattr(module, name)
        return command


@click.group(cls=LateGroup, short_help="Play scripted faults onto simulated or real buses, and judge.")
def hil() -> None:
    """Play scripted faults onto simulated or real buses, and judge what the gateway makes of them.

    A scenario is one readable file: vehicle, mission, water, faults on a time line, what is expected and what must
    not happen.
    """

"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path

import click

config_argument = click.argument("config", type=click.Path(path_type=Path, dir_okay=False))
offset_option = click.option(
    "--offset",
    "offsets",
    multiple=True,
    metavar="LOG=SECONDS",
    help="Added to the times of LOG, whose clock was another; left out: found, where the logs show it.",
)

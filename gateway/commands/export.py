"""`gateway export`: recordings in the formats that people's tools read."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(short_help="Write recordings as candump logs and tlogs.")
@click.argument("recording", nargs=-1, required=True, type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help="A folder in it is written for each run; an earlier export's files in that are replaced.",
)
def export(recording: tuple[Path, ...], out: Path) -> None:
    """Write recordings of gateway run in the formats that other tools read, one folder for each run.

    \b
    can.log         the frames of all buses, as candump -l writes them: can-utils, python-can, SavvyCAN
    heard.tlog      what came over MAVLink: QGroundControl, MAVExplorer, pymavlink
    all.tlog        the same, with what the gateway said
    findings.jsonl  what was found

    Files of one run may be named in any order. What is damaged is passed over, and told with its place. A recording
    itself (.mcap) opens in Foxglove, Lichtblick and PlotJuggler.
    """
    from gateway.recording.export import export as export_run
    from gateway.recording.export import runs

    try:
        for run in runs(recording):
            for line in export_run(run, out).lines():
                click.echo(line)
    except OSError as error:
        raise click.ClickException(f"{error.filename or out}: {error.strerror or error}") from error
    except ValueError as error:
        raise click.ClickException(str(error)) from error

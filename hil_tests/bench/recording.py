"""`gateway bench recording`: what it costs to record two full buses with all that is made of them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import click
from rich.console import Console
from rich.table import Table

from drivers.logs.damage import DamageReport
from gateway.recording.entries import Frames
from gateway.recording.folder import recordings
from gateway.recording.journal import Journal, NoJournal
from gateway.recording.reading import read_entries
from gateway.recording.recorder import Recorder
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.recorded_traffic import BUSES, MOMENT_S, Moment, traffic
from hil_tests.bench.recording_timing import START_S, about, beside_blf, beside_mcap, settings
from hil_tests.bench.tables import timing_table
from hil_tests.bench.timing import Timing
from hil_tests.bench.timing import measure as timed
from hil_tests.processes import processes, results

SECONDS, FEW_SECONDS = 20.0, 3.0
CLOSE_S = 10.0
TICK_EVERY = 10  # moments


@dataclass(frozen=True, slots=True)
class Figures:
    """One recording, at the pace at which it comes.

    Attributes:
        seconds: its time.
        frames, readings, verdicts: that were given to the recorder.
        kept: frames that are in the files.
        lost: of all that was given, what was not recorded.
        cpu_share: of one core, for the recorder, less what giving it costs without one.
        mb_per_s: on the disk.
    """

    seconds: float
    frames: int
    readings: int
    verdicts: int
    kept: int
    lost: int
    cpu_share: float
    mb_per_s: float


def recorded(seconds: float) -> Figures:
    """Records traffic into a folder of its own, and reads it back."""
    moments = list(traffic(seconds, START_S))
    idle_s = _cpu_s(moments, NoJournal())
    with TemporaryDirectory(prefix="gateway-bench-") as name:
        folder = Path(name)
        recorder = Recorder(settings(folder), about(), time.time)
        recorder.begin()
        cpu_s = _cpu_s(moments, recorder) - idle_s
        files = recordings(folder)
        kept = sum(_frames(one.path) for one in files)
        size = sum(one.size for one in files)
    return Figures(
        seconds=seconds,
        frames=sum(len(block) for one in moments for block in one.frames),
        readings=sum(len(several) for one in moments for several in one.readings),
        verdicts=sum(len(one.judgements) for one in moments),
        kept=kept,
        lost=recorder.lost.total(),
        cpu_share=cpu_s / seconds,
        mb_per_s=size / seconds / 1e6,
    )


def _cpu_s(moments: Sequence[Moment], journal: Journal) -> float:
    """Seconds of processor time for giving it all of them at their pace, and ending it."""
    begin_s, cpu_s = time.perf_counter(), time.process_time()
    for number, moment in enumerate(moments):
        time.sleep(max(0.0, begin_s + number * MOMENT_S - time.perf_counter()))
        _give(journal, moment)
        if number % TICK_EVERY == 0:
            journal.now(moment.time_s)
    journal.close(CLOSE_S)
    return time.process_time() - cpu_s


def _give(journal: Journal, moment: Moment) -> None:
    for bus, frames, readings in zip(BUSES, moment.frames, moment.readings, strict=True):
        journal.frames(bus, frames)
        journal.decoded(bus, readings)
    for packet in moment.packets:
        journal.heard(packet, moment.time_s)
    journal.outcomes(moment.judgements, moment.time_s)


def _frames(path: Path) -> int:
    batches = read_entries(path, DamageReport())
    return sum(len(one.frames) for entries in batches for one in entries if isinstance(one, Frames))


def measure(seconds: float, console: Console) -> dict[str, Figures | list[Timing]]:
    """Measures, and prints the tables."""
    with processes(1) as pool:
        [figures] = results([pool.submit(recorded, seconds)], "recording")
    console.print(_table(figures))
    timings = [timed(comparison()) for comparison in (beside_mcap, beside_blf)]
    console.print(timing_table(timings))
    return {"full buses": figures, "beside others": timings}


@click.command(short_help="The recorder's cost at two full buses.")
@click.option(
    "--seconds", type=click.FloatRange(min=1.0), default=SECONDS, show_default=True, help="Of the recording."
)
@shared_options
def recording(*, seconds: float, jobs: int, json_file: str | None) -> None:
    """Record two full buses at their own pace: frames, ESC reports, verdicts, MAVLink. Then frames beside others.

    The recording takes 1 MB a second in the folder for temporary files.
    """
    write({"recording": measure(seconds, console_beside(json_file))}, json_file)


def _table(figures: Figures) -> Table:
    table = Table(title="Two full buses, recorded at their own pace")
    cells = {
        "frames/s": f"{figures.frames / figures.seconds:.0f}",
        "ESC reports/s": f"{figures.readings / figures.seconds:.0f}",
        "verdicts/s": f"{figures.verdicts / figures.seconds:.0f}",
        "frames\ngiven": str(figures.frames),
        "frames in\nthe files": str(figures.kept),
        "of one core": f"{figures.cpu_share:.1%}",
        "MB/s": f"{figures.mb_per_s:.2f}",
    }
    for heading in cells:
        table.add_column(heading, justify="right")
    table.add_row(*cells.values())
    return table

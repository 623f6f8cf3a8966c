"""`gateway bench timing`: the time that our code takes beside a peer's for the same work."""

from __future__ import annotations

import click
from rich.console import Console

from hil_tests.bench.decoding_dataflash import dataflash
from hil_tests.bench.decoding_dbc import dbc_blocks, dbc_frames, vesc_blocks, vesc_frames
from hil_tests.bench.decoding_dronecan import command_blocks, command_frames, status_blocks, status_frames
from hil_tests.bench.decoding_logs import candump_hilspy, candump_python_can, has_hilspy
from hil_tests.bench.decoding_mavlink import (
    has_fasttlogparser,
    mavlink_asked,
    mavlink_bytes,
    mavlink_datagrams,
    tlog,
    tlog_columns,
)
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.metrics_timing import metrics
from hil_tests.bench.navigation_timing import navigation_watch
from hil_tests.bench.predictor_timing import has_onnx, predictor_step
from hil_tests.bench.speed_timing import speed_watch
from hil_tests.bench.supervisor_timing import supervision
from hil_tests.bench.tables import timing_table
from hil_tests.bench.thruster_timing import full_refit, refit, whole_run
from hil_tests.bench.timing import Timing, measure
from hil_tests.processes import processes, results

WORKS = {
    "full refit": full_refit,
    "refit": refit,
    "whole run": whole_run,
    "speed watch": speed_watch,
    "navigation watch": navigation_watch,
    "supervision": supervision,
    "metrics": metrics,
    "esc.Status": status_frames,
    "esc.Status, block": status_blocks,
    "esc.RawCommand": command_frames,
    "esc.RawCommand, block": command_blocks,
    "DBC": dbc_frames,
    "DBC, block": dbc_blocks,
    "VESC": vesc_frames,
    "VESC, block": vesc_blocks,
    "candump log": candump_python_can,
    "MAVLink datagrams": mavlink_datagrams,
    "MAVLink thrusters": mavlink_asked,
    "MAVLink bytes": mavlink_bytes,
    "tlog": tlog,
    "dataflash log": dataflash,
}
if has_onnx():
    WORKS["predictor"] = predictor_step
if has_hilspy():
    WORKS["candump log, compiled"] = candump_hilspy
if has_fasttlogparser():
    WORKS["tlog columns"] = tlog_columns


def time_works(console: Console) -> list[Timing]:
    """Measures, and prints the table."""
    with processes(1) as pool:  # alone: nothing else shall slow down one side of a ratio
        timings = results([pool.submit(time_work, work) for work in WORKS], "timing")
    console.print(timing_table(timings))
    if not has_hilspy():
        console.print(
            "candump log beside hilspy: skipped, it is not installed: pip install 'thruster-gateway[bench]'"
        )
    if not has_fasttlogparser():
        console.print(
            "tlog beside fasttlogparser: skipped, it is not installed and builds with --no-build-isolation only"
        )
    return timings


def time_work(name: str) -> Timing:
    """Build and measure one of `WORKS`, named, for closures do not travel to other processes."""
    return measure(WORKS[name]())


@click.command(short_help="Time of our code beside others'.")
@shared_options
def timing(*, jobs: int, json_file: str | None) -> None:
    """Compare the time of our code with that of others for the same work; always in one process."""
    write({"timing": time_works(console_beside(json_file))}, json_file)

"""What other processes are asked to do, by name or number: closures do not travel."""

from __future__ import annotations

from hil_tests.bench.decoding import dbc_status, esc_status, mavlink_stream, raw_command
from hil_tests.bench.speed import Timing, measure, refit, whole_run
from hil_tests.paper_experiments import Run, run
from hil_tests.paper_trials import TRIALS

WORKS = {
    "refit": refit,
    "whole run": whole_run,
    "esc.Status": esc_status,
    "esc.RawCommand": raw_command,
    "DBC": dbc_status,
    "MAVLink": mavlink_stream,
}


def time_work(name: str) -> Timing:
    """Build and measure one of `WORKS`."""
    return measure(WORKS[name]())


def paper_run(number: int, seed: int) -> Run:
    """One of the paper's experiments (0, 1, 2), simulated with this seed, under its online and its fixed model."""
    return run(TRIALS[number](seed), seed=seed)

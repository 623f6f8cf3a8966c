"""The benchmark of recording: all that it gives is recorded, and the peers write the same frames."""

from __future__ import annotations

import math

import pytest

from hil_tests.bench.recorded_traffic import BUS_HZ
from hil_tests.bench.recording import recorded
from hil_tests.bench.recording_timing import beside_blf, beside_mcap


def test_nothing_of_two_full_buses_is_lost():
    figures = recorded(0.5)
    assert figures.frames == figures.kept == 0.5 * 2 * BUS_HZ
    assert figures.readings == figures.frames / 3
    assert figures.verdicts == 0.5 * 8 * 50
    assert figures.lost == 0
    assert figures.mb_per_s > 0.0
    assert math.isfinite(figures.cpu_share)


@pytest.mark.parametrize("comparison", [beside_mcap, beside_blf])
def test_the_peers_write_the_same(comparison):
    compared = comparison(0.05)
    assert compared.count == 0.05 * BUS_HZ
    assert compared.agree(compared.ours(), compared.theirs())
    assert not compared.agree(compared.ours(), comparison(0.06).theirs())

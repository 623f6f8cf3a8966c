"""The tail of the likelihood ratio: peaks are found, and a law that is there is found again."""

from __future__ import annotations

import numpy as np
import pytest

from hil_tests.bench.navigation_cases import Simulated
from hil_tests.navigation_thresholds import Healthy, Tail, healthy, peaks_of, report, tail_of


def drawn(seed, dives=200, once_an_hour=20.0, per_e_fold=3.0, peaks=40):
    """Dives of an hour whose peaks follow the law."""
    rng = np.random.default_rng(seed)
    level = once_an_hour - per_e_fold * np.log(peaks)
    return [Healthy(str(n), 1.0, np.sort(level + rng.exponential(per_e_fold, peaks))[::-1]) for n in range(dives)]


def test_peaks_are_the_greatest_and_apart():
    time_s = np.arange(0.0, 200.0)
    values = np.exp(-((time_s - 50.0) ** 2) / 800.0) + 0.5 * np.exp(-((time_s - 150.0) ** 2) / 800.0)
    values[10] = np.nan
    found = peaks_of(time_s, values)
    assert found[:2] == pytest.approx([1.0, 0.5], rel=0.02)
    assert (np.diff(found) <= 0.0).all()
    assert len(found) == 2  # nothing else is 60 s from both
    assert len(peaks_of(time_s, np.full(200, np.nan))) == 0


def test_the_law_is_found_again():
    tail = tail_of(drawn(0))
    assert tail.once_an_hour == pytest.approx(20.0, abs=0.4)
    assert tail.per_e_fold == pytest.approx(3.0, rel=0.1)
    assert Tail(20.0, 3.0, 1).per_hour(20.0 + 3.0 * np.log(10.0)) == pytest.approx(0.1)


def test_the_other_half_keeps_what_the_first_promises():
    lines = report("drawn", drawn(1)).splitlines()
    counted = [float(line.split("half ")[1].split(" /")[0]) for line in lines if "counted" in line]
    assert counted == pytest.approx([4.0, 2.0, 1.0], rel=0.3)


def test_too_few_peaks_are_said():
    with pytest.raises(ValueError, match="more dives"):
        tail_of(drawn(0, dives=1, peaks=5))


def test_a_dive_is_played():
    one = healthy(Simulated(0, duration_s=60.0, imu_hz=10.0))
    assert one.hours == pytest.approx(60.0 / 3600.0, rel=0.01)
    assert len(one.peaks) >= 1
    assert np.isfinite(one.peaks).all()

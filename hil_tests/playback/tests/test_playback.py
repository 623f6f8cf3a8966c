"""Series in, frames out, each at its time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFrame
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.playback.player import play
from hil_tests.playback.recordings import read_esc_bench, read_ngs_tank
from hil_tests.playback.series import ThrusterSeries, chained
from hil_tests.playback.traffic import dronecan_traffic

DATA = Path(__file__).parents[4] / "shared" / "data"
recorded = pytest.mark.skipif(not DATA.is_dir(), reason=f"no recorded data: {DATA} is absent")


def ramp(count=100, rate_hz=100.0, start_s=0.0):
    time_s = start_s + np.arange(count) / rate_hz
    command = np.linspace(-1.0, 1.0, count)
    return ThrusterSeries(time_s, command, 3000.0 * command, np.full(count, 16.0), np.full(count, np.nan))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"time_s": np.zeros(100)}, "rise"),
        ({"command": np.full(100, 1.5)}, "command must lie in -1 to 1, got up to 1.5"),
        ({"command": np.full(100, np.nan)}, "command must lie"),
        ({"speed_rpm": np.full(100, np.inf)}, "finite"),
        ({"speed_rpm": np.zeros(99)}, "one length"),
    ],
)
def test_what_is_no_series_is_refused(change, reason):
    with pytest.raises(ValueError, match=reason):
        replace(ramp(), **change)


def test_a_part_starts_at_zero():
    part = ramp(start_s=7.0).part(7.25, 7.5)
    assert part.time_s == pytest.approx(np.arange(25) / 100.0)
    assert part.command[0] == ramp().command[25]
    with pytest.raises(ValueError, match="at least 1"):
        ramp().part(5.0, 6.0)


def test_thinning_keeps_the_first_sample_of_every_period():
    thinned = ramp().thinned(25.0)
    assert thinned.time_s == pytest.approx(np.arange(25) / 25.0)
    gappy = ThrusterSeries(*(column[[0, 1, 2, 9, 10, 30]] for column in ramp().columns())).thinned(25.0)
    assert gappy.time_s == pytest.approx([0.0, 0.09, 0.3])


def test_the_fault_lasts_from_its_moment_on():
    faulty = ramp().with_speed_scaled(0.75, from_s=0.5)
    assert np.array_equal(faulty.speed_rpm[:50], ramp().speed_rpm[:50])
    assert np.array_equal(faulty.speed_rpm[50:], 0.75 * ramp().speed_rpm[50:])
    assert np.array_equal(faulty.command, ramp().command)


def test_chained_runs_keep_their_pace_and_their_distance():
    chain = chained([ramp(start_s=5.0), ramp(start_s=-3.0)], pause_s=2.0)
    assert chain.time_s[[0, 99, 100, 199]] == pytest.approx([0.0, 0.99, 2.99, 3.98])
    assert np.array_equal(chain.command, np.tile(ramp().command, 2))


def test_traffic_says_what_the_series_say_in_order_of_time():
    series = {0: ramp(50, 50.0), 2: ramp(25, 25.0, start_s=0.01)}
    frames = dronecan_traffic(series)
    decoder = DroneCanDecoder([DroneCanThruster(1, 0), DroneCanThruster(2, 2)])
    readings = [reading for frame in frames for reading in decoder.decode(frame)]
    assert not decoder.drops
    assert [frame.time_s for frame in frames] == sorted(frame.time_s for frame in frames)
    for thruster, one in ((1, series[0]), (2, series[2])):
        reports = [r for r in readings if isinstance(r, ThrusterReport) and r.thruster == thruster]
        commands = [r for r in readings if isinstance(r, ThrusterCommand) and r.thruster == thruster]
        assert [report.time_s for report in reports] == list(one.time_s)
        assert [report.speed_rpm for report in reports] == pytest.approx(list(one.speed_rpm), abs=0.5)
        assert {report.voltage_v for report in reports} == {16.0}
        assert {report.current_a for report in reports} == {None}
        at_samples = [command.fraction for command in commands if command.time_s in one.time_s]
        assert at_samples == pytest.approx(list(one.command), abs=1e-4)


class ManualClock:
    """Time that passes only in sleep, and while a frame is sent."""

    def __init__(self):
        self.time_s = 100.0

    def now(self):
        return self.time_s

    def sleep(self, seconds):
        assert seconds > 0.0
        self.time_s += seconds


def test_frames_are_sent_when_they_are_due():
    clock, sent = ManualClock(), []
    frames = [CanFrame(time_s, 1, b"") for time_s in (0.0, 0.5, 0.5, 2.0)]
    late_s = play(frames, lambda _: sent.append(clock.time_s), now=clock.now, sleep=clock.sleep)
    assert sent == pytest.approx([100.0, 100.5, 100.5, 102.0])
    assert late_s == pytest.approx(0.0, abs=1e-9)


def test_a_slow_bus_delays_only_what_could_not_be_sent_in_time():
    clock, sent = ManualClock(), []

    def send(frame):
        sent.append(clock.time_s)
        clock.time_s += 0.3 if frame.time_s == 0.5 else 0.0

    frames = [CanFrame(time_s, 1, b"") for time_s in (0.0, 0.5, 0.6, 2.0)]
    late_s = play(frames, send, now=clock.now, sleep=clock.sleep)
    assert sent == pytest.approx([100.0, 100.5, 100.8, 102.0])
    assert late_s == pytest.approx(0.2)


@recorded
def test_the_tank_runs_are_read():
    runs = read_ngs_tank(DATA / "ngs_tank" / "closed_loop_runs.csv")
    assert len(runs) == 24
    for run in runs.values():
        assert run.duration_s == pytest.approx(10.0)
        assert 850.0 < run.speed_rpm.max() < 1050.0
        assert 0.5 < np.abs(run.command).max() <= 0.6


@recorded
@pytest.mark.parametrize("name", ["f40_steps_5-2", "esc32v3_f60-1"])
def test_the_bench_series_are_read(name):
    series = read_esc_bench(DATA / "esc_bench" / f"{name}.csv")
    assert series.time_s[0] == 0.0
    assert 105.0 < series.duration_s < 116.0
    assert 0.005 < np.median(np.diff(series.time_s)) < 0.02
    assert series.command.min() == 0.0
    assert series.command.max() == 1.0
    assert 16_000.0 < series.speed_rpm.max() < 16_300.0
    assert 14.0 < series.voltage_v.min() < series.voltage_v.max() < 17.5
    resting = series.command == 0.0
    assert np.median(series.speed_rpm[resting]) == 0.0

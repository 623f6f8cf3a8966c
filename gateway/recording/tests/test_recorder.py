"""The recorder beside a run: files that follow each other, and what a kill or a torn file leaves of them."""

import logging
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from gateway.recording.entries import Frames, Tick
from gateway.recording.folder import file_name, idle, make_room, recordings
from gateway.recording.reading import read_about
from gateway.recording.recorder import Recorder
from gateway.recording.scribe import Scribe
from gateway.recording.tests.dive import START_S, about, dive, frames, read, same
from gateway.recording.tests.running import all_of, recording, settings, until
from gateway.recording.waiting import Waiting


def test_a_run_is_recorded(tmp_path: Path):
    with recording(tmp_path / "recordings") as recorder:
        recorded = dive(recorder, seconds=2)
    assert recorder.place == recorded.place
    (file,) = recordings(tmp_path / "recordings")
    entries, damage = read(file.path)
    assert file.path.name == "bluerov2-heavy_20261122_183923_001.mcap"
    assert all(same(one, other) for one, other in zip(entries, recorded.entries, strict=True))
    assert not damage.lost
    assert not recorder.lost
    assert file.path.name in recorder.state_words()


def test_a_run_that_says_nothing_leaves_no_file(tmp_path: Path):
    with recording(tmp_path):
        pass
    assert not recordings(tmp_path)


def test_files_follow_each_other_by_size(tmp_path: Path):
    scribe = Scribe(settings(tmp_path, file_max_mb=1.0), about(), lambda: START_S)
    journal = Waiting(lambda: START_S)
    random, wanted = np.random.default_rng(1), 0
    for number in range(8):
        journal.heard(random.bytes(400_000), START_S + number)
        scribe.remember(b"state %d" % number)
        scribe.write(journal.take(1 << 20).items)
        wanted += 1
    scribe.close()
    found = recordings(tmp_path)
    assert [one.part for one in found] == [1, 2, 3, 4]
    assert all(one.size <= 1e6 for one in found)
    assert [one.place for one in all_of(tmp_path)] == list(range(1, wanted + 1))
    abouts = [read_about(one.path) for one in found]
    assert [one.part for one in abouts] == [1, 2, 3, 4]
    assert [one.state for one in abouts] == [b"state 0", b"state 2", b"state 4", b"state 6"]
    assert {one.run for one in abouts} == {"5f3c"}


def test_files_follow_each_other_by_time(tmp_path: Path):
    now_s = START_S
    scribe = Scribe(settings(tmp_path, file_max_minutes=1.0), about(), lambda: now_s)
    for second in range(0, 150, 25):
        now_s = START_S + second
        scribe.write([Tick(1 + second, now_s)])
    scribe.close()
    assert [len(read(one.path)[0]) for one in recordings(tmp_path)] == [3, 3]


def test_what_was_learnt_never_fills_the_files(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    """Small files beside a large state would each be full at once."""
    scribe = Scribe(settings(tmp_path, budget_mb=4.0), about(), lambda: START_S)
    scribe.begin(bytes(600_000), True)
    for second in range(5):
        scribe.remember(bytes(700_000))
        scribe.write([Tick(1 + second, START_S + second)])
    scribe.close()
    (file,) = recordings(tmp_path)
    assert file.size < 100_000
    assert read_about(file.path).resumed
    (told,) = [one.getMessage() for one in caplog.records]
    assert "set recording.file_max_mb = 2 and recording.budget_mb = 8" in told


def test_two_runs_of_the_same_second(tmp_path: Path):
    for run in ("a", "b"):
        scribe = Scribe(settings(tmp_path), about(run=run), lambda: START_S)
        scribe.write([Tick(1, START_S)])
        scribe.close()
    assert [read_about(one.path).run for one in recordings(tmp_path)] == ["a", "b"]


def test_two_runs_of_the_same_second_that_go_on_side_by_side(tmp_path: Path):
    """Parts of each are counted on their own: where a number is missing, a replay takes a part for lost."""
    now_s = START_S
    several = {
        run: Scribe(settings(tmp_path, file_max_minutes=1.0), about(run=run), lambda: now_s) for run in ("a", "b")
    }
    for minute in range(3):
        now_s = START_S + 60.0 * minute
        for scribe in several.values():
            scribe.write([Tick(1 + minute, now_s)])
    for scribe in several.values():
        scribe.close()
    found = [read_about(one.path) for one in recordings(tmp_path)]
    assert [(one.run, one.part) for one in found] == [("a", 1), ("b", 1), ("a", 2), ("b", 2), ("a", 3), ("b", 3)]


def test_the_budget_takes_the_oldest(tmp_path: Path):
    other = tmp_path / "dive of last year.mcap"
    other.write_bytes(bytes(3_000_000))
    for day in range(5):
        scribe = Scribe(settings(tmp_path, budget_mb=2.0), about(started_s=START_S + 86400 * day), lambda: START_S)
        journal = Waiting(lambda: START_S)
        journal.heard(np.random.default_rng(day).bytes(450_000), START_S)
        scribe.write(journal.take(1 << 20).items)
        scribe.close()
    found = recordings(tmp_path)
    assert [one.began[:8] for one in found] == ["20261123", "20261124", "20261125", "20261126"]
    assert sum(one.size for one in found) <= 2e6
    assert other.exists()


def test_the_budget_spares_what_is_being_written(tmp_path: Path):
    paths = [tmp_path / file_name("rov", START_S + number, 1) for number in range(3)]
    for path in paths:
        path.write_bytes(bytes(1000))
    with idle(paths[0]) as writing:
        assert writing is not None
        with idle(paths[0]) as another:
            assert another is None
        assert make_room(tmp_path, 1500) == [paths[1]] or make_room(tmp_path, 1500) == []
    assert paths[0].exists()
    assert not paths[1].exists()


@pytest.mark.parametrize(
    ("vehicle", "slug"),
    [("BlueROV2 Heavy", "bluerov2-heavy"), ("../../x", "x"), ("Ä", "vehicle"), ("a" * 99, "a" * 40)],
)
def test_names_of_files(vehicle: str, slug: str):
    assert file_name(vehicle, START_S, 7) == f"{slug}_20261122_183923_007.mcap"


def test_files_without_an_end_are_mended_by_the_next_run(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    scribe = Scribe(settings(tmp_path), about(), lambda: START_S)
    scribe.write(dive().items)
    torn = tmp_path / file_name("rov", START_S - 100.0, 1)
    torn.write_bytes(scribe.path.read_bytes()[:-100])
    (tmp_path / file_name("rov", START_S - 200.0, 1)).write_bytes(b"")
    caplog.set_level(logging.INFO)
    with recording(tmp_path) as recorder:
        recorder.now(START_S)
        until(lambda: f"{torn.name} had no end" in caplog.text)
    assert "no end" not in "".join(read(torn)[1].lost)
    assert "cannot be mended" in caplog.text
    scribe.close()


KILLED = """
import sys, time
from pathlib import Path
from gateway.config_sections import Recording
from gateway.recording.recorder import Recorder
from gateway.recording.tests.dive import about, frames

recorder = Recorder(Recording(folder=Path(sys.argv[1]), keep_free_mb=0.0), about(), time.time)
recorder.begin()
while True:
    recorder.frames("can0", frames(10, time.time()))
    print(recorder.place, flush=True)
    time.sleep(0.01)
"""


def test_a_killed_run_loses_the_last_second_at_most(tmp_path: Path):
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(1.6)
        killed_s = time.time()
        process.kill()
    entries = all_of(tmp_path)
    assert all(isinstance(one, Frames) for one in entries)
    assert killed_s - entries[-1].frames.time_s[-1] < 1.0
    places = [place for one in entries for place in one.place.tolist()]
    assert all(after == before + 1 for before, after in pairwise(places))
    assert places[0] == 1


def test_what_can_be_worked_out_again_gives_way_first():
    journal = Waiting(lambda: START_S, most_bytes=100_000)
    for number in range(200):
        journal.frames("can0", frames(10, START_S + number))
        dive_in = [one for one in dive().items if type(one).__name__ == "Decoded"]
        journal.decoded("can0", dive_in[0].readings)
        if journal.lost["frames"]:
            break
    assert journal.lost["decoded readings"] > 20 * journal.lost["frames"] / 10


def test_a_recorder_that_never_began(tmp_path: Path):
    assert Recorder(settings(tmp_path), about(), lambda: START_S).close(0.0)
    assert not list(tmp_path.iterdir())

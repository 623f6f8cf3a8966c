"""Disks that fail: recording pauses and goes on, what is lost is told, and nothing of it reaches the run."""

import errno
import logging
import resource
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

from gateway.recording import recorder as recorder_module
from gateway.recording.folder import file_name, make_room, recordings
from gateway.recording.mending import mend_all
from gateway.recording.recorder import Recorder
from gateway.recording.scribe import Scribe
from gateway.recording.tests.dive import START_S, about, dive, read
from gateway.recording.tests.running import WITHIN_S, all_of, recording, settings, until
from gateway.recording.waiting import Waiting


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is tried again in seconds is tried again at once."""
    monkeypatch.setattr(recorder_module, "AGAIN_S", 0.05)
    monkeypatch.setattr(recorder_module, "CHUNK_S", 0.05)


@contextmanager
def small_disk(folder: Path, options: str) -> Iterator[Path]:
    """A disk of its own, where this machine lets us have one."""
    folder.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], capture_output=True, check=False
    )
    if made.returncode != 0:
        pytest.skip(f"no disk of our own: {made.stderr.decode().strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def fill(path: Path) -> None:
    """Until its disk is full."""
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while file.write(bytes(4096)):
            pass


def test_a_full_disk_pauses_and_goes_on(tmp_path: Path, soon: None, caplog: pytest.LogCaptureFixture):
    caplog.set_level(logging.INFO)
    with small_disk(tmp_path / "disk", "size=1m") as disk:
        ballast = disk / "ballast"
        ballast.write_bytes(bytes(700_000))
        with recording(disk) as recorder:
            for _ in range(6):
                recorder.heard(np.random.default_rng(1).bytes(100_000), START_S)
                time.sleep(0.06)
            until(lambda: "paused" in recorder.state_words())
            time.sleep(0.2)
            ballast.unlink()
            until(lambda: "paused" not in recorder.state_words())
            recorder.now(START_S + 1.0)
        entries = all_of(disk)
        assert [one.place for one in entries] == list(range(1, 8))
    assert not recorder.lost
    (paused,) = [one.getMessage() for one in caplog.records if "pauses" in one.getMessage()]
    assert "No space left on device; delete or move away" in paused
    assert any("goes on" in one.getMessage() for one in caplog.records)


def test_a_disk_that_stays_full(tmp_path: Path, soon: None):
    """What finds no room in memory is lost, and told in the recording when there is one again."""
    with small_disk(tmp_path / "disk", "size=1m") as disk:
        fill(disk / "ballast")
        recorder = Recorder(settings(disk), about(), lambda: START_S, most_bytes=50_000)
        recorder.begin()
        for number in range(40):
            recorder.heard(np.random.default_rng(number).bytes(3000), START_S + number)
        until(lambda: "paused" in recorder.state_words())
        kept = 40 - recorder.lost["MAVLink packets"]
        assert 0 < kept < 40
        (disk / "ballast").unlink()
        until(lambda: "paused" not in recorder.state_words())
        recorder.now(START_S)
        assert recorder.close(WITHIN_S)
        (file,) = recordings(disk)
        entries, damage = read(file.path)
        assert len(entries) == kept + 1
        assert damage.lost == {"not recorded, no room: MAVLink packets": 40 - kept}


def test_a_read_only_folder(tmp_path: Path, soon: None, caplog: pytest.LogCaptureFixture):
    with small_disk(tmp_path / "disk", "size=1m,ro") as disk:
        with recording(disk) as recorder:
            recorder.now(START_S)
            until(lambda: "paused" in recorder.state_words())
        assert recorder.lost == {"ticks": 1}
    assert "Read-only file system" in caplog.text
    assert "set recording.folder" in caplog.text


def test_a_folder_that_is_a_file(tmp_path: Path, soon: None, caplog: pytest.LogCaptureFixture):
    (tmp_path / "recordings").write_text("no folder")
    with recording(tmp_path / "recordings") as recorder:
        dive(recorder)
        until(lambda: "paused" in recorder.state_words())
    assert "recording pauses" in caplog.text
    assert recorder.lost["frames"] == 91


def test_a_folder_that_vanishes(tmp_path: Path, soon: None):
    folder = tmp_path / "recordings"
    with recording(folder) as recorder:
        recorder.now(START_S)
        until(lambda: folder.exists() and bool(recordings(folder)))
        until(lambda: recorder.waiting_bytes == 0)
        shutil.rmtree(folder)
        recorder.now(START_S + 1.0)
        until(lambda: folder.exists() and recorder.waiting_bytes == 0)
    assert [one.place for one in all_of(folder)] == [2]


def test_too_little_of_the_disk_is_free(tmp_path: Path, soon: None, caplog: pytest.LogCaptureFixture):
    with recording(tmp_path, keep_free_mb=1e9) as recorder:
        recorder.now(START_S)
        until(lambda: "paused" in recorder.state_words())
    assert "are to be left free; delete" in caplog.text
    assert not recordings(tmp_path)


def test_a_limit_of_the_file_size(tmp_path: Path):
    """A chunk that does not fit leaves nothing of itself behind."""
    scribe = Scribe(settings(tmp_path), about(), lambda: START_S)
    journal = Waiting(lambda: START_S)
    journal.now(START_S)
    scribe.write(journal.take(1 << 20).items)
    size = scribe.path.stat().st_size
    journal.heard(np.random.default_rng(1).bytes(100_000), START_S)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 5000, before[1]))
    try:
        with pytest.raises(OSError, match="File too large") as caught:
            scribe.write(journal.take(1 << 20).items)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert caught.value.errno == errno.EFBIG
    assert scribe.path.stat().st_size == size


def test_a_file_that_may_not_be_written_is_kept(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    """Whoever is root may write to all but those of a disk that is read-only."""
    with small_disk(tmp_path / "disk", "size=1m") as disk:
        files = [disk / file_name("rov", START_S + number, 1) for number in range(2)]
        for one in files:
            one.write_bytes(bytes(1000))
        kept = str(files[0])
        subprocess.run(["mount", "--bind", kept, kept], check=True)
        try:
            subprocess.run(["mount", "-o", "remount,bind,ro", kept], check=True)
            assert make_room(disk, 0.0) == files[1:]
            mend_all(disk)
        finally:
            subprocess.run(["umount", kept], check=True)
    assert "cannot be mended" in caplog.text

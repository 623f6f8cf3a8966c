"""What `gateway check` says of the place for recordings."""

import os
import shutil
from collections import namedtuple

import pytest

from gateway.checking.recording import check_recording
from gateway.config import parse
from gateway.config_sections import Recording
from gateway.recording.folder import file_name
from gateway.tests.conftest import TWO_THRUSTERS

Usage = namedtuple("Usage", "total used free")


@pytest.fixture
def disk(monkeypatch):
    """The disk has so many MB free."""

    def has(free_mb: float) -> None:
        monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1e12, 0, free_mb * 1e6))

    return has


@pytest.mark.parametrize(
    ("free_mb", "ok", "said"),
    [
        (10_000.0, True, "the oldest are deleted beyond 100 MB"),
        (590.0, True, "it pauses after 90 MB more: set recording.budget_mb below 91 to have the oldest deleted"),
        (501.1, True, "set recording.budget_mb below 2 to"),
        (500.5, False, "its disk 500 MB free, of which 500 MB stay free; make room"),
        (499.0, False, "its disk 499 MB free, of which 500 MB stay free; make room"),
    ],
)
def test_room_on_the_disk(tmp_path, disk, free_mb, ok, said):
    disk(free_mb)
    (tmp_path / file_name("ROV", 1.7e9, 1)).write_bytes(b"x" * 1_000_000)
    (tmp_path / "of somebody else").write_bytes(b"x" * 9_000_000)
    found = check_recording(Recording(folder=tmp_path, budget_mb=100.0))
    assert found.ok is ok and said in found.line() and f"{tmp_path} has 1 MB of recordings" in found.line()


def test_a_folder_that_is_not_there_yet_is_no_problem(tmp_path):
    found = check_recording(Recording(folder=tmp_path / "recordings", keep_free_mb=0.0))
    assert found.ok and "has 0 MB of recordings" in found.detail and not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_made_is_told_with_the_way_out(tmp_path):
    line = check_recording(Recording(folder=tmp_path / "no" / "recordings")).line()
    assert line.startswith(f"problem  recording: no folder {tmp_path / 'no'}; mkdir -p {tmp_path / 'no'}")
    (tmp_path / "file").touch()
    assert not check_recording(Recording(folder=tmp_path / "file")).ok


def test_a_file_in_its_place_is_told(tmp_path):
    (tmp_path / "recordings").write_text("no folder")
    found = check_recording(Recording(folder=tmp_path / "recordings"))
    assert not found.ok
    assert "recordings is no folder; move it away" in found.line()


def test_a_folder_of_another_user_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    line = check_recording(Recording(folder=tmp_path)).line()
    assert line == (
        f"problem  recording: {tmp_path} cannot be written; give this user the right to, or set recording.folder"
    )


def test_what_is_not_wanted_is_not_looked_at(tmp_path):
    config = parse(f"{TWO_THRUSTERS}[recording]\nenabled = false\nfolder = 'no/such'\n", tmp_path)
    assert (
        check_recording(config.recording).line()
        == "ok       recording: nothing is recorded (recording.enabled = false)"
    )

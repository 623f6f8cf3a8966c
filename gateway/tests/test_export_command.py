"""`gateway export`: what it says, and what it refuses."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.commands.export import export as command
from gateway.config_sections import Recording
from gateway.recording.scribe import Scribe
from gateway.recording.tests.dive import START_S, about, dive


def record(folder: Path, seconds: int) -> Path:
    """A recording, in one chunk."""
    scribe = Scribe(Recording(folder=folder, keep_free_mb=0.0), about(), lambda: START_S)
    scribe.write(dive(seconds=seconds).items)
    scribe.close()
    return scribe.path


def test_damage_is_told(tmp_path: Path):
    file = record(tmp_path, 2)
    file.write_bytes(file.read_bytes()[:-500])
    result = CliRunner().invoke(command, [str(file), "--out", str(tmp_path / "out")])
    assert result.exit_code == 0
    assert "can.log: 182" in result.output
    assert "no end" in result.output


def test_without_what_it_says_of_itself(tmp_path: Path):
    file = record(tmp_path, 1)
    file.write_bytes(file.read_bytes().replace(b"started_s", b"startedXs"))
    result = CliRunner().invoke(command, [str(file), "--out", str(tmp_path / "out")])
    assert result.exit_code == 0
    assert "can.log: 91" in result.output
    assert "what it says of itself is damaged" in result.output


@pytest.mark.parametrize("name", ["missing.mcap", "dive.log"])
def test_what_cannot_be_exported(tmp_path: Path, name: str):
    (tmp_path / "dive.log").write_text("(1.0) can0 123#00\n")
    result = CliRunner().invoke(command, [str(tmp_path / name), "--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert result.output.startswith("Error: ")
    assert name in result.output

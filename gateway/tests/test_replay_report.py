"""The report of a replay as a user meets it: it is written always, unless he does not want it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gateway.cli import main
from gateway.tests.recorded_dives import dronecan, jerky, settings, write_candump

SECONDS = 26.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dive in which the first thruster is held after ten seconds, and a calm one."""
    folder = tmp_path_factory.mktemp("my dive")
    (folder / "bus.toml").write_text(settings("dronecan"))
    write_candump(folder / "dive.log", dronecan(SECONDS, jerky))
    write_candump(folder / "calm.log", dronecan(5.0))
    (folder / "empty.log").write_bytes(b"")
    return folder


@pytest.fixture
def out(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(os, "cpu_count", lambda: 1)  # no processes for detectors: they take seconds to begin
    monkeypatch.chdir(folder)
    return tmp_path / "out"


def replayed(out: Path, *words: str) -> Result:
    return CliRunner().invoke(main, ["replay", "bus.toml", *words, "--out", str(out)])


def test_it_tells_the_fault_and_how_to_replay_it(out: Path) -> None:
    result = replayed(out, "dive.log")
    assert result.exit_code == 1
    assert f"report: {out / 'report.html'}" in result.stdout
    page = (out / "report.html").read_text()
    assert "1 fault found" in page
    fault = next(line for line in result.stdout.splitlines() if "FAULT" in line).split(maxsplit=2)[2]
    assert fault in page
    assert f"gateway replay bus.toml dive.log --out {out}" in page
    assert 'id="thruster-1"' in page
    assert not (out / "plots").exists()


def test_pictures_where_they_are_wanted(out: Path) -> None:
    (out / "plots").mkdir(parents=True)
    for left in ("thruster-9.png", "notes.txt"):
        (out / "plots" / left).write_text("of an earlier replay, and of the user")
    result = replayed(out, "calm.log", "--plots")
    assert result.exit_code == 0
    assert f"plots: {out / 'plots'}" in result.stdout.replace("\n", "")
    found = {path.name for path in (out / "plots").iterdir()}
    assert {"thruster-1.png", "thruster-1.svg", "notes.txt"} <= found
    assert "thruster-9.png" not in found
    assert (out / "plots" / "thruster-1.png").read_bytes().startswith(b"\x89PNG")


def test_none_where_it_is_not_wanted_nor_that_of_an_earlier_replay(out: Path) -> None:
    assert replayed(out, "calm.log").exit_code == 0
    assert (out / "report.html").exists()
    (out / "plots").mkdir()
    (out / "plots" / "timeline.svg").write_text("of an earlier replay")
    result = replayed(out, "calm.log", "--no-report")
    assert result.exit_code == 0
    assert not (out / "plots" / "timeline.svg").exists()
    assert "report" not in result.stdout
    assert not (out / "report.html").exists()


def test_figures_without_a_report_are_refused(out: Path) -> None:
    result = replayed(out, "calm.log", "--no-report", "--plots")
    assert result.exit_code == 2
    assert result.stderr == "Error: --plots are the figures of the report: leave out --no-report\n"


def test_of_a_log_with_nothing_in_it_there_is_none(out: Path) -> None:
    assert replayed(out, "empty.log").exit_code == 2
    assert not (out / "report.html").exists()


def test_a_part_of_a_dive_begins_with_what_was_so_before(out: Path) -> None:
    result = replayed(out, "dive.log", "--from", "0:20")
    assert result.exit_code == 1
    page = (out / "report.html").read_text()
    assert "told from 0:20 on" in page
    assert "1 fault found" in page
    assert "thruster 1 FAULT since before" in page
    assert "--from 0:20" in page

"""`gateway replay` as a user meets it: what is printed, what is written, how it ends."""

from __future__ import annotations

import gzip
import json
import os

import pytest
from click.testing import CliRunner

from gateway.cli import main
from gateway.tests.recorded_dives import (
    MAVLINK,
    candump_line,
    dronecan,
    jerky,
    settings,
    telemetry,
    write_candump,
    write_tlog,
)

SECONDS = 26.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of the one dive that is long enough, the first thruster is held after ten seconds."""
    folder = tmp_path_factory.mktemp("dive")
    (folder / "bus.toml").write_text(settings("dronecan"))
    (folder / "both.toml").write_text(settings("dronecan") + MAVLINK)
    write_candump(folder / "dive.log", dronecan(SECONDS, jerky))
    write_candump(folder / "calm.log", dronecan(5.0))
    write_candump(folder / "vcan7.log", dronecan(5.0), "vcan7")
    write_tlog(folder / "dive.tlog", telemetry(5.0))
    (folder / "packed.log.gz").write_bytes(gzip.compress((folder / "calm.log").read_bytes()))
    frames = list(dronecan(2.0))
    (folder / "two.log").write_text("".join(candump_line(one, f"can{n}") for one in frames for n in (0, 1)))
    (folder / "empty.log").write_bytes(b"")
    (folder / "picture.log").write_bytes(b"\xff\xd8\xff\xe0" + bytes(100))
    return folder


@pytest.fixture
def replay(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)  # no processes for detectors: they take seconds to begin
    monkeypatch.chdir(folder)

    def act(*words: str, out: str = str(tmp_path / "out")):
        return CliRunner().invoke(main, ["replay", *words, "--out", out])

    return act


def test_a_fault_is_told_by_the_time_of_the_dive_and_written_down(replay, tmp_path):
    result = replay("bus.toml", "dive.log")
    assert result.exit_code == 1
    lines = result.stdout.splitlines()
    first = next(line for line in lines if "FAULT" in line)
    assert first.startswith("0:00:1")
    assert " T1 " in first
    assert any(line.startswith("replayed 26.0 s of the dive, from 2023-11-14 22:13:20 UTC") for line in lines)
    findings = [json.loads(line) for line in (tmp_path / "out" / "findings.jsonl").read_text().splitlines()]
    assert any(one["subject"] == "thruster 1" and one["level"] == "FAULT" for one in findings)
    summary = (tmp_path / "out" / "summary.txt").read_text().splitlines()
    assert set(summary) - {""} == set(lines)


def test_of_a_healthy_dive_nothing_is_told(replay):
    result = replay("bus.toml", "calm.log")
    assert result.exit_code == 0
    assert result.stdout.startswith("replayed 5.0 s")


def test_verbose_tells_what_is_well(replay):
    assert "can0 ok" in replay("bus.toml", "calm.log", "-v").stdout


def test_an_earlier_replay_is_replaced(replay, tmp_path):
    for _ in range(2):
        replay("bus.toml", "calm.log", "-v")
    lines = (tmp_path / "out" / "findings.jsonl").read_text().splitlines()
    assert len(lines) == len(set(lines))


def test_packed_and_named_by_its_link(replay):
    whole, packed = replay("bus.toml", "calm.log", "-v"), replay("bus.toml", "can0=packed.log.gz", "-v")
    assert packed.stdout.replace("packed.log.gz", "calm.log") == whole.stdout


def test_an_interface_of_another_name_is_the_link_that_is_named(replay):
    assert replay("bus.toml", "can0=vcan7.log").exit_code == 0


def test_damage_is_told_with_its_line(replay, folder, tmp_path):
    lines = (folder / "calm.log").read_text().splitlines(keepends=True)
    lines[99] = "(1700000000.5 can0\n"
    (tmp_path / "damaged.log").write_text("".join(lines))
    result = replay("bus.toml", str(tmp_path / "damaged.log"))
    assert result.exit_code == 0
    assert "(line 100)" in result.stdout
    assert "(line 100)" in (tmp_path / "out" / "summary.txt").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["bus.toml", "nowhere.log"], "nowhere.log: No such file"),
        (["bus.toml", "."], "Is a directory"),
        (["bus.toml", "empty.log"], "nothing in these logs is of a link of the configuration"),
        (["bus.toml", "picture.log"], "picture.log is no CAN log"),
        (["bus.toml", "vcan7.log"], "nothing in these logs is of a link"),
        (["bus.toml", "dive.tlog"], "the configuration has no [mavlink]"),
        (["both.toml", "can0=dive.tlog"], "want a log of CAN for can0"),
        (["both.toml", "mavlink=calm.log"], "want a .tlog, .BIN or .ulg for mavlink"),
        (["bus.toml", "can1=calm.log"], "want one of the links can0, not 'can1'"),
        (["both.toml", "dive.tlog"], "nothing could be judged"),
        (["bus.toml", "calm.log", "calm.log"], "begins before the log before it ends"),
        (["bus.toml", "calm.log", "--to", "0"], "--to: want it to be after 2023-11-14T22:13:20Z"),
        (["bus.toml", "calm.log", "--to", "1970-01-01T00:00Z"], "when the dive begins"),
        (["bus.toml", "calm.log", "--from", "9" * 400], "want the time since the beginning"),
        (["bus.toml", "calm.log", "--against", "nowhere.toml"], "nowhere.toml"),
        (["bus.toml", "calm.log", "--offset", "5"], "want LOG=SECONDS, of calm.log"),
        (["bus.toml", "calm.log", "--offset", "calm.log=soon"], "'soon' is no number of seconds"),
        (["bus.toml", "calm.log", "--offset", "calm.log=nan"], "'nan' is no number of seconds"),
        (["bus.toml", "calm.log", "--offset", "dive.log=5"], "want LOG=SECONDS, of calm.log"),
        (["bus.toml", "can0=two.log"], "two.log has frames of can0 and of can1, and both would be can0"),
        (["calm.log", "calm.log"], "not valid TOML"),
        (["nowhere.toml", "calm.log"], "nowhere.toml"),
    ],
)
def test_what_cannot_be_replayed_is_said_in_words(replay, words, said):
    result = replay(*words)
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)
    assert said in result.stderr
    assert "Traceback" not in result.output


def test_an_interface_that_no_link_is_for_is_told_with_the_way_out(replay):
    assert "vcan7: 1750 frames" in (stdout := replay("bus.toml", "vcan7.log").stdout)
    assert "LINK=LOG" in stdout


@pytest.mark.parametrize("out", ["calm.log", "calm.log/below", "/proc/nowhere"])
def test_a_folder_that_cannot_be_written_is_told(replay, out):
    result = replay("bus.toml", "calm.log", out=out)
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)
    assert out.split("/")[0] in result.stderr


def test_nothing_is_judged_before_what_is_asked_for_is_found_wrong(replay, tmp_path):
    replay("bus.toml", "calm.log", "--against", "nowhere.toml")
    assert not (tmp_path / "out" / "findings.jsonl").exists()


def test_findings_of_the_gateway_itself_are_left_alone(replay, folder):
    live = folder / "findings.jsonl"
    live.write_text("of a run\n")
    result = replay("bus.toml", "calm.log", out=".")
    assert result.exit_code == 2
    assert "name another folder" in result.stderr
    assert live.read_text() == "of a run\n"


def test_nothing_of_an_earlier_replay_is_left_to_be_taken_for_this_one(replay, tmp_path):
    replay("bus.toml", "calm.log", "--against", "both.toml", "--phases", "2")
    before = {path.name for path in (tmp_path / "out").iterdir()}
    assert before >= {"report.html", "summary.txt", "diff.txt", "phases.txt"}
    assert replay("bus.toml", "picture.log").exit_code == 2
    assert not {path.name for path in (tmp_path / "out").iterdir()} & {"report.html", "summary.txt", "diff.txt"}


def test_interrupted_it_does_not_end_as_if_faults_were_found(replay, monkeypatch):
    def interrupted(_path):
        raise KeyboardInterrupt

    monkeypatch.setattr("gateway.commands.replaying.load", interrupted)
    result = replay("bus.toml", "calm.log")
    assert result.exit_code == 2
    assert "findings.jsonl" in result.stderr

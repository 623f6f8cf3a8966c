"""What a user may ask of a replay beside its findings: a part, one detector, other phases, another configuration."""

from __future__ import annotations

import json

import pytest

from gateway.tests.recorded_dives import dronecan, settings, write_candump
from gateway.tests.test_replay_command import SECONDS, folder, replay

__all__ = ["folder", "replay"]  # fixtures


def found(tmp_path, name: str = "findings.jsonl") -> list[dict]:
    return [json.loads(line) for line in (tmp_path / "out" / name).read_text().splitlines()]


def faults(tmp_path, name: str = "findings.jsonl") -> list[str]:
    return [one["subject"] for one in found(tmp_path, name) if one["level"] == "FAULT"]


def test_from_on_it_is_told_and_what_was_before_is_said(replay, tmp_path):
    """The thruster is held from 10 s to 16 s; its ESC is silent from 20 s on."""
    result = replay("bus.toml", "dive.log", "--from", "0:18", "--no-report")
    subjects = {one["subject"] for one in found(tmp_path)}
    assert "thruster 2 esc" in subjects
    assert min(one["time_s"] for one in found(tmp_path)) >= 1_700_000_018.0
    assert "told from 2023-11-14 22:13:38 UTC on; levels then: " in result.stdout
    assert result.exit_code == 1  # of the fault before


def test_until_then_as_if_the_log_ended(replay, tmp_path):
    assert replay("bus.toml", "dive.log", "--to", "22:13:29Z", "--no-report").exit_code == 0
    assert faults(tmp_path) == []
    assert "replayed 9.0 s" in (tmp_path / "out" / "summary.txt").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--from", "9:00"], "nothing of it lies within --from and --to"),
        (["--from", "now"], "1:02:03"),
        (["--from", "4", "--to", "2"], "--from lies 2.0 s behind --to"),
        (["--detector", "speed"], "has no [speed] table"),
        (["--phases", "1"], "2<=x<=64"),
        (["--against", "nowhere.toml"], "nowhere.toml: cannot be read"),
    ],
)
def test_what_cannot_be_is_said_with_the_way_out(replay, words, said):
    result = replay("bus.toml", "calm.log", *words)
    assert result.exit_code == 2
    assert said in result.stderr
    assert isinstance(result.exception, SystemExit)


def test_one_detector_alone(replay, folder, tmp_path):
    speed = '\n[mavlink]\nendpoint = "udpin:127.0.0.1:0"\n[speed]\nminimum_mps = 0.8\nmaximum_mps = 1.2\n'
    (folder / "speed.toml").write_text(settings("dronecan").replace("down = 1", "ahead = 1") + speed)
    replay("speed.toml", "dive.log", "--detector", "thruster", "--no-report")
    assert faults(tmp_path) == ["thruster 1"]
    result = replay("speed.toml", "dive.log", "--detector", "speed", "--no-report")
    assert not any(one["detector"] == "thruster" for one in found(tmp_path))
    assert "thruster 1" not in result.stdout


def test_what_all_phases_find_and_what_only_some(replay, tmp_path):
    """This dive's command changes exactly at the samples of one phase, and in between at those of the others."""
    result = replay("bus.toml", "dive.log", "--phases", "3", "--no-report")
    lines = (tmp_path / "out" / "phases.txt").read_text().splitlines()
    assert lines[0].endswith(" at all 3 phases of the samples")
    assert all(line in result.stdout for line in lines)
    several = [faults(tmp_path, name) for name in ("findings.jsonl", "others/phase_2.jsonl", "others/phase_3.jsonl")]
    some = {one for named in several for one in named if not all(one in other for other in several)}
    assert {line.partition(" FAULT")[0] for line in lines[1:] if " FAULT at 0:00:" in line} == some
    assert all("thruster 1" in one for one in several)
    first, third = (
        next(one for one in found(tmp_path, name) if (one["subject"], one["level"]) == ("thruster 1", "FAULT"))
        for name in ("findings.jsonl", "others/phase_3.jsonl")
    )
    assert 0.0 < abs(third["time_s"] - first["time_s"]) < 1.0  # it was sampled at other times


def test_another_configuration_beside(replay, folder, tmp_path):
    """One that takes much for normal finds nothing; with the same, there is no difference."""
    tolerant = settings("dronecan") + "\n[detector.thruster]\nthreshold_rpm = 5000\n"
    (folder / "tolerant.toml").write_text(tolerant)
    result = replay("bus.toml", "dive.log", "--against", "tolerant.toml", "--no-report")
    lines = (tmp_path / "out" / "diff.txt").read_text().splitlines()
    assert any("thruster 1 FAULT: not with tolerant.toml" in line for line in lines)
    assert all(line in result.stdout for line in lines)
    replay("bus.toml", "dive.log", "--against", "bus.toml", "--no-report")
    (line,) = (tmp_path / "out" / "diff.txt").read_text().splitlines()
    assert line.endswith(" alike to 0.5 s, 0 not")


def test_a_share_of_the_log_is_known_while_it_is_read(folder, tmp_path):
    """Of each format by its bytes: packed ones, too."""
    from gateway.config import load
    from gateway.replay.log_input import log_input
    from gateway.replay.reels import reels

    write_candump(tmp_path / "long.log", dronecan(SECONDS))
    config = load(folder / "bus.toml")
    for log in (tmp_path / "long.log", folder / "packed.log.gz"):
        (reel,) = reels([log_input(str(log), config.links())], config)
        assert reel.share() == 0.0
        shares = [reel.share() for _ in reel]
        assert shares == sorted(shares)
        assert reel.share() == 1.0

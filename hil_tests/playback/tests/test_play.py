"""One play: the same each time, and the same to a replay of what was recorded of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gateway.config import load
from gateway.pipeline import Factories
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.replay.session import replay
from hil_tests.playback.play import play, play_file
from hil_tests.playback.way import Way
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.loading import dump_scenario

# what the gateway says (said.tlog) tells of its computer as well, which is never the same
RECORDED = ("findings.jsonl", "can.log", "heard.tlog")
# how the gateway keeps pace, and what the bus carries beside what it reads, nobody can know afterwards
LIVE_ONLY = {"gateway", "link can0 load"}
SURVEY = {"style": "surveying", "mode": "MANUAL", "course": {"headings_deg": [0, 90, 180, 270], "leg_s": 15}}
# whatever has to do with chance, and frames and packets that come at odd times; then a fault, once all is learnt
TROUBLED = Scenario(
    vehicle="bench_rov",
    seed=0,
    duration_s=26,
    mission=SURVEY,
    faults=[
        {"at_s": 1, "duration_s": 1, "subject": "can0", "failure": "delay", "delay_s": 0.003, "jitter_s": 0.01},
        {"at_s": 1, "duration_s": 2, "subject": "mavlink", "failure": "loss", "share": 0.2},
        {"at_s": 2, "duration_s": 1, "subject": "can0", "failure": "duplication", "share": 0.3},
        {"at_s": 2, "duration_s": 2, "subject": "mavlink", "failure": "garbage", "share": 0.3},
        {"at_s": 4, "subject": "thruster 3 rpm", "failure": "off"},
    ],
)
BRIEF = TROUBLED.model_copy(update={"duration_s": 6.0})
ELSEWHERE = """
import sys
from pathlib import Path
from hil_tests.playback.play import play_file
play_file(Path(sys.argv[1]), Path(sys.argv[2]))
"""


def played(scenario, folder, way=None):
    outcome = play(scenario, folder.parent / "scenario.yaml", folder, way or Way())
    assert outcome.broken is None
    return outcome


def recorded(folder):
    return {name: (folder / name).read_bytes() for name in RECORDED}


@pytest.fixture(scope="module")
def troubled(tmp_path_factory):
    return played(TROUBLED, tmp_path_factory.mktemp("troubled") / "play")


def test_it_is_the_same_to_the_byte_in_any_process(tmp_path):
    file, here, there = (tmp_path / name for name in ("brief.yaml", "here", "there"))
    file.write_text(dump_scenario(BRIEF))
    play_file(file, here)
    command = [sys.executable, "-c", ELSEWHERE, file, there]
    subprocess.run(command, env=os.environ | {"PYTHONHASHSEED": "7"}, check=True)
    assert recorded(here) == recorded(there)


def test_another_seed_gives_another_play(tmp_path):
    for seed in (5, 6):
        played(BRIEF.model_copy(update={"seed": seed}), tmp_path / str(seed))
    first, second = (recorded(tmp_path / str(seed)) for seed in (5, 6))
    assert all(first[name] != second[name] for name in ("can.log", "heard.tlog"))


def replayed(folder, out):
    """Lines of the findings of a replay of what the gateway heard in a play."""
    config = load(folder / "gateway.toml")
    inputs = [log_input(str(folder / name), config.links()) for name in ("can.log", "heard.tlog")]
    replay(config, reels(inputs, config), out)
    return out.read_text().splitlines()


def test_a_replay_of_what_was_recorded_finds_the_same_to_the_byte(troubled, tmp_path):
    lines = (troubled.folder / "findings.jsonl").read_text().splitlines()
    of_the_dive = [line for line in lines if json.loads(line)["subject"] not in LIVE_ONLY]
    assert {json.loads(line)["detector"] for line in of_the_dive} == {"link", "signal", "speed", "thruster"}
    assert replayed(troubled.folder, tmp_path / "findings.jsonl") == of_the_dive


def test_faults_are_laid_over_a_recorded_play(troubled):
    """Thruster 3 was silent that day, thruster 1 was not."""
    logs = [str(Path("play") / name) for name in ("can.log", "heard.tlog")]
    again = Scenario(
        vehicle="bench_rov",
        duration_s=8,
        recording={"logs": logs, "from_s": 20},
        faults=[{"at_s": 4, "subject": "thruster 1 rpm", "failure": "off"}],
    )
    outcome = played(again, troubled.folder.parent / "again")
    silent = {one.subject: one.time_s - outcome.start_s for one in outcome.findings if one.level.name == "SUSPECT"}
    assert silent == {"thruster 3 esc": pytest.approx(5.0, abs=0.2), "thruster 1 esc": pytest.approx(7.1, abs=0.2)}
    assert outcome.truth is None
    assert outcome.wire_counts["CAN"]


def test_a_play_keeps_pace_with_the_clock_if_it_is_to(tmp_path):
    scenario = BRIEF.model_copy(update={"duration_s": 3.6, "faults": ()})
    outcome = played(scenario, tmp_path / "play", Way(realtime=True))
    assert outcome.way == "real time in memory"
    assert outcome.wall_s > 3.6
    assert outcome.end_s - outcome.start_s > 3.59  # a machine with other things to do takes longer
    assert "can0 ok" in {one.text for one in outcome.findings}


def test_settings_are_laid_over_the_gateways_configuration_and_null_takes_away(tmp_path):
    settings = {"speed": None, "detector": {"speed": None}, "mavlink": {"system_id": 9}}
    scenario = Scenario(vehicle="bench_rov", duration_s=0.1, gateway={"settings": settings})
    played(scenario, tmp_path / "play")
    config = load(tmp_path / "play" / "gateway.toml")
    assert config.speed is None
    assert config.mavlink.system_id == 9
    assert len(config.thruster) == 3


def test_a_gateway_that_fails_says_why_and_its_account_is_kept(tmp_path):
    def broken(*_):
        raise RuntimeError("no detector today")

    scenario = Scenario(vehicle="bench_rov", duration_s=1)
    outcome = play(scenario, tmp_path / "scenario.yaml", tmp_path / "play", factories=Factories(thruster=broken))
    assert outcome.broken == "the gateway ended by itself: RuntimeError: no detector today"
    assert outcome.end_s >= outcome.start_s
    assert (tmp_path / "play" / "gateway.log").exists()


def test_two_plays_do_not_write_into_one_folder(tmp_path):
    refused = []

    def begin_another(since_s):
        if not refused:
            with pytest.raises(ValueError, match=r"another play writes into .*--out") as caught:
                played(BRIEF, tmp_path / "play")
            refused.append(caught)

    scenario = Scenario(vehicle="bench_rov", duration_s=0.1)
    play(scenario, tmp_path / "scenario.yaml", tmp_path / "play", progress=begin_another)
    assert refused
    played(scenario, tmp_path / "play")


@pytest.mark.parametrize("way", [{"channel": ""}, {"autopilot": ""}, {"gateway": "", "bridge": ("can0", "can1")}])
def test_an_option_with_nothing_behind_it_is_no_option_left_out(way):
    with pytest.raises(ValueError, match="has nothing behind it"):
        Way(**way)

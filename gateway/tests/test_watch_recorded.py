"""A recorded dive that is played: as far as it should be, by the very findings of a replay, with a player's keys."""

from itertools import pairwise
from math import inf

import pytest

from detectors.verdict import Level
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Factories, Pipeline
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.tests.conftest import ThresholdDetector
from gateway.tests.recorded_dives import START_S, dronecan, settings, write_candump
from gateway.watch.pace import Pace
from gateway.watch.recorded_dive import RecordedDive
from gateway.watch.recorded_source import SKIP_S, RecordedSource

FAKES = Factories(thruster=ThresholdDetector)
SECONDS = 24.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """The first thruster is held from second 10 to 16, the second one's ESC is silent from 20 to 22.5."""
    return write_candump(tmp_path_factory.mktemp("dive") / "dive.log", dronecan(SECONDS))


@pytest.fixture
def config(tmp_path) -> Config:
    return parse(settings("dronecan"), tmp_path)


def dive_of(config: Config, *logs: object) -> RecordedDive:
    return RecordedDive(config, reels([log_input(str(one), config.links()) for one in logs], config), FAKES)


class Clock:
    """Real time, that goes on when it is told to; and by a little whenever it is looked at."""

    def __init__(self, look_s: float = 0.0) -> None:
        self.now_s, self._look_s = 1000.0, look_s

    def __call__(self) -> float:
        self.now_s += self._look_s
        return self.now_s


class Player:
    """A source with its clock."""

    def __init__(self, config: Config, *logs: object, speed: float = 1.0, look_s: float = 0.0) -> None:
        self.clock = Clock(look_s)
        self.source = RecordedSource("dive.log", lambda: dive_of(config, *logs), Pace(speed), 0.5, self.clock)

    def after(self, seconds: float):
        self.clock.now_s += seconds
        return self.source.look()

    def press(self, *acts: str):
        for act in acts:
            self.source.acts[act]()
        return self.source.look()


def level(look, subject: str) -> Level:
    return next(one.level for one in look.telemetry.subjects if one.subject == subject)


@pytest.mark.parametrize("length_s", [0.3, 7.0])
def test_the_findings_are_those_of_a_replay(config, log, length_s):
    dive, found = dive_of(config, log), []
    while dive.next_s < inf:
        found += dive.step(length_s)
    pipeline, wanted = Pipeline(config, FAKES), []
    for reel in reels([log_input(str(log), config.links())], config):
        for arrivals in reel:
            wanted += [one for one in pipeline.take_stretch(arrivals) if isinstance(one, Finding)]
    assert found == wanted and {one.level for one in found} >= {Level.NORMAL, Level.FAULT}
    assert dive.time_s - dive.begin_s == pytest.approx(SECONDS, abs=0.1)


def test_its_telemetry_is_that_of_the_moment(config, log):
    dive = dive_of(config, log)
    while dive.next_s < START_S + 12.0:
        dive.step(0.5)
    told = dive.telemetry()
    first = told.subjects[0]
    assert (first.subject, first.level) == ("thruster 1", Level.FAULT)
    assert first.values["residual_rpm"] < -500.0
    assert told.time_s == pytest.approx(START_S + 12.0, abs=0.1) and told.running_s == pytest.approx(12.0, abs=0.1)
    (link,) = told.links
    assert link.name == "can0" and link.received > 500
    assert told.findings["FAULT"] == 1 and told.texts[-1].text.startswith("T1 ")


def test_it_plays_as_fast_as_it_should(config, log):
    player = Player(config, log, speed=2.0)
    assert player.source.look().time == "0:00:00"
    look = player.after(3.0)
    assert look.telemetry.running_s == pytest.approx(6.0, abs=1.05)
    assert look.state == "dive.log, 2 times real time" and look.note == "2023-11-14 22:13:26 UTC"
    assert not look.ended


def test_faster_slower_pause_and_on(config, log):
    player = Player(config, log)
    player.source.look()
    assert player.press("faster", "faster", "slower").state == "dive.log, 2 times real time"
    player.press("pause")
    still = player.after(60.0)
    assert still.state == "dive.log, paused" and still.telemetry.running_s < 1.5
    on = player.press("pause")
    assert on.state == "dive.log, 2 times real time"
    assert player.after(1.0).telemetry.running_s > still.telemetry.running_s


def test_on_to_the_next_finding_and_there_it_stays(config, log):
    player = Player(config, log)
    player.source.look()
    look = player.press("next_finding")
    assert look.state == "dive.log, paused" and level(look, "thruster 1") is Level.FAULT
    assert look.telemetry.running_s == pytest.approx(10.5, abs=1.0)
    assert level(player.press("next_finding"), "thruster 2 esc") is not Level.NORMAL
    end = player.press("next_finding")
    assert end.ended and end.state == "dive.log, end of the dive"


def test_a_skip_takes_as_many_looks_as_it_needs(config, log):
    player = Player(config, log, look_s=0.2)  # two bits a look
    player.source.look()
    look, looks = player.press("skip"), 1
    assert look.state == "dive.log, on" and "as fast as this machine can" in look.note
    while not look.ended:
        look, looks = player.source.look(), looks + 1
    assert looks > 5 and SKIP_S > SECONDS


def test_again_from_the_beginning(config, log):
    player = Player(config, log)
    player.source.look()
    player.press("next_finding")
    again = player.press("again")
    assert again.telemetry.running_s < 1.0 and again.telemetry.findings.get("FAULT", 0) == 0
    assert level(player.press("next_finding"), "thruster 1") is Level.FAULT


def test_a_pause_in_the_log_is_passed_over(config, log, tmp_path):
    lines = log.read_text().splitlines(keepends=True)
    torn = tmp_path / "torn.log"
    torn.write_text("".join(one for one in lines if not 6.0 < float(one[1:18]) - START_S < 18.0))
    player = Player(config, torn)
    player.source.look()
    for _ in range(4):
        player.after(2.0)
    assert player.source.look().telemetry.running_s > 18.0


def test_what_is_damaged_is_told_at_the_end(config, log, tmp_path):
    lines = log.read_text().splitlines(keepends=True)
    lines[99] = "(1700000000.5 can0\n"
    damaged = tmp_path / "damaged.log"
    damaged.write_text("".join(lines[:2000]))
    player = Player(config, damaged)
    player.source.look()
    end = player.press("skip")
    assert end.ended and "(line 100)" in end.state


def test_a_log_that_vanishes_is_told_and_ends_it(config, log, tmp_path):
    copy = tmp_path / "copy.log"
    copy.write_bytes(log.read_bytes())
    player = Player(config, copy)
    player.source.look()
    copy.unlink()
    look = player.press("again")
    assert look.ended and "stopped: " in look.state and "copy.log" in look.state


def test_of_nothing_there_is_nothing_to_show(config, tmp_path):
    (tmp_path / "empty.log").write_bytes(b"")
    player = Player(config, tmp_path / "empty.log")
    look = player.source.look()
    assert look.telemetry is None and look.ended


def test_what_follows_has_a_pipeline_and_a_clock_of_its_own(config, log, tmp_path):
    """As runs of the gateway do, one after the other."""
    lines = log.read_text().splitlines(keepends=True)
    (tmp_path / "damaged.log").write_text("".join(["(1700000000.5 can0\n", *lines[:9000]]))
    several = [log_input(str(one), config.links()) for one in (tmp_path / "damaged.log", log)]
    dive = RecordedDive(config, [*reels(several[:1], config), *reels(several[1:], config)], FAKES)
    running_s, found = [], []
    assert dive.telemetry() is None
    while dive.next_s < inf:
        found += dive.step(1.0)
        running_s.append(dive.telemetry().running_s)
    assert min(running_s) >= 0.0
    assert [later for earlier, later in pairwise(running_s) if later < earlier] == [pytest.approx(1.0, abs=0.1)]
    assert [one.level for one in found if one.subject == "thruster 1"].count(Level.FAULT) == 2
    assert len(dive.lost()) == 1 and "(line 1)" in dive.lost()[0]

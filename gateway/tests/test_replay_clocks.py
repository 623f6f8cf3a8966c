"""Logs of one dive by several clocks: found, given, or refused with the way out."""

from __future__ import annotations

import pytest

from drivers.logs.tests.dataflash_writer import heading, record
from gateway.config import parse
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.replay.result import ReplayResult
from gateway.replay.session import replay
from gateway.tests.recorded_dives import (
    MAVLINK,
    START_S,
    dronecan,
    jerky,
    settings,
    telemetry,
    write_candump,
    write_tlog,
)
from gateway.tests.test_replay import FAKES

SECONDS = 90.0
TWO_LINKS = settings("dronecan").replace('"can0", esc_index = 0', '"mavlink", servo_channel = 1', 1) + MAVLINK


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    write_candump(folder / "bus.log", dronecan(SECONDS, jerky))
    write_tlog(folder / "same.tlog", telemetry(SECONDS, 0.0, jerky))
    write_tlog(folder / "ahead.tlog", telemetry(SECONDS, 222.0, jerky))
    write_tlog(folder / "other.tlog", telemetry(SECONDS, 222.0, lambda time_s: 0.5))
    return folder


@pytest.fixture
def replayed(folder, tmp_path):
    def act(*names: str, given_s: dict[str, float] | None = None) -> ReplayResult:
        config = parse(TWO_LINKS, tmp_path)
        given = {folder / name: seconds for name, seconds in (given_s or {}).items()}
        inputs = [log_input(str(folder / name), config.links()) for name in names]
        return replay(config, reels(inputs, config, given), tmp_path / "findings.jsonl", factories=FAKES)

    return act


def clock(result: ReplayResult) -> str:
    (line,) = [line for line in result.lines() if ": clock " in line]
    return line.split(": clock ")[1]


def test_minutes_apart_it_is_found_by_the_commands_of_both(replayed):
    result = replayed("bus.log", "ahead.tlog")
    found = clock(result)
    assert found.endswith("by commands of 89 s")
    assert float(found.split()[0]) == pytest.approx(-222.0, abs=0.02)
    assert result.judged
    assert not result.unjudged
    assert result.duration_s == pytest.approx(SECONDS, abs=0.1)


def test_the_same_clock_is_found_to_be_that(replayed):
    assert float(clock(replayed("bus.log", "same.tlog")).split()[0]) == pytest.approx(0.0, abs=0.02)


def test_given_it_is_taken(replayed):
    result = replayed("ahead.tlog", "bus.log", given_s={"ahead.tlog": -222.0})
    assert clock(result) == "-222.000 s, as given"
    assert not result.unjudged


def test_where_nothing_shows_it_the_way_out_is_said(replayed):
    with pytest.raises(ValueError, match=r"other\.tlog has no time in common .*: --offset \S*other\.tlog=SECONDS"):
        replayed("bus.log", "other.tlog")
    replayed("bus.log", "other.tlog", given_s={"other.tlog": -222.0})


def test_a_log_since_the_autopilots_start_needs_its_offset(replayed, folder):
    write_dataflash(folder / "dive.BIN")
    with pytest.raises(ValueError, match=r"dive\.BIN counts from a start of its own.*--offset"):
        replayed("bus.log", "dive.BIN")
    replayed("bus.log", "dive.BIN", given_s={"dive.BIN": START_S})


def test_two_logs_of_the_autopilot_are_one_too_many(replayed, folder):
    write_dataflash(folder / "dive.BIN")
    with pytest.raises(ValueError, match="are both of mavlink: replay one of them"):
        replayed("same.tlog", "dive.BIN")


def write_dataflash(path):
    """Ten seconds of an autopilot that does not know the time of day."""
    path.write_bytes(heading() + b"".join(record("RCOU", n * 20_000, *[1500] * 8) for n in range(500)))

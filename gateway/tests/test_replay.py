"""A log gives the findings that the same frames gave live, byte for byte."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.bus_state import BusState
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import read_dataflash
from drivers.logs.tests.dataflash_writer import heading, record
from drivers.logs.tests.ulog_writer import data, definitions
from drivers.logs.tlog import read_tlog
from drivers.logs.ulog import read_ulog
from drivers.mavlink.tests.peer import Peer
from drivers.readings import LinkState, Reading
from gateway.config import Config, load, parse
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Now, Pipeline
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.replay.result import ReplayResult
from gateway.replay.session import replay
from gateway.tests.conftest import ThresholdDetector
from gateway.tests.recorded_dives import (
    BUSES,
    MAVLINK,
    START_S,
    THRUSTERS,
    dronecan,
    moments,
    settings,
    telemetry,
    tlog_record,
    write_candump,
    write_tlog,
)
from gateway.wiring import can_decoder, mavlink_decoder, mavlink_thrusters

FAKES = Factories(thruster=ThresholdDetector)
SECONDS = 30.0
TICK_S, LATENESS_S = 0.1, 0.1  # of the running gateway
BUS_OFF = (0x40, bytes(8))
RESTARTED = (0x100, bytes(8))


def judged(config: Config, arrivals: Iterable[Arrival], factories: Factories) -> list[str]:
    """The findings of a live run: what comes, as it comes, and the time ten times a second."""
    pipeline, findings, tick = Pipeline(config, factories), [], 0.0
    for arrival in arrivals:
        newest_s = arrival.readings[-1].time_s
        outcomes = pipeline.take([arrival])
        if newest_s - tick >= TICK_S:
            tick = newest_s
            outcomes += pipeline.take([Now(newest_s - LATENESS_S)])
        findings += [one.json_line() for one in outcomes if isinstance(one, Finding)]
    return findings


def received(config: Config, frames: Iterable[CanFrame]) -> list[Arrival]:
    """What a live bus gives, frame by frame; at first, that it is up."""
    (bus,) = config.can
    decoder, state, arrivals = can_decoder(bus, config.thruster), BusState(Counter()), []
    arrivals.append(Arrival(bus.name, [LinkState(START_S, bus.name, True, "")]))
    for frame in frames:
        changes = state.changes(FrameBlock.of([frame]))
        readings: list[Reading] = [LinkState(frame.time_s, bus.name, one.up, one.detail) for one in changes]
        readings += decoder.decode(frame)
        if readings:
            arrivals.append(Arrival(bus.name, readings))
    return arrivals


def replayed(
    config: Config, logs: Iterable[Path], out: Path, factories: Factories | None = FAKES
) -> tuple[list[str], ReplayResult]:
    inputs = [log_input(str(log), config.links()) for log in logs]
    result = replay(config, reels(inputs, config), out, factories=factories)
    return out.read_text(encoding="utf-8").splitlines(), result


@pytest.fixture
def out(tmp_path):
    return tmp_path / "findings.jsonl"


@pytest.mark.parametrize("protocol", BUSES)
def test_a_can_log_gives_the_findings_of_its_dive(protocol, tmp_path, out):
    config = parse(settings(protocol), tmp_path)
    frames = list(BUSES[protocol][0](SECONDS))
    log = write_candump(tmp_path / "dive.log", frames)
    lines, result = replayed(config, [log], out)
    assert lines == judged(config, received(config, frames), FAKES)
    for word in ('"thruster 1", "level": "FAULT"', '"thruster 2 esc", "level": "SUSPECT"'):
        assert any(word in line for line in lines), word
    assert result.faulty
    assert result.duration_s == pytest.approx(SECONDS, abs=0.03)


def test_with_the_real_detector_and_in_processes_of_its_own(tmp_path, out):
    config = parse(settings("dronecan"), tmp_path)
    frames = list(dronecan(12.0))
    log = write_candump(tmp_path / "dive.log", frames)
    wanted = judged(config, received(config, frames), Factories())
    assert replayed(config, [log], out, None)[0] == wanted
    assert wanted


def with_errors(frames: Iterable[CanFrame], errors: dict[float, tuple[int, bytes]], gap_s: float) -> list[CanFrame]:
    """Error frames in between; after the first, no data for a while."""
    first_s = min(errors)
    data = [one for one in frames if not first_s <= one.time_s - START_S < first_s + gap_s]
    told = [
        CanFrame(START_S + time_s, identifier, data, extended=False, error=True)
        for time_s, (identifier, data) in errors.items()
    ]
    return sorted([*data, *told], key=lambda frame: frame.time_s)


@pytest.mark.parametrize("errors", [{5.0: BUS_OFF}, {5.0: BUS_OFF, 7.5: RESTARTED}])
def test_a_bus_that_goes_off_is_told_as_it_was(errors, tmp_path, out):
    config = parse(settings("dronecan"), tmp_path)
    frames = with_errors(dronecan(12.0), errors, gap_s=2.8)
    lines, result = replayed(config, [write_candump(tmp_path / "dive.log", frames)], out)
    assert lines == judged(config, received(config, frames), FAKES)
    assert any('"link can0", "level": "SUSPECT"' in line and "bus-off" in line for line in lines)
    assert result.drops["can0"]["bus-off"] == 1


def test_a_mavlink_log_gives_the_findings_of_its_dive(tmp_path, out):
    config = parse(over_mavlink(), tmp_path)
    log = write_tlog(tmp_path / "dive.tlog", telemetry(SECONDS))
    decoder = mavlink_decoder(config.mavlink, config.thruster)
    readings = [one for batch in read_tlog(log, decoder, DamageReport()) for one in batch]
    lines, _ = replayed(config, [log], out)
    assert lines == judged(config, [Arrival("mavlink", [one]) for one in readings], FAKES)
    assert any('"thruster 1", "level": "FAULT"' in line for line in lines)


def over_mavlink() -> str:
    """Both thrusters commanded and measured by the autopilot."""
    wired = THRUSTERS.replace('"can0"', '"mavlink"').format(
        command=("servo_channel = 1", "servo_channel = 2"), rpm=("esc_index = 0", "esc_index = 1")
    )
    return '[vehicle]\nname = "Test vehicle"\n' + MAVLINK + wired


def test_the_gateway_that_watched_the_dive_is_no_other_program(tmp_path, out):
    """A ground station logs what it gets: what the gateway of that dive said, too."""
    config = parse(over_mavlink(), tmp_path)
    autopilot, companion = Peer(), Peer(component=config.mavlink.component_id)
    recorded = [(time_s, autopilot.pack(message)) for time_s, message in telemetry(SECONDS)]
    recorded += [
        (START_S + n, companion.pack(dialect.MAVLink_statustext_message(4, b"T1 entangled"))) for n in range(30)
    ]
    log = tmp_path / "dive.tlog"
    log.write_bytes(b"".join(tlog_record(*one) for one in sorted(recorded, key=lambda one: one[0])))
    lines, _ = replayed(config, [log], out)
    assert lines == replayed(config, [write_tlog(tmp_path / "alone.tlog", telemetry(SECONDS))], out)[0]


def test_a_bus_and_an_autopilot_in_two_logs_are_one_dive(tmp_path, out):
    text = settings("dronecan").replace('"can0", esc_index = 0', '"mavlink", servo_channel = 1', 1) + MAVLINK
    config = parse(text, tmp_path)
    frames = list(dronecan(SECONDS))
    logs = [write_candump(tmp_path / "bus.log", frames), write_tlog(tmp_path / "dive.tlog", telemetry(SECONDS))]
    lines, _ = replayed(config, logs, out)
    assert lines == replayed(config, logs[::-1], out)[0]
    assert any('"thruster 1", "level": "FAULT"' in line for line in lines)
    assert any('"thruster 2 esc", "level": "SUSPECT"' in line for line in lines)


# Logs that go on one another, and clocks that were set ---------------------------------------------


def test_a_bus_each_in_a_log_of_its_own(tmp_path, out):
    text = settings("dronecan").replace("\n[[thruster]]", SECOND_BUS + "\n[[thruster]]", 1)
    config = parse(text.replace('rpm = { link = "can0"', 'rpm = { link = "can1"'), tmp_path)
    frames = list(dronecan(SECONDS))
    commands = write_candump(tmp_path / "a.log", [one for one in frames if one.identifier & 0x7F == 10])
    statuses = [one for one in frames if one.identifier & 0x7F != 10]
    lines, _ = replayed(config, [write_candump(tmp_path / "b.log", statuses, "can1"), commands], out)
    assert any('"thruster 1", "level": "FAULT"' in line for line in lines)


SECOND_BUS = '\n[[can]]\nname = "can1"\ninterface = "virtual"\nchannel = "can1"\nprotocol = "dronecan"\n'


def test_parts_of_a_log_in_any_order_are_the_log(tmp_path, out):
    config = parse(settings("dronecan"), tmp_path)
    frames = list(dronecan(SECONDS))
    cuts = [(0, 700), (700, 8000), (8000, None)]
    parts = [write_candump(tmp_path / f"{n}.log", frames[a:b]) for n, (a, b) in enumerate(cuts)]
    lines, _ = replayed(config, [parts[1], parts[2], parts[0]], out)
    assert lines == replayed(config, [write_candump(tmp_path / "whole.log", frames)], out)[0]


def test_two_logs_of_the_same_time_and_link_are_refused(tmp_path, out):
    config = parse(settings("dronecan"), tmp_path)
    logs = [write_candump(tmp_path / f"{name}.log", dronecan(5.0)) for name in "ab"]
    with pytest.raises(ValueError, match=r"b\.log begins before the log before it ends: replay one of them"):
        replayed(config, logs, out)


@pytest.mark.parametrize("by_s", [-5.0, -300.0, -86400.0])
def test_after_a_clock_was_set_back_the_dive_goes_on(by_s, tmp_path, out):
    config = parse(settings("dronecan"), tmp_path)
    frames = list(dronecan(SECONDS))
    half = len(frames) // 2
    later = [replace(one, time_s=round(one.time_s + by_s, 6)) for one in frames[half:]]
    lines, result = replayed(config, [write_candump(tmp_path / "set.log", [*frames[:half], *later])], out)
    wanted, _ = replayed(config, [write_candump(tmp_path / "right.log", frames)], out)
    assert [text_of(line) for line in lines] == [text_of(line) for line in wanted]
    assert any("set back by" in line for line in result.lines())


def text_of(line: str) -> str:
    """Who is how, without the numbers: the clock was set between two frames, whose distance is not known."""
    finding = json.loads(line)
    return f"{finding['subject']} {finding['level']}"


@pytest.mark.parametrize("pause_s", [4.0, 90.0, 700.0, 86400.0])
def test_a_pause_is_no_silence_and_ends_nothing(pause_s, tmp_path, out):
    """A recording that was stopped and begun again, or two dives in one file."""
    config = parse(settings("dronecan"), tmp_path)
    frames = list(dronecan(SECONDS))
    at_s = START_S + 17.0
    later = [replace(one, time_s=one.time_s + pause_s) if one.time_s >= at_s else one for one in frames]
    lines, result = replayed(config, [write_candump(tmp_path / "dive.log", later)], out)
    assert lines == judged(config, received(config, later), FAKES)
    assert not any("silent 4" in line or '"link can0", "level": "SUSPECT"' in line for line in lines)
    assert result.drops["pipeline"]["time far from the last"] == (4 if pause_s > 600.0 else 0)


# What autopilots log themselves ---------------------------------------------------------------------


def dataflash(seconds: float) -> bytes:
    records = [heading(*((f"SERVO{n}_{what}", pwm) for n in (1, 2) for what, pwm in PULSES))]
    for n, _, command, speeds in moments(seconds):
        boot_us = 20_000 * n + 1000
        records.append(record("RCOU", boot_us, *[round(1500 + 400 * command)] * 2))
        records += [record("ESC", boot_us + 2000, number - 1, rpm, rpm, 16.0, 3.0) for number, rpm in speeds]
    return b"".join(records)


PULSES = (("MIN", 1100), ("TRIM", 1500), ("MAX", 1900))


def ulog(seconds: float) -> bytes:
    messages = [definitions(13)]
    for n, _, command, speeds in moments(seconds):
        boot_us, rpm = 20_000 * n + 1000, dict(speeds)
        messages.append(data(1, boot_us, 2, *[round(1500 + 400 * command)] * 2))
        escs = [(boot_us, 0, round(rpm.get(number, 0.0)), 16.0, 3.0, 30.0) for number in (1, 2)]
        messages.append(data(3, boot_us + 2000, 2, *escs[0], *escs[1]))
    return b"".join(messages)


@pytest.mark.parametrize(("name", "content"), [("dive.BIN", dataflash), ("dive.ulg", ulog)])
def test_an_autopilots_own_log_gives_what_its_readings_give_one_by_one(name, content, tmp_path, out):
    config = parse(over_mavlink(), tmp_path)
    log = tmp_path / name
    log.write_bytes(content(SECONDS))
    read = read_dataflash if name.endswith("BIN") else read_ulog
    batches = read(log, mavlink_thrusters(config.thruster), DamageReport(), False)
    arrivals = [Arrival("mavlink", [one]) for batch in batches for one in batch]
    lines, _ = replayed(config, [log], out)
    assert lines == judged(config, arrivals, FAKES)
    assert any('"thruster 1", "level": "FAULT"' in line for line in lines)


REAL = Path(__file__).parents[3] / "shared" / "data" / "ardusub_logs"
PWM = Path(__file__).parents[1] / "examples" / "pwm_mavlink_esc.toml"


@pytest.mark.skipif(not REAL.exists(), reason="recordings of a real vehicle are not here")
@pytest.mark.parametrize("name", ["small.tlog", "small.BIN"])
def test_a_real_vehicle_without_speeds_is_told_to_have_none(name, out):
    config = load(PWM)
    lines, result = replayed(config, [REAL / name], out, None)
    assert not result.judged
    assert sum('esc", "level": "SUSPECT"' in line for line in lines) == 5
    assert not any('"FAULT"' in line for line in lines)
    assert any("never judged: thruster 1" in line for line in result.lines())

"""Entries of a recording to readings, in the order in which the run has judged them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, TimeSync
from drivers.mavlink.signing import Signing, SigningKey
from drivers.readings import (
    AutopilotClock,
    AutopilotHeartbeat,
    BusLoad,
    IdentityConflict,
    Lateness,
    LinkState,
    OwnClock,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.config import Config, parse
from gateway.recording.entries import About, Entry, Found, Frames, Heard, Spoken, Tick, Told
from gateway.replay.recorded_links import RecordedLinks
from gateway.replay.recorded_order import in_stretches
from gateway.replay.reels import runs_of
from gateway.stretches.stretch import Stretch
from gateway.tests.conftest import TWO_THRUSTERS
from gateway.tests.recorded_dives import START_S, dronecan

OURS = (1, 192)


def readings(config: Config, entries: list[Entry]) -> list[tuple[str, object]]:
    links = RecordedLinks(config, START_S)
    for entry in entries:
        links.take(entry)
    return [(link, reading) for _, link, reading in Stretch.of(links.arrivals()).readings()]


def heartbeat(time_s: float, place: int, armed: bool = True) -> Heard:
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    return Heard(place, time_s, dialect.MAVLink_heartbeat_message(12, 3, 0x80 * armed | 1, 19, 4, 3).pack(sender))


def frames(first_place: int, *told: CanFrame, bus: str = "can0") -> Frames:
    return Frames(bus, FrameBlock.of(told), np.arange(first_place, first_place + len(told)))


def reports(seconds: float = 0.02) -> list[CanFrame]:
    return list(dronecan(seconds))


def test_links_and_the_time_are_told_in_the_order_of_their_places(config):
    told = readings(
        config,
        [
            frames(2, *reports()),
            heartbeat(START_S, 1),
            Told(50, "can0", BusLoad(START_S, "can0", 0.5)),
            Tick(51, START_S - 0.1),
            Told(52, "mavlink", LinkState(START_S, "mavlink", True, "")),
        ],
    )
    kinds = [type(reading) for _, reading in told]
    assert kinds[0] is AutopilotHeartbeat and ThrusterReport in kinds
    assert kinds[-3:] == [BusLoad, OwnClock, LinkState]
    assert [link for link, _ in told[-3:]] == ["can0", "gateway", "mavlink"]


def test_what_was_judged_in_front_of_a_place_comes_before_it(config):
    late = Told(9, "gateway", Lateness(START_S, 0.3, 0), before=3)
    told = readings(config, [Tick(2, START_S), Tick(3, START_S + 0.1), Tick(4, START_S + 0.2), late])
    assert [type(reading).__name__ for _, reading in told] == ["OwnClock", "Lateness", "OwnClock", "OwnClock"]


def test_readings_of_a_bus_and_what_is_told_of_it_interleave(config):
    several = reports(0.1)
    half = len(several) // 2
    block = frames(1, *several)
    place = int(block.place[half])
    told = readings(config, [block, Told(place, "can0", LinkState(several[half].time_s, "can0", True, "warning"))])
    states = [number for number, (_, reading) in enumerate(told) if isinstance(reading, LinkState)]
    assert len(states) == 1
    assert 0 < states[0] < len(told) - 1


def test_error_frames_are_neither_decoded_nor_taken_for_states(config):
    """What they meant was told then."""
    error = CanFrame(START_S, 0x40, bytes(8), error=True)
    several = reports()
    assert readings(config, [frames(1, error, *several)]) == readings(config, [frames(1, *several)])
    assert readings(config, [frames(1, error)]) == []


def test_buses_that_the_configuration_does_not_have_are_counted(config):
    links = RecordedLinks(config, START_S)
    links.take(frames(1, *reports(), bus="can7"))
    assert links.arrivals() == []
    assert links.unused["can7"] == len(reports())


def test_our_own_packets_are_known_when_they_come_back(config):
    """As they were then: another program with our ids would be a conflict."""
    encoder = MavlinkEncoder(*OURS)
    own = [encoder.encode(CompanionHeartbeat(CompanionState.ACTIVE), START_S + n) for n in range(6)]
    sent = [Spoken(10 * n + 2, START_S + n, data) for n, data in enumerate(own)]
    back = [Heard(10 * n + 3, START_S + n + 0.1, data) for n, data in enumerate(own)]
    known = [one for pair in zip(sent, back, strict=True) for one in pair]
    assert kinds(readings(config, [heartbeat(START_S, 1), *known])) == {AutopilotHeartbeat}
    assert IdentityConflict in kinds(readings(config, [heartbeat(START_S, 1), *back]))


def test_an_answer_to_our_question_tells_the_autopilots_clock(config):
    asked_ns = round(START_S * 1e9)
    question = MavlinkEncoder(*OURS).encode(TimeSync(0, asked_ns, 1, 1), START_S)
    autopilot = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    answer = dialect.MAVLink_timesync_message(60_000_000_000, asked_ns).pack(autopilot)
    asked, answered = Spoken(2, START_S, question), Heard(3, START_S + 0.01, answer)
    assert AutopilotClock in kinds(readings(config, [heartbeat(START_S, 1), asked, answered]))
    assert AutopilotClock not in kinds(readings(config, [heartbeat(START_S, 1), answered]))


def test_frames_that_the_autopilot_forwards_come_after_what_it_says_itself(tmp_path):
    text = TWO_THRUSTERS.replace('"virtual"', '"mavlink"').replace('"gateway tests"', '"1"')
    autopilot = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    several = [
        dialect.MAVLink_can_frame_message(
            0, 0, bus, len(one.data), one.identifier | 1 << 31, one.data.ljust(8, b"\0")
        )
        for one in reports(0.1)
        for bus in (0, 1)
    ]
    autopilot.seq = 1
    data = b"".join(one.pack(autopilot) for one in several)
    told = readings(parse(text, tmp_path), [replace(heartbeat(START_S, 1), data=heartbeat(START_S, 1).data + data)])
    assert isinstance(told[0][1], AutopilotHeartbeat)
    assert {(link, type(reading)) for link, reading in told[1:]} == {
        ("can0", ThrusterReport),
        ("can0", ThrusterCommand),
    }


def kinds(told: list[tuple[str, object]]) -> set[type]:
    return {type(reading) for _, reading in told}


@pytest.fixture
def signed(tmp_path):
    """A configuration with a key, and a HEARTBEAT that is signed with it."""
    key = tmp_path / "key"
    key.write_text("ab" * 32)
    key.chmod(0o600)
    config = parse(TWO_THRUSTERS.replace("[mavlink]", f'[mavlink]\nsigning_key = "{key}"', 1), tmp_path)
    packet = Signing(SigningKey(bytes.fromhex("ab" * 32)), START_S, 3).sign(heartbeat(START_S, 1).data, START_S)
    return config, Heard(1, START_S, packet), key


def test_a_signed_link_lets_in_whom_the_run_let_in(signed):
    config, packet, _ = signed
    assert kinds(readings(config, [packet])) == {AutopilotHeartbeat}
    assert readings(config, [heartbeat(START_S, 1)]) == []
    wrong = replace(packet, data=packet.data[:-1] + bytes([packet.data[-1] ^ 1]))
    assert readings(config, [wrong]) == []


def test_without_the_key_signatures_are_believed_and_that_is_said(signed):
    config, packet, key = signed
    key.unlink()
    links = RecordedLinks(config, START_S)
    assert "signatures were not checked" in links.remark
    links.take(packet)
    links.take(heartbeat(START_S, 2))
    (arrival,) = links.arrivals()
    assert len(arrival.readings.others) == 1
    assert links.drops()["mavlink"]["unsigned"] == 1


def ticks(first: int, count: int, from_s: float) -> list[Entry]:
    return [Tick(first + n, from_s + 0.1 * n) for n in range(count)]


def test_stretches_are_as_long_as_wanted_and_lose_nothing():
    chunks = [ticks(1 + 5 * n, 5, START_S + 0.5 * n) for n in range(100)]
    cut = list(in_stretches(chunks, length_s=10.0, ahead_s=3.0))
    assert [one for part in cut for one in part] == [one for chunk in chunks for one in chunk]
    assert len(cut) == 5


@pytest.mark.parametrize("late", [0, 3, 12])
def test_what_was_written_down_late_is_put_where_it_was_judged(late):
    """Unless that is too long ago: then as far in front as can be."""
    chunks = [ticks(1 + 5 * n, 5, START_S + 0.5 * n) for n in range(40)]
    told = Told(1000, "gateway", Lateness(START_S, 0.1, 0), before=101)
    chunks[20 + late] = [*chunks[20 + late], told]
    cut = list(in_stretches(chunks, length_s=1.0, ahead_s=3.0))
    (part,) = [part for part in cut if told in part]
    assert (Tick(101, pytest.approx(START_S + 10.0)) in part) == (late < 6)


def test_findings_and_empty_chunks_have_no_time_of_their_own(config):
    found = Found(3, None)
    assert list(in_stretches([[], [found], ticks(1, 3, START_S), []], 1.0)) == [[found, *ticks(1, 3, START_S)]]


def about(run: str, part: int, started_s: float) -> About:
    return About(run, part, started_s, "ROV", "1", "", {}, b"", resumed=False)


def test_parts_of_a_run_follow_each_other_and_behind_a_missing_one_another_begins():
    said = [about("b", 1, 20.0), about("a", 4, 10.0), about("a", 2, 10.0), about("a", 1, 10.0), about("a", 5, 10.0)]
    runs = list(runs_of({Path(f"{one.run}{one.part}"): one for one in said}))
    assert [[path.name for path, _ in parts] for parts in runs] == [["a1", "a2"], ["a4", "a5"], ["b1"]]
    assert list(runs_of({})) == []


def test_a_part_that_is_there_twice_is_judged_once():
    said = {Path(f"{folder}/{part}"): about("a", part, 10.0) for folder in ("dive", "copies") for part in (1, 2)}
    (parts,) = runs_of(said)
    assert [one.part for _, one in parts] == [1, 2]

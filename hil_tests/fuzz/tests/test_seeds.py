"""Valid input is read as what it is: what is damaged later gets beyond the first byte."""

from __future__ import annotations

from collections import Counter

import pytest
from click.testing import CliRunner

from drivers.can.frame import CanFrame
from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import read_dataflash
from drivers.logs.tlog import read_tlog
from drivers.logs.ulog import read_ulog
from drivers.mavlink.forwarded_frames import ForwardedFrames
from gateway.cli import main
from gateway.config import load
from gateway.control.protocol import Answer, Request
from hil_tests.fuzz import can_frames, replays
from hil_tests.fuzz.catalogue import TARGETS
from hil_tests.fuzz.files import HEAD_BYTES, as_file
from hil_tests.fuzz.frame_bytes import block_of, bytes_of
from hil_tests.fuzz.mavlink_bytes import contents, everything_decoder, framed, message_ids, packets, thrusters


@pytest.mark.parametrize("name", TARGETS)
def test_they_are_the_same_each_time(name):
    assert TARGETS[name].seeds() == TARGETS[name].seeds()


@pytest.mark.parametrize("name", ["candump", "asc", "trc", "blf", "can_log"])
def test_logs_of_can_have_frames(name):
    for seed in TARGETS[name].seeds():
        damage = DamageReport()
        with as_file(seed, "seed") as path:
            frames = sum(len(block) for _, block in open_can_log(path, damage))
        assert frames >= 2
        assert set(damage.lost) <= {"remote frame", "dropped before they were logged"}


def test_frames_come_back_from_their_bytes():
    frames = [CanFrame(0.0, 0x123, b"\1\2", extended=False), CanFrame(0.0, 0x1234567, bytes(64), fd=True)]
    back = list(block_of(bytes_of(frames)).frames())
    assert [(one.identifier, one.data, one.extended, one.fd) for one in back] == [
        (one.identifier, one.data, one.extended, one.fd) for one in frames
    ]


def readings_of(name, read):
    damage = DamageReport()
    with as_file(TARGETS[name].seeds()[0], "seed") as path:
        readings = [one for batch in read(path, damage) for one in batch]
    assert damage.lost == {}
    return Counter(type(one).__name__ for one in readings)


def test_logs_of_autopilots_have_all_readings():
    common = {"ThrusterCommand", "ThrusterReport", "Attitude", "AutopilotHeartbeat", "Inertial", "BodyVelocity"}
    dataflash = readings_of("dataflash", lambda path, damage: read_dataflash(path, thrusters(), damage, True))
    ulog = readings_of("ulog", lambda path, damage: read_ulog(path, thrusters(), damage, True))
    tlog = readings_of("tlog", lambda path, damage: read_tlog(path, everything_decoder(), damage))
    assert common <= set(dataflash)
    assert common <= set(ulog)
    assert common <= set(tlog)


def test_packets_of_every_kind_have_right_checksums():
    drops = Counter()
    forwarded = ForwardedFrames(drops)
    decoder = everything_decoder(can_frames=forwarded)
    readings = decoder.decode(b"".join(packets()), 1.0)
    assert len({type(one) for one in readings}) > 8
    assert len(forwarded.take()) == 2
    assert not {"checksum", "bytes outside frames", "unknown message"} & set(decoder.drops)


def test_messages_of_any_content_have_right_checksums():
    decoder = everything_decoder()
    sent = framed(contents())
    assert len(sent) == len(message_ids()) + 2
    decoder.decode(b"".join(packet for _, packet in sent), 1.0)
    assert not {"checksum", "bytes outside frames", "unknown message"} & set(decoder.drops)


@pytest.mark.parametrize("name", ["dronecan", "dronecan_transfers", "vesc", "dbc"])
def test_frames_of_buses_are_read(name, monkeypatch):
    told = []
    require_same = can_frames._require_same
    monkeypatch.setattr(
        can_frames, "_require_same", lambda *arguments: (told.append(arguments[2]), require_same(*arguments))
    )
    TARGETS[name].check(TARGETS[name].seeds()[0])
    assert len(told) == 2
    assert all(told)


def test_texts_are_good():
    for seed in TARGETS["config"].seeds():
        with as_file(seed.replace(b"database", b"#database"), "rov.toml") as path:
            if b"dbc" not in seed:
                assert load(path).thruster
    assert all(Request.parse(seed) for seed in TARGETS["request"].seeds())
    assert all(Answer.parse(seed) for seed in TARGETS["answer"].seeds())


def test_replayed_logs_have_readings_of_the_configuration():
    every = TARGETS["replay"].seeds()
    of_vehicles = [seed for seed in every[1:] if seed[0] and len(seed) <= HEAD_BYTES]  # no recordings of elsewhere
    for seed in [every[0], *of_vehicles]:
        with as_file(seed[1:], replays.NAMES[seed[0] % len(replays.NAMES)]) as path:
            config = replays.configs()[seed[0] // len(replays.NAMES)]
            out = str(path.parent / "out")
            result = CliRunner().invoke(main, ["replay", str(config), str(path), "--out", out])
        assert " of the dive, from " in result.output

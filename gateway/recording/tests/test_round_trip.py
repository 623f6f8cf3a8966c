"""What is recorded comes back to the last bit, by our reader and by those of others."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from gateway.config_sections import Recording
from gateway.recording.entries import Frames
from gateway.recording.reading import is_recording, read_about
from gateway.recording.scribe import Scribe
from gateway.recording.tests.dive import EVENTS, FINDINGS, START_S, about, dive, judgements, read, same
from gateway.recording.times import nanoseconds, seconds


@pytest.fixture
def file(tmp_path: Path) -> Path:
    scribe = Scribe(Recording(folder=tmp_path, keep_free_mb=0.0), about(), lambda: START_S)
    scribe.write(dive().items)
    scribe.close()
    return scribe.path


def messages(file: Path, topic: str) -> list:
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(message, values) for _, _, message, values in reader.iter_decoded_messages(topics=[topic])]


def test_all_comes_back(file: Path):
    entries, damage = read(file)
    wanted = dive().entries
    assert len(entries) == len(wanted)
    assert all(same(one, other) for one, other in zip(entries, wanted, strict=True))
    assert not damage.lost
    assert damage.records == 91 + sum(not isinstance(one, Frames) for one in wanted)


def test_what_it_says_of_itself(file: Path):
    assert read_about(file) == about(path=file)
    assert is_recording(file.read_bytes()[:256])


def test_every_chunk_goes_on_where_the_one_before_ended(tmp_path: Path):
    scribe = Scribe(Recording(folder=tmp_path, keep_free_mb=0.0), about(), lambda: START_S)
    recorded = dive(seconds=4)
    for begin in range(0, len(recorded.items), 3):
        scribe.write(recorded.items[begin : begin + 3])
    scribe.close()
    entries, damage = read(scribe.path)
    places = [place for one in entries if isinstance(one, Frames) for place in one.place.tolist()]
    assert places == sorted(places)
    assert len(entries) >= len(recorded.entries)
    assert damage.records >= recorded.place


def test_the_mcap_package_reads_it_all(file: Path):
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        count = sum(1 for _ in reader.iter_messages())
        attached = {one.name: one.data for one in reader.iter_attachments()}
        said = list(reader.iter_metadata())
    assert count == summary.statistics.message_count
    assert summary.statistics.channel_count == len(summary.channels) == len(summary.statistics.channel_message_counts)
    assert attached["files/thruster.dbc"] == b"\x00VERSION"
    assert [one.metadata["run"] for one in said] == ["5f3c"]


def test_ros_tools_decode_frames(file: Path):
    """can_msgs/msg/Frame: with times, in the order of them."""
    found = messages(file, "/can/can0")
    (wanted, *_) = (one for one in dive().entries if isinstance(one, Frames))
    assert [values.header.frame_id for _, values in found] == ["can0"] * len(found)
    assert {message.sequence: bytes(values.data[: values.dlc]) for message, values in found[:40]} == {
        place: frame.data for place, frame in zip(wanted.place.tolist(), wanted.frames.frames(), strict=True)
    }
    assert [values.id for _, values in found[:40]] == wanted.frames.identifier.tolist()
    assert [m.log_time for m, _ in found] == [v.header.stamp.sec * 10**9 + v.header.stamp.nanosec for _, v in found]


def test_ros_tools_decode_long_frames(file: Path):
    (_, wanted, *_) = (one for one in dive().entries if isinstance(one, Frames))
    found = messages(file, "/can/can1/fd")
    assert [bytes(v.data[: v.len]) for _, v in found] == [one.data for one in wanted.frames.frames() if one.fd]


def test_ros_tools_decode_readings(file: Path):
    (first, second) = [values for _, values in messages(file, "/thruster/1/report")]
    assert (first.speed_rpm, first.voltage_v, first.error_count) == (1200.5, 15.9, 3.0)
    assert np.isnan([first.current_a, second.speed_rpm, second.error_count]).all()
    ((_, inertial),) = messages(file, "/vehicle/inertial")
    assert (list(inertial.specific_force_mps2), inertial.source) == ([0.1, 0.2, -9.8], "RAW_IMU")
    ((_, node),) = messages(file, "/bus/can0/node_health")
    assert (node.node_id, list(node.thrusters)) == (3, [1, 2])
    assert len(messages(file, "/vehicle/water_pressure/2")) == 1


def test_ros_tools_decode_verdicts(file: Path):
    thruster, speed, navigation = judgements(START_S)
    ((_, row),) = messages(file, "/thruster/2/verdict")
    assert (row.predicted_rpm, row.residual_rpm, row.command) == (1230.5, -30.0, thruster.sample.command)
    assert (row.level, row.reason, row.refitted) == (2, "speed is off", True)
    ((_, row),) = messages(file, "/vehicle/speed")
    assert (row.speed_mps, list(row.flow_mps)) == (speed.verdict.speed_mps, [0.1, -0.2, 0.0])
    ((_, row),) = messages(file, "/navigation")
    assert (row.ratio, row.dvl_level, row.dvl_isolated, row.depth_level) == (0.5, 2, True, 0)
    assert list(row.velocity_mps) == list(navigation.verdict.state.velocity_mps)


def test_viewers_have_a_log(file: Path):
    lines = [(values.level, values.name, values.msg) for _, values in messages(file, "/log")]
    wanted = [(50, FINDINGS[0].subject, FINDINGS[0].text), (30, FINDINGS[1].subject, FINDINGS[1].text)]
    assert sorted(lines) == sorted([*wanted, (50, "statustext", FINDINGS[0].text)])


def test_ros_tools_decode_events(file: Path):
    ((message, values),) = messages(file, "/events/gateway/Lateness")
    assert (values.before, values.behind_s, values.lost) == (7, EVENTS[3][1].behind_s, 2)
    assert message.log_time == int(nanoseconds(EVENTS[3][1].time_s))


@pytest.mark.parametrize("begin_s", [START_S, 1e9, 4e9, 2.0**31, 1e7])
def test_times_come_back_to_the_last_bit(begin_s: float):
    time_s = begin_s + np.random.default_rng(1).uniform(0.0, 1000.0, 10_000)
    assert (seconds(nanoseconds(time_s)) == time_s).all()


@pytest.mark.parametrize("time_s", [-1.0, -1e300, 1e300])
def test_times_that_cannot_be_do_no_harm(time_s: float):
    assert 0 <= int(nanoseconds(time_s)) < 2**63

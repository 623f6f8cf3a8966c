"""MAVLink logs: the real one against pymavlink's reader, and whatever can happen to one."""

from __future__ import annotations

import io
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.command import CommandScale
from drivers.logs.damage import DamageReport
from drivers.logs.tlog import read_tlog
from drivers.logs.tlog_records import RecordWalk
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.mavlink.tests.peer import EscStatusMessage, Peer
from drivers.readings import Attitude, AutopilotHeartbeat, ThrusterCommand

RECORDING = Path(__file__).parents[4] / "shared/data/ardusub_logs/small.tlog"
PWM = CommandScale(1100.0, 1500.0, 1900.0)
START_US = 1_700_000_000_000_000
PERIOD_US = 20_000


def decoder():
    return MavlinkDecoder([MavlinkThruster(1, servo_channel=1, command_scale=PWM)], autopilot_system=1)


def record(stamp_us, packet):
    return stamp_us.to_bytes(8, "big") + packet


def log(count=20, start_us=START_US, **options):
    """Records, with ATTITUDE at all odd places."""
    peer = Peer(**options)
    return [
        record(start_us + PERIOD_US * i, peer.attitude(1000 + 20 * i, roll=i / 100) if i % 2 else peer.heartbeat())
        for i in range(count)
    ]


def read(tmp_path, data, decode=None):
    path = tmp_path / "dive.tlog"
    path.write_bytes(data)
    damage = DamageReport()
    readings = [one for some in read_tlog(path, decode or decoder(), damage) for one in some]
    return readings, damage


def walked(data, cuts=(), wanted=(0, 30)):
    """Times of the packets found, and the damage; the log is given in parts."""
    found, damage = [], DamageReport()
    walk = RecordWalk(lambda packet, time_s: found.append((time_s, packet)) or (), wanted, Counter(), damage)
    begin, rest, position = 0, b"", 0
    for end in [*sorted(cuts), len(data)]:
        buffer = rest + data[position:end]
        done = walk.read(buffer, begin, [], last=end == len(data))
        rest, begin, position = buffer[done:], begin + done, end
        assert len(rest) < 1000
    assert not rest
    return found, damage


# What is in it ------------------------------------------------------------------------------------


def test_records_have_their_own_times(tmp_path):
    readings, damage = read(tmp_path, b"".join(log()))
    assert [reading.time_s for reading in readings] == [(START_US + PERIOD_US * i) / 1e6 for i in range(20)]
    assert [type(reading) for reading in readings] == [AutopilotHeartbeat, Attitude] * 10
    assert (damage.records, damage.lines()) == (20, [])


@given(st.lists(st.integers(0, 1200), max_size=12))
def test_parts_may_end_anywhere(cuts):
    data = b"".join(log())
    found, damage = walked(data, [min(cut, len(data)) for cut in cuts])
    assert len(found) == 20
    assert damage.lines() == []


@pytest.mark.parametrize("mavlink1", [False, True])
@pytest.mark.parametrize("key", [None, bytes(32)])
def test_both_versions_and_signed_ones(mavlink1, key):
    peer = Peer(system=3, component=7, key=key)
    data = b"".join(record(START_US + i, peer.attitude(i, mavlink1=mavlink1)) for i in range(5))
    found, damage = walked(data)
    assert [(packet.system_id, packet.component_id, packet.sequence) for _, packet in found] == [
        (3, 7, i) for i in range(5)
    ]
    assert damage.lines() == []


def test_messages_above_65535_and_what_was_lost_on_the_air():
    drops, found = Counter(), []
    walk = RecordWalk(lambda packet, time_s: found.append(packet) or (), [11030], drops, DamageReport())
    peer = Peer()
    packets = [peer.attitude(), peer.esc_telemetry(), peer.attitude(), peer.esc_telemetry()]
    data = b"".join(record(START_US + i, packet) for i, packet in enumerate(packets) if i != 2)
    walk.read(data, 0, [], last=True)
    assert [packet.message_id for packet in found] == [11030, 11030]
    assert drops == {"lost in transit": 1}


@pytest.mark.skipif(not RECORDING.exists(), reason="shared/data is not beside the project")
def test_a_real_log_reads_as_pymavlink_reads_it():
    decode, damage = MavlinkDecoder([MavlinkThruster(1, servo_channel=1, command_scale=PWM)]), DamageReport()
    readings = [one for some in read_tlog(RECORDING, decode, damage) for one in some]
    theirs = _by_pymavlink(RECORDING.read_bytes())
    assert damage.records == sum(theirs.values()) - theirs["BAD_DATA"]
    assert damage.lost == {"checksum": theirs["BAD_DATA"]}
    kinds = Counter(type(reading) for reading in readings)
    # an attitude or an output that came twice, or before the first heartbeat, is no reading
    assert 0 <= theirs["ATTITUDE"] - kinds[Attitude] < 20
    assert 0 <= theirs["SERVO_OUTPUT_RAW"] - kinds[ThrusterCommand] < 10
    assert all(one.time_s <= other.time_s for one, other in pairwise(readings))


def _by_pymavlink(data):
    parser, counts, file = dialect.MAVLink(None), Counter(), io.BytesIO(data)
    parser.robust_parsing = True
    while file.read(8):
        message = None
        while message is None:
            message = parser.parse_char(file.read(parser.bytes_needed()))
        counts[message.get_type()] += 1
    return counts


# What it is not -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "seen"),
    [
        (b"".join(one[8:] for one in log()), "a MAVLink stream without times"),
        (b"a line of something else\n" * 40, "text"),
        (b"\xa3\x95\x80\x80" + bytes(range(256)), r"dataflash log \(.BIN\)"),
        (b"ULog\x01\x12\x35" + bytes(range(256)), r"PX4 log \(.ulg\)"),
        (b"hello", "text"),
    ],
)
def test_other_files_are_refused_and_told_what_they_are(tmp_path, content, seen):
    with pytest.raises(ValueError, match=f"want a MAVLink log .*{seen}"):
        read(tmp_path, content)


@pytest.mark.parametrize("content", [b"", bytes(5000)])
def test_a_log_without_anything_is_no_mistake(tmp_path, content):
    readings, damage = read(tmp_path, content)
    assert readings == []
    assert damage.lost == ({"bytes outside records": len(content)} if content else {})


def test_a_log_of_one_record_and_one_of_a_part_of_it(tmp_path):
    (only,) = log(1)
    assert len(read(tmp_path, only)[0]) == 1
    readings, damage = read(tmp_path, only[:-3])
    assert readings == []
    assert damage.lost == {"last record cut off": 1}


def test_a_file_that_is_not_there():
    with pytest.raises(OSError, match="nothing"):
        read_tlog(Path("nothing.tlog"), decoder(), DamageReport())


# Damage -------------------------------------------------------------------------------------------


def test_a_log_that_ends_within_a_record():
    records = log()
    for cut in range(1, len(records[-1])):
        found, damage = walked(b"".join(records)[:-cut])
        assert len(found) == 19
        assert damage.lines() == [f"last record cut off: 1 (offset {sum(map(len, records[:-1]))})"]


@given(st.binary(min_size=1, max_size=400), st.integers(1, 18))
def test_garbage_between_records_costs_none_of_them(garbage, place):
    records = log()
    found, damage = walked(b"".join([*records[:place], garbage, *records[place:]]))
    assert [time_s for time_s, _ in found] == [(START_US + PERIOD_US * i) / 1e6 for i in range(20)]
    assert damage.lost


@given(st.integers(0, 18), st.data())
def test_a_record_that_lost_its_middle_costs_itself(place, data):
    records = log()
    begin = data.draw(st.integers(0, len(records[place]) - 1))
    end = data.draw(st.integers(begin + 1, len(records[place])))
    records[place] = records[place][:begin] + records[place][end:]
    found, _ = walked(b"".join(records))
    times = [time_s for time_s, _ in found]
    assert {(START_US + PERIOD_US * i) / 1e6 for i in range(20) if i != place} <= set(times)
    assert len(times) <= 20


@given(st.integers(0, 1199), st.integers(1, 255))
def test_a_flipped_byte_costs_one_record_at_most(place, flip):
    records = log()
    data = bytearray(b"".join(records))
    data[place % len(data)] ^= flip
    found, damage = walked(bytes(data))
    assert len(found) >= 19
    assert len(found) == damage.records
    assert len(found) == 20 or damage.lost


def test_a_length_that_reaches_to_a_later_record_swallows_none_of_them():
    records = log()
    victim = bytearray(records[4])
    victim[9] += len(records[5]) + len(records[6])
    records[4] = bytes(victim)
    found, damage = walked(b"".join(records))
    assert len(found) == 19
    assert damage.lost == {"bytes outside records": len(victim)}


def test_wrong_checksums_and_unknown_messages_are_counted_one_by_one():
    records = log()
    for place in (3, 4, 9):
        records[place] = records[place][:-1] + bytes((records[place][-1] ^ 1,))
    peer = Peer()
    foreign = EscStatusMessage(0, 1, (1,) * 4, (1.0,) * 4, (2.0,) * 4)
    foreign._header.msgId = foreign.id = 65_000
    records[12:12] = [record(START_US + PERIOD_US * 12 - i, peer.pack(foreign)) for i in (2, 1)]
    found, damage = walked(b"".join(records))
    assert len(found) == damage.records == 17
    assert damage.lost == {"checksum": 3, "unknown message": 2}


# Times --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [0, 1, START_US + 10**9, START_US + 10**13, 2**63])
def test_a_wrong_time_is_that_of_the_record_before(wrong):
    records = log()
    records[6] = record(wrong, records[6][8:])
    found, damage = walked(b"".join(records))
    expected = [(START_US + PERIOD_US * (5 if i == 6 else i)) / 1e6 for i in range(20)]
    assert [time_s for time_s, _ in found] == expected
    assert list(damage.lost) == ["record with a wrong time"]


@pytest.mark.parametrize("by_s", [-86_400, -5, 7200, 40 * 365 * 86_400])
def test_a_clock_that_was_set_is_believed_and_told(by_s):
    before, after = log(10), log(10, start_us=START_US + 10 * PERIOD_US + by_s * 10**6)
    found, damage = walked(b"".join(before + after))
    assert len(found) == 20
    assert found[10][0] == pytest.approx(found[9][0] + by_s, abs=0.03)
    offset = sum(map(len, before))
    assert damage.lines() == [f"time jumps: 1 (offset {offset} by {by_s:+d} s)"]


def test_pauses_and_threads_that_overtake_each_other_are_as_usual():
    offsets_us = [0, 20_000, 19_000, 40_000, 3_000_000_000, 3_000_001_000]
    peer = Peer()
    data = b"".join(record(START_US + offset_us, peer.heartbeat()) for offset_us in offsets_us)
    found, damage = walked(data)
    assert [time_s for time_s, _ in found] == [(START_US + offset_us) / 1e6 for offset_us in offsets_us]
    assert damage.lines() == []


def test_a_machine_that_believes_it_is_1970(tmp_path):
    readings, damage = read(tmp_path, b"".join(log(start_us=30_000_000)))
    assert len(readings) == 20
    assert damage.lines() == []


def test_logs_longer_than_what_is_read_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr("drivers.logs.tlog.CHUNK_BYTES", 1000)
    records = log(400)
    records[200:200] = [b"garbage" * 50]
    readings, damage = read(tmp_path, b"".join(records))
    assert len(readings) == damage.records == 400
    assert damage.lost == {"bytes outside records": 350}


# Anything -----------------------------------------------------------------------------------------


@given(st.data())
def test_mutated_logs_never_raise_and_read_the_same_in_any_parts(data):
    stream = bytearray(b"".join(log(12)))
    for _ in range(data.draw(st.integers(1, 12))):
        start = data.draw(st.integers(0, len(stream)))
        stream[start : start + data.draw(st.integers(0, 30))] = data.draw(st.binary(max_size=30))
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=6))
    whole, damage = walked(bytes(stream))
    assert len(whole) == damage.records
    in_parts, _ = walked(bytes(stream), cuts)
    assert in_parts == whole


@given(st.binary(max_size=2000))
def test_any_bytes(data):
    found, damage = walked(data)
    assert len(found) <= damage.records

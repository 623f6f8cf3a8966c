"""candump's logs: every form that it writes, the fast way beside the strict one, and whatever happens to a file."""

from __future__ import annotations

import gzip
import tracemalloc
from collections import defaultdict
from pathlib import Path

import can
import numpy as np
import pytest
from can.io import CanutilsLogWriter
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.logs import candump_columns, text_log
from drivers.logs.candump import is_candump, read_candump
from drivers.logs.candump_line import read_line
from drivers.logs.damage import DamagedRecordError, DamageReport

TIME_S = 1_600_000_000.123456
STAMP = "(1600000000.123456)"
BYTES_8 = bytes(range(0x11, 0x99, 0x11))

Read = dict[str, list[CanFrame]]


@pytest.fixture
def log(tmp_path):
    return tmp_path / "candump.log"


def read(path: Path) -> tuple[Read, DamageReport]:
    damage = DamageReport()
    frames = defaultdict(list)
    for interface, block in read_candump(path, damage):
        frames[interface] += block.frames()
    assert damage.records == sum(map(len, frames.values()))
    return dict(frames), damage


def written(log: Path, *lines: str, end: str = "\n") -> tuple[Read, DamageReport]:
    log.write_bytes("".join(line + end for line in lines).encode("latin-1"))
    return read(log)


@pytest.mark.parametrize(
    ("text", "frame"),
    [
        ("can0 123#", CanFrame(TIME_S, 0x123, b"", extended=False)),
        ("can0 123#1122334455667788", CanFrame(TIME_S, 0x123, BYTES_8, extended=False)),
        ("   can0 123#aBcD", CanFrame(TIME_S, 0x123, b"\xab\xcd", extended=False)),
        ("can0 00000123#00", CanFrame(TIME_S, 0x123, b"\0")),
        ("can0 1FFFFFFF#00 R", CanFrame(TIME_S, 0x1FFFFFFF, b"\0")),
        ("can0 123#00 T", CanFrame(TIME_S, 0x123, b"\0", extended=False)),
        ("can0 123##0", CanFrame(TIME_S, 0x123, b"", extended=False, fd=True)),
        ("can0 123##51122", CanFrame(TIME_S, 0x123, b"\x11\x22", extended=False, fd=True)),
        ("can0 00000123##1" + "5A" * 64, CanFrame(TIME_S, 0x123, b"\x5a" * 64, fd=True)),
        ("can0 123#1122334455667788_E", CanFrame(TIME_S, 0x123, BYTES_8, extended=False)),
        (
            "can0 20000004#0004000000000000",
            CanFrame(TIME_S, 4, b"\0\4" + bytes(6), extended=False, error=True),
        ),
        (" can0  123   [0]", CanFrame(TIME_S, 0x123, b"", extended=False)),
        (" can0       123   [8]  11 22 33 44 55 66 77 88", CanFrame(TIME_S, 0x123, BYTES_8, extended=False)),
        (" can0  123   [8]  11 22 33 44 55 66 77 88   '.\"3DUfw.'", CanFrame(TIME_S, 0x123, BYTES_8, extended=False)),
        (" can0  12345678   [2]  28 27                     '('' ", CanFrame(TIME_S, 0x12345678, b"('")),
        (" can0  RX - -  123   [1]  11", CanFrame(TIME_S, 0x123, b"\x11", extended=False)),
        (" can0  TX B E  12345678  [02]  11 22", CanFrame(TIME_S, 0x12345678, b"\x11\x22", fd=True)),
        (
            " can0  123  [12]  11" + " 22" * 11,
            CanFrame(TIME_S, 0x123, b"\x11" + b"\x22" * 11, extended=False, fd=True),
        ),
        (" can0  123   {B}  11 22 33 44 55 66 77 88", CanFrame(TIME_S, 0x123, BYTES_8, extended=False)),
        (
            " can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME",
            CanFrame(TIME_S, 4, b"\0\4" + bytes(6), extended=False, error=True),
        ),
        ("\x1b[1m\x1b[31m can0\x1b[0m  123   [1]  11", CanFrame(TIME_S, 0x123, b"\x11", extended=False)),
    ],
)
def test_reads_every_form(log, text, frame):
    frames, damage = written(log, f"{STAMP} {text}")
    assert frames == {"can0": [frame]}
    assert damage.lost == {}


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        ("1600000000.123456 can0 123#00", "no time"),
        ("can0  123   [1]  11", "no time"),
        ("(16000x0000.123456) can0 123#00", "no time"),
        ("(1600000000) can0 123#00", "no time"),
        ("(2020-02-30 00:00:00.000000) can0 123#00", "no time"),
        (f"{STAMP} can0", "no frame"),
        (f"{STAMP} can0 12300", "no '#'"),
        (f"{STAMP} can0 123#001", "odd number of digits"),
        (f"{STAMP} can0 123#0G", "not a hexadecimal digit"),
        (f"{STAMP} can0 1G3#00", "not a hexadecimal digit"),
        (f"{STAMP} can0 123##G00", "not a hexadecimal digit"),
        (f"{STAMP} can0 123##", "no flags of CAN FD"),
        (f"{STAMP} can0 123#112233445566778899", "data too long"),
        (f"{STAMP} can0 123##1" + "00" * 65, "data too long"),
        (f"{STAMP} can0 0123#00", "identifier not of 3 or 8 digits"),
        (f"{STAMP} can0 800#00", "identifier out of range"),
        (f"{STAMP} can0 80000123#00", "identifier out of range"),
        (f"{STAMP} can0 123#00 00", "text behind the frame"),
        (f"{STAMP} interface0123456 123#00", "name of the interface too long"),
        (f"{STAMP} can0 123#R", "remote frame"),
        (f"{STAMP} can0 123#R8_9", "remote frame"),
        (f"{STAMP}  can0  123   [0]  remote request", "remote frame"),
        (f"{STAMP} can0 45123#81:00:12345678#11223344", "CAN XL frame"),
        (f"{STAMP}  can0  123   [2]  11", "data of another length than stated"),
        (f"{STAMP}  can0  123   [9]  11", "length of the data not understood"),
        (f"{STAMP}  can0  123   [1]  1122", "data not in bytes of two digits"),
        (f"{STAMP}  can0  123   [2]  11 22   '.'", "characters are not those of the data"),
        (f"{STAMP} can\xe90 123#00", "bytes that are no text"),
        ("DROPCOUNT: dropped 7 CAN frames on 'can0' socket (total drops 7)", "dropped before they were logged"),
    ],
)
def test_names_the_cause_and_the_line_and_reads_on(log, line, cause):
    sound = f"{STAMP} can0 123#00"
    frames, damage = written(log, sound, line, "", sound)
    assert len(frames["can0"]) == 2
    assert damage.lost == {cause: 7 if "DROPCOUNT" in line else 1}
    assert damage.places == {cause: ["line 2"]}


def test_what_explains_an_error_frame_is_no_damage(log):
    frames, damage = written(log, f"{STAMP}  can0  20000004   [1]  00   ERRORFRAME", "\tcontroller-problem{}")
    assert len(frames["can0"]) == 1
    assert damage.lost == {}


def test_interfaces_are_told_apart_and_keep_their_order(log):
    lines = [
        f"(1600000000.{number:06}) {'can0' if number % 3 else 'vcan10'} 123#{number % 256:02X}"
        for number in range(99)
    ]
    frames, _ = written(log, *lines)
    assert {name: len(some) for name, some in frames.items()} == {"can0": 66, "vcan10": 33}
    for some in frames.values():
        assert [frame.time_s for frame in some] == sorted(frame.time_s for frame in some)
        assert [frame.data[0] for frame in some] == [round(frame.time_s % 1 * 1e6) for frame in some]


def test_times_are_those_of_the_text_to_the_last_bit(log):
    ticks = np.random.default_rng(1).integers(0, 9_999_999_999_999_999, 500)
    texts = [f"{tick // 1_000_000}.{tick % 1_000_000:06}" for tick in ticks.tolist()]
    frames, _ = written(log, *(f"({text}) can0 123#00" for text in texts), "(1600000000.123456789) can0 123#00")
    assert [frame.time_s for frame in frames["can0"]] == [*map(float, texts), 1_600_000_000.123456789]


@pytest.mark.parametrize(
    ("stamps", "times_s"),
    [
        (["2020-09-13 12:26:40.123456", "2020-09-13 12:26:41.000000"], [TIME_S, 1_600_000_001.0]),  # -tA, UTC
        (["000.000000", "000.100000", "001.100000", "001.100001"], [0.0, 0.1, 1.1, 1.100001]),  # -tz
        (["000.000000", "000.100000", "000.050000", "001.000000"], [0.0, 0.1, 0.15, 1.15]),  # -td
    ],
)
def test_times_of_the_console(log, stamps, times_s):
    frames, _ = written(log, *(f" ({stamp})  can0  123   [0] " for stamp in stamps))
    assert [frame.time_s for frame in frames["can0"]] == times_s


def test_differences_go_on_from_chunk_to_chunk(log, monkeypatch):
    monkeypatch.setattr(text_log, "CHUNK_BYTES", 1000)
    steps = [0, *(10 + number % 7 for number in range(99))]
    frames, _ = written(log, *(f" (000.{step:06})  can{number % 2}  123   [0] " for number, step in enumerate(steps)))
    times = sorted(frame.time_s for some in frames.values() for frame in some)
    assert times == (np.cumsum(steps) / 1e6).tolist()


def test_reads_what_python_can_writes(log):
    rng = np.random.default_rng(2)
    messages = [
        can.Message(
            timestamp=round(1.6e9 + 0.01 * number, 6),
            arbitration_id=int(rng.integers(0, 1 << (29 if number % 3 else 11))),
            is_extended_id=bool(number % 3),
            is_fd=number % 5 == 0,
            bitrate_switch=number % 10 == 0,
            is_rx=number % 4 > 0,
            data=rng.bytes(int(rng.integers(0, 65 if number % 5 == 0 else 9))),
            channel=f"can{number % 2}",
        )
        for number in range(400)
    ]
    with CanutilsLogWriter(log) as writer:
        for message in messages:
            writer(message)
    frames, damage = read(log)
    for name, some in frames.items():
        assert some == [
            CanFrame(m.timestamp, m.arbitration_id, bytes(m.data), extended=m.is_extended_id, fd=m.is_fd)
            for m in messages
            if m.channel == name
        ]
    assert damage.records == len(messages)


def test_line_ends_of_windows_byte_order_mark_and_gzip(log):
    lines = [f"(1600000000.{number:06}) can0 123#00" for number in range(50)]
    text = b"\xef\xbb\xbf" + "\r\n".join([*lines, ""]).encode()
    for data in (text, gzip.compress(text)):
        log.write_bytes(data)
        frames, damage = read(log)
        assert len(frames["can0"]) == 50
        assert damage.lost == {}


def test_gzip_cut_off_is_read_as_far_as_it_goes(log):
    whole = "".join(f"(1600000000.{number:06}) can0 123#{number * 7919 % 65536:04X}\n" for number in range(5000))
    packed = gzip.compress(whole.encode())
    log.write_bytes(packed[: len(packed) // 2])
    frames, damage = read(log)
    assert 1000 < len(frames["can0"]) < 5000
    assert damage.lost["compressed data damaged from here on"] == 1


def test_gzip_with_a_flipped_bit_is_told(log):
    packed = bytearray(gzip.compress("".join(f"{STAMP} can0 {number:03X}#00\n" for number in range(2000)).encode()))
    packed[-6] ^= 1  # of the checksum
    log.write_bytes(packed)
    frames, damage = read(log)
    assert len(frames["can0"]) == 2000
    assert damage.lost["compressed data damaged from here on"] == 1


def test_a_last_line_without_end_is_not_read(log):
    log.write_text(f"{STAMP} can0 123#1122\n{STAMP} can0 123#11")
    frames, damage = read(log)
    assert len(frames["can0"]) == 1
    assert damage.places == {"last line cut off": ["line 2"]}


def test_zeros_of_a_power_loss_cost_no_line_that_is_whole(log):
    line = f"{STAMP} can0 123#1122\n"
    log.write_bytes(line.encode() + line[:20].encode() + bytes(3_000_000) + (2 * line).encode() + bytes(500))
    frames, damage = read(log)
    assert len(frames["can0"]) == 3
    assert damage.lost == {"zero bytes": 2}
    assert damage.places["zero bytes"] == ["line 2", "line 4"]


def test_a_line_that_begins_within_another_is_read(log):
    frames, damage = written(log, f"{STAMP} can0 123#11{STAMP} can1 123#22", f"{STAMP} can0 123#(000.5) can1 123#33")
    assert frames == {"can1": [CanFrame(TIME_S, 0x123, b"\x22", extended=False)]}
    assert damage.lost.total() == 2


def test_endless_line_takes_bounded_memory(log):
    log.write_bytes(f"{STAMP} can0 123#11\n".encode() + b"x" * 30_000_000 + f"\n{STAMP} can0 123#11\n".encode())
    tracemalloc.start()
    try:
        frames, damage = read(log)
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(frames["can0"]) == 2
    assert damage.lost == {"no time": 1}
    assert peak_bytes < 8_000_000


def test_empty_log_has_no_frames(log):
    for data in (b"", b"\n\n", bytes(10_000)):
        log.write_bytes(data)
        assert read(log)[0] == {}


@pytest.mark.parametrize(
    ("data", "looks"),
    [
        (b"LOGG\x90", "Vector BLF"),
        (b"\xff\xfe(\0", "UTF-16"),
        (b"Hello (world)\n", "text"),
        (b"\x89PNG\r\n", "89 50"),
    ],
)
def test_says_what_another_file_looks_like(log, data, looks):
    log.write_bytes(data)
    with pytest.raises(ValueError, match=f"no candump log.*{looks}"):
        read_candump(log, DamageReport())


def test_no_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_candump(tmp_path / "none.log", DamageReport())


digits = "0123456789ABCDEFabcdef"
regular_lines = st.builds(
    "({}.{:06}) {} {}{}{}".format,
    st.sampled_from([0, 9, 1_600_000_000, 9_007_199_255]),
    st.integers(0, 999_999),
    st.sampled_from(["can0", "can1", " can2", "vcan0"]),
    st.sampled_from(["123", "7FF", "800", "00000123", "1FFFFFFF", "20000004", "3FFFFFFF", "40000000"]),
    st.sampled_from(["#", "##0", "##F"]),
    st.sampled_from(
        ["", "00", "0A1B", "1122334455667788", "112233445566778899", "1", " R", "00 T", "00\r", "R", "R4"]
    ),
)


@st.composite
def mutated(draw):
    line = bytearray(draw(regular_lines), "ascii")
    for _ in range(draw(st.integers(0, 2))):
        line[draw(st.integers(0, len(line) - 1))] = draw(st.sampled_from(b"()# .:/@G`g~\x7f\x80\0x0"))
    return bytes(line)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.one_of(mutated(), st.binary(max_size=40)), max_size=60))
def test_the_fast_way_reads_each_line_as_the_strict_one(log, monkeypatch, lines):
    """Blocks of any mixture, with shapes sought for however few lines."""
    monkeypatch.setattr(candump_columns, "LINES_MIN", 1)
    lines = [line.replace(b"\n", b"") for line in lines]
    log.write_bytes(f"{STAMP} can9 123#\n".encode() + b"".join(line + b"\n" for line in lines))
    frames, _ = read(log)
    one_by_one = defaultdict(list)
    for line in [f"{STAMP} can9 123#".encode(), *lines]:
        try:
            logged = read_line(line)
        except DamagedRecordError:
            begin = max(line.rfind(b"("), 0)
            within = line[begin:] if begin and line[begin + 11 : begin + 12] == b"." else b""
            try:
                logged = read_line(within)
            except DamagedRecordError:
                continue
        one_by_one[logged.interface].append(logged.frame)
    assert frames == one_by_one


SOUND = [
    f"(1600000000.{number:06}) can{number % 2} {number:03X}#{'5A' * (number % 9)}\n".encode() for number in range(60)
]


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(30, sum(map(len, SOUND)) - 1), st.integers(0, 255)), min_size=1, max_size=5))
def test_bytes_changed_anywhere_cost_no_other_line(log, changes):
    text = bytearray(b"".join(SOUND))
    for place, byte in changes:
        text[place] = byte
    log.write_bytes(text)
    frames, damage = read(log)
    ends = np.cumsum([len(line) for line in SOUND])
    hit = {int(np.searchsorted(ends, place, side="right")) for place, _ in changes}
    whole = {number: frame for some in frames.values() for frame in some for number in [frame.identifier]}
    for number in set(range(60)) - hit:
        assert whole[number].data == b"\x5a" * (number % 9)
    assert damage.records + damage.lost.total() >= 60 - len(hit)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=300))
def test_no_bytes_make_it_raise(log, data):
    log.write_bytes(f"{STAMP} can0 123#\n".encode() + data)
    frames, _ = read(log)
    assert frames["can0"]
    assert is_candump(log.read_bytes())

"""ASC, BLF and TRC logs: what python-can writes and the formats' own examples, whole and damaged."""

from __future__ import annotations

import gzip
import zlib
from collections import defaultdict
from pathlib import Path

import can
import numpy as np
import pytest
from can.io import ASCWriter, BLFWriter, CanutilsLogWriter, TRCWriter
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.logs import blf, text_log
from drivers.logs.asc import read_asc
from drivers.logs.blf import read_blf
from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport
from drivers.logs.trc import read_trc

START_S = 1_600_000_000.0  # Sun Sep 13 12:26:40 2020 UTC
WRITERS = {".asc": ASCWriter, ".blf": BLFWriter, ".log": CanutilsLogWriter, ".trc": TRCWriter}
MUTATING = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(autouse=True)
def utc(monkeypatch):
    """python-can writes dates of the local time, TRCWriter and BLFWriter of UTC: here all are the same."""
    monkeypatch.setenv("TZ", "UTC")


def read(path: Path, reader=open_can_log):
    damage = DamageReport()
    frames = defaultdict(list)
    for interface, block in reader(path, damage):
        frames[interface] += block.frames()
    assert damage.records == sum(map(len, frames.values()))
    return dict(frames), damage


def read_text(tmp_path, *lines: str, suffix: str):
    path = tmp_path / f"log{suffix}"
    path.write_bytes("".join(line + "\r\n" for line in lines).encode("latin-1"))
    return read(path)


def random_messages(count: int, *, fd: bool) -> list[can.Message]:
    rng = np.random.default_rng(3)
    return [
        can.Message(
            timestamp=START_S + 0.001 * number,
            arbitration_id=int(rng.integers(0, 1 << (29 if number % 3 else 11))),
            is_extended_id=bool(number % 3),
            is_fd=fd and number % 5 == 0,
            is_rx=number % 4 > 0,
            data=rng.bytes([0, 8, 12, 48, 64][number // 5 % 5] if fd and number % 5 == 0 else number % 9),
            channel=number % 2,
        )
        for number in range(count)
    ]


def write(path: Path, messages: list[can.Message]) -> None:
    with WRITERS[path.suffix](path) as writer:
        for message in messages:
            writer(message)


def close(frames: list[CanFrame], messages: list[can.Message]) -> bool:
    """Equal but for times, which text formats round to the microsecond or to what they have."""
    return [(f.identifier, f.data, f.extended, f.fd) for f in frames] == [
        (m.arbitration_id, bytes(m.data), m.is_extended_id, m.is_fd) for m in messages
    ] and np.allclose([f.time_s for f in frames], [m.timestamp for m in messages], rtol=0.0, atol=2e-6)


@pytest.mark.parametrize("suffix", WRITERS)
def test_reads_what_python_can_writes(tmp_path, suffix):
    messages = random_messages(400, fd=suffix != ".trc")
    path = tmp_path / f"log{suffix}"
    write(path, messages)
    frames, damage = read(path)
    assert damage.lost == {}
    names = {".log": ["can0", "can1"]}.get(suffix, ["1", "2"])
    assert all(close(frames[name], messages[channel::2]) for channel, name in enumerate(names))


@pytest.mark.parametrize("suffix", [".asc", ".blf"])
def test_error_and_remote_frames(tmp_path, suffix):
    error = can.Message(timestamp=START_S + 1, is_error_frame=True, channel=0)
    remote = can.Message(timestamp=START_S + 2, arbitration_id=5, is_remote_frame=True, channel=0)
    path = tmp_path / f"log{suffix}"
    write(path, [*random_messages(1, fd=False), error, remote])
    frames, damage = read(path)
    assert frames["1"][1:] == [CanFrame(START_S + 1, 0, b"", extended=False, error=True)]
    assert damage.lost == {"remote frame": 1}


@pytest.mark.parametrize("suffix", WRITERS)
def test_what_is_in_it_decides_not_the_suffix(tmp_path, suffix):
    path = tmp_path / f"log{suffix}"
    write(path, random_messages(3, fd=False))
    other = path.rename(tmp_path / "log.txt")
    assert sum(map(len, read(other)[0].values())) == 3


@pytest.mark.parametrize("suffix", [".log", ".asc", ".trc", ".log.gz"])
def test_an_empty_log_is_what_its_suffix_says(tmp_path, suffix):
    path = tmp_path / f"log{suffix}"
    path.write_bytes(gzip.compress(b"") if suffix.endswith(".gz") else bytes(5))
    assert read(path)[0] == {}


def test_text_logs_may_be_compressed(tmp_path):
    for suffix in (".asc", ".trc"):
        path = tmp_path / f"log{suffix}"
        write(path, random_messages(9, fd=False))
        whole = read(path)[0]
        path.write_bytes(gzip.compress(path.read_bytes()))
        assert read(path)[0] == whole


@pytest.mark.parametrize(
    ("data", "looks"),
    [(b"Hello\n", "text"), (b"", "an empty file"), (b"PK\x03\x04...", "zip"), (b"\x7fELF", "unknown")],
)
def test_says_what_another_file_looks_like(tmp_path, data, looks):
    path = tmp_path / "log"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=f"no CAN log .*{looks}"):
        open_can_log(path, DamageReport())


@pytest.mark.parametrize("reader", [open_can_log, read_asc, read_blf, read_trc])
def test_no_file_is_an_os_error(tmp_path, reader):
    with pytest.raises(FileNotFoundError):
        reader(tmp_path / "none", DamageReport())


@pytest.mark.parametrize("reader", [read_asc, read_blf, read_trc])
def test_each_reader_refuses_another_format(tmp_path, reader):
    path = tmp_path / "log"
    path.write_text("(1600000000.123456) can0 123#00\n")
    with pytest.raises(ValueError, match=r"is no .* log"):
        reader(path, DamageReport())


HEADER = (
    "date Sun Sep 13 12:26:40 2020",
    "base hex  timestamps absolute",
    "no internal events logged",
    "// version 9",
)


def test_asc_of_vector_and_can_utils(tmp_path):
    frames, damage = read_text(
        tmp_path,
        *HEADER,
        "   0.000000 Start of measurement",
        "   0.250000 1  123             Rx   d 8 11 22 33 44 55 66 77 88",
        "   0.500000 2  1234567Fx       Tx   d 1 AB Length = 270000 BitCount = 140 ID = 305419903x",
        "   0.500000 1  123             TxRq d 1 AB",
        "   0.750000 CANFD   1 Rx        123                                   1 0 9 12 11 22 33 44 55 66 77 88 99 AA"
        " BB CC   130000  130     3000 0 0 0 0 0",
        "   0.750000 CANFD   1 Tx        12x  SymbolicName  0 0 1 1 5A",
        "   1.000000 CANFD   2 Rx        123                                   0 0 1  1 11   130000  130    0 0",
        "   1.000000 2  ErrorFrame",
        "   1.000000 1  Statistic: D 334 R 0 XD 0 XR 0 E 0 O 0 B 13.23%",
        "   1.000000 CAN 1 Status:chip status error active",
        "End TriggerBlock",
        suffix=".asc",
    )
    eight, twelve = bytes(range(0x11, 0x99, 0x11)), bytes(range(0x11, 0xDD, 0x11))
    assert damage.lost == {}
    assert frames == {
        "1": [
            CanFrame(START_S + 0.25, 0x123, eight, extended=False),
            CanFrame(START_S + 0.75, 0x123, twelve, extended=False, fd=True),
            CanFrame(START_S + 0.75, 0x12, b"\x5a", fd=True),
        ],
        "2": [
            CanFrame(START_S + 0.5, 0x1234567F, b"\xab"),
            CanFrame(START_S + 1.0, 0x123, b"\x11", extended=False),
            CanFrame(START_S + 1.0, 0, b"", extended=False, error=True),
        ],
    }


@pytest.mark.parametrize(
    ("date", "start_s"),
    [
        ("date Sun Sep 13 12:26:40.500 2020", START_S + 0.5),
        ("date Son Sep 13 12:26:40 pm 2020", START_S),
        ("date Sun Sep 13 02:26:40.000 pm 2020", START_S + 7200.0),
        ("date Mit Okt 14 12:26:40 2020", START_S + 31 * 86400.0),
        ("date Mit M\xe4r 4 12:26:40 2020", START_S - 193 * 86400.0),
        ("date Sun Sep 13 12:26:40.7 2020", START_S + 0.007),
        ("Begin Triggerblock Sun Sep 13 12:26:40.000 2020", START_S),
    ],
)
def test_asc_dates(tmp_path, date, start_s):
    frames, damage = read_text(tmp_path, date, "0.125 1 12 Rx d 0", suffix=".asc")
    assert frames["1"][0].time_s == start_s + 0.125
    assert damage.lost == {}


def test_asc_in_decimal_with_relative_times(tmp_path):
    frames, _ = read_text(
        tmp_path,
        "base dec  timestamps relative",
        "0.5 1 291 Rx d 2 255 7",
        "0.25 1 Statistic: D 3",
        "0.25 1 291 Rx d 0",
        suffix=".asc",
    )
    assert frames["1"] == [CanFrame(0.5, 291, b"\xff\x07", extended=False), CanFrame(1.0, 291, b"", extended=False)]


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        ("1 123 Rx d 1 11", "no time"),
        ("0.5 1 1G3 Rx d 1 11", "not a hexadecimal digit"),
        ("0.5 1 123 Rx d 2 11", "data of another length than stated"),
        ("0.5 1 123 Rx d 1 1", "data not in bytes of two digits"),
        ("0.5 1 923 Rx d 1 11", "identifier out of range"),
        ("0.5 1 123 Rx d G 11", "not a hexadecimal digit"),
        ("0.5 1 123 Rx r 0", "remote frame"),
        ("0.5 CANFD 1 Rx 123 0 0 9 11 11", "data length and its code disagree"),
        ("0.5 CANFD 1 Rx 123 0 0 3 3 11 22", "data of another length than stated"),
        ("0.5 what is this", "no CAN frame"),
        ("0.5 1 123 Rx d 1 1\0", "zero bytes"),
        ("date tomorrow", "date not understood"),
        ("date Sun Feb 30 12:26:40 2020", "date not understood"),
    ],
)
def test_asc_damage_is_named_and_read_past(tmp_path, line, cause):
    frames, damage = read_text(tmp_path, *HEADER, "0.5 1 123 Rx d 0", line, "0.5 1 123 Rx d 0", suffix=".asc")
    assert len(frames["1"]) == 2
    assert damage.lost == {cause: 1}
    assert damage.places[cause] == ["line 6"]


TRC_EXAMPLES = {
    "1.0": (
        ";##########################################################################",
        "     1)      1000      0001  8  00 00 00 00 00 00 00 07",
        "     2)      1842      0008  4  ERROR 00 19 08 08",
        "     3)      1843  FFFFFFFF  4  00 00 00 04 -- -- -- --  BUSLIGHT",
        "     4)      1844      0100  3  RTR",
        "     5)      2000  00000001  0",
    ),
    "1.1": (
        ";$FILEVERSION=1.1",
        ";$STARTTIME=44087.5185185185",
        "     1)      1000.0  Rx         0001  8  00 00 00 00 00 00 00 07",
        "     2)      1842.0  Error      0008  4  00 19 08 08",
        "     3)      1843.0  Warng  FFFFFFFF  4  00 00 00 04  BUSLIGHT",
        "     4)      1844.0  Rx         0100  3  RTR",
        "     5)      2000.0  Tx     00000001  0",
    ),
    "1.2": (
        ";$FILEVERSION=1.2",
        ";$STARTTIME=44087.5185185185;",
        "     1)      1000.000  1  Rx         0001  8  00 00 00 00 00 00 00 07",
        "     2)      1842.000  1  Error      0008  4  00 19 08 08",
        "     3)      1843.000  1  Warng  FFFFFFFF  4  00 00 00 04  BUSLIGHT",
        "     4)      1844.000  1  Rx         0100  3  RTR",
        "     5)      2000.000  1  Tx     00000001  0",
    ),
    "1.3": (
        ";$FILEVERSION=1.3",
        ";$STARTTIME=44087.5185185185",
        "     1)      1000.000 1  Rx        0001 -  8    00 00 00 00 00 00 00 07",
        "     2)      1842.000 1  Error     0008 -  4    00 19 08 08",
        "     3)      1843.000 1  Warng FFFFFFFF -  4    00 00 00 04  BUSLIGHT",
        "     4)      1844.000 1  Rx        0100 -  3    RTR",
        "     5)      2000.000 1  Tx    00000001 -  0",
    ),
    "2.0": (
        ";$FILEVERSION=2.0",
        ";$STARTTIME=44087.5185185185",
        ";$COLUMNS=N,O,T,I,d,l,D",
        "      1      1000.000 DT     0001 Rx 8  00 00 00 00 00 00 00 07",
        "      2      1842.000 ER          Rx    04 00 02 00 00",
        "      3      1843.000 ST          Rx    00 00 00 08",
        "      4      1843.500 EC          Rx    02 02",
        "      5      1844.000 RR     0100 Rx 3",
        "      6      2000.000 DT 00000001 Tx 0",
    ),
    "2.1": (
        ";$FILEVERSION=2.1",
        ";$STARTTIME=44087.5185185185",
        ";$COLUMNS=N,O,T,B,I,d,R,L,D",
        "      1      1000.000 DT 1      0001 Rx -  8    00 00 00 00 00 00 00 07",
        "      2      1842.000 ER 1         - Rx -  5    04 00 02 00 00",
        "      3      1843.000 EV 1  User-defined event for bus 1",
        "      4      1843.500 EV -  User-defined event for all busses",
        "      5      1844.000 RR 1      0100 Rx -  3",
        "      6      2000.000 DT 1  00000001 Tx -  0",
    ),
}


@pytest.mark.parametrize("version", TRC_EXAMPLES)
def test_trc_of_every_version(tmp_path, version):
    frames, damage = read_text(tmp_path, *TRC_EXAMPLES[version], suffix=".trc")
    start_s = 0.0 if version == "1.0" else START_S
    assert [round(frame.time_s - start_s, 3) for frame in frames["1"]] == [1.0, 1.842, 2.0]
    first, error, last = frames["1"]
    assert (first.identifier, first.data, first.extended) == (1, bytes(7) + b"\7", False)
    assert (error.error, error.identifier) == (True, 0)
    assert (last.identifier, last.data, last.extended) == (1, b"", True)
    assert damage.lost == {"remote frame": 1}


def test_trc_of_can_fd(tmp_path):
    octets = " ".join(f"{number:02X}" for number in range(12))
    for columns, size in (("N,O,T,B,I,d,R,L,D", 9), ("N,O,T,B,I,d,R,l,D", 12)):
        header = (";$FILEVERSION=2.1", ";$STARTTIME=0", f";$COLUMNS={columns}")
        frames, _ = read_text(tmp_path, *header, f"5  1334.416 FB 2  0500 Tx -  {size}  {octets}", suffix=".trc")
        assert [(frame.data, frame.fd) for frame in frames["2"]] == [(bytes(range(12)), True)]


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        ("2 x DT 1 0001 Rx - 0", "no time"),
        ("2", "no time"),
        ("2 1.0 XX 1 0001 Rx - 0", "type of the line not known"),
        ("2 1.0 DT 1 0G01 Rx - 0", "not a hexadecimal digit"),
        ("2 1.0 DT 1 0801 Rx - 0", "identifier out of range"),
        ("2 1.0 DT 1 0001 Rx - 9 00", "data of another length than stated"),
        ("2 1.0 FD 1 0001 Rx - 16 00", "length of the data not understood"),
        ("2 1.0 DT 1 0001 Rx - 1 0", "data not in bytes of two digits"),
        ("2 1.0 DT 1 0001 Rx - 1 \xff", "bytes that are no text"),
        (";$STARTTIME=yesterday", "start time not understood"),
        (";$STARTTIME=nan", "start time not understood"),
        (";$COLUMNS=X,Y", "columns not understood"),
    ],
)
def test_trc_damage_is_named_and_read_past(tmp_path, line, cause):
    sound = TRC_EXAMPLES["2.1"]
    frames, damage = read_text(tmp_path, *sound[:4], line, sound[-1], suffix=".trc")
    assert len(frames["1"]) == 2
    assert damage.lost == {cause: 1}
    assert damage.places[cause] == ["line 5"]


@MUTATING
@given(st.data())
@pytest.mark.parametrize("suffix", [".asc", ".trc"])
def test_bytes_changed_anywhere_cost_no_other_line(tmp_path, suffix, data):
    path = tmp_path / f"log{suffix}"
    if not path.exists():
        write(path, random_messages(40, fd=False))
    whole, text = read(path)[0], bytearray(path.read_bytes())
    first = text.index(b"0.000")
    for place, byte in data.draw(
        st.lists(st.tuples(st.integers(first, len(text) - 1), st.integers(0, 255)), max_size=3)
    ):
        text[place] = byte
    changed = tmp_path / "changed"
    changed.write_bytes(text)
    frames, damage = read(changed)
    intact = [frame for some in whole.values() for frame in some]
    kept = [frame for some in frames.values() for frame in some]
    assert sum(frame in kept for frame in intact) >= len(intact) - 6
    assert damage.records + damage.lost.total() >= len(intact) - 3


@pytest.mark.parametrize("filler", [" ", "\t", "\n", "1 ", "(", "x", "0"])
def test_a_disk_filled_with_one_character_takes_no_time(tmp_path, filler):
    """Patterns that try each split of a long run would take minutes."""
    sound = {".asc": "0.500000 1 123 Rx d 0", ".trc": "1) 500 0123 0", ".log": "(1600000000.123456) can0 123#"}
    for suffix, line in sound.items():
        path = tmp_path / f"log{suffix}"
        for text in (f"{line}\n0.5 1 {60_000 * filler}x\n", f"{60_000 * filler}x\n{line}\n"):
            path.write_text(text)
            try:
                read(path)
            except ValueError as error:
                assert "no CAN log" in str(error)


def blf_log(path: Path, count: int = 3000, **options) -> bytes:
    with BLFWriter(path, **options) as writer:
        for message in random_messages(count, fd=True):
            writer(message)
    return path.read_bytes()


def containers(data: bytes) -> list[int]:
    return [place for place in range(len(data)) if data.startswith(b"LOBJ", place)]


def test_blf_in_small_pieces_and_small_containers(tmp_path, monkeypatch):
    path = tmp_path / "log.blf"
    blf_log(path, max_container_size=1000)
    whole = read(path)[0]
    monkeypatch.setattr(blf, "_PIECE_BYTES", 97)
    monkeypatch.setattr(blf, "BLOCK_OBJECTS", 11)
    assert read(path) == (whole, DamageReport(records=3000))


def test_blf_with_a_damaged_container_is_read_past_it(tmp_path):
    path = tmp_path / "log.blf"
    data = bytearray(blf_log(path, max_container_size=5000))
    whole = [frame for some in read(path)[0].values() for frame in some]
    hit = containers(data)[10]
    data[hit + 500] ^= 0x10
    path.write_bytes(data)
    frames, damage = read(path)
    kept = sum(map(len, frames.values()))
    assert len(whole) - 130 < kept < len(whole)
    assert damage.places["container damaged"] == [f"offset {hit}"]
    assert all(frame in whole for some in frames.values() for frame in some[::20])


def test_blf_cut_off_is_read_to_its_end(tmp_path):
    path = tmp_path / "log.blf"
    data = blf_log(path)
    path.write_bytes(data[: len(data) * 2 // 3])
    frames, damage = read(path)
    assert 1500 < sum(map(len, frames.values())) < 3000
    assert damage.lost == {"last object cut off": 1}


@pytest.mark.parametrize("bit", [0x01, 0x80])  # of the size: within the container, and beyond all that follows
def test_blf_without_compression_is_found_again_object_by_object(tmp_path, bit):
    path = tmp_path / "log.blf"
    data = bytearray(blf_log(path, 1000, compression_level=0))
    places = containers(data)
    data[places[500] + 9] ^= bit
    data[places[700]] = 0  # of the signature
    path.write_bytes(data)
    frames, damage = read(path)
    assert sum(map(len, frames.values())) == 998
    assert damage.lost["header of an object damaged"] == 1
    assert damage.lost["bytes that are no object"] >= 1


@MUTATING
@given(st.data())
@pytest.mark.parametrize("level", [0, 6])
def test_bytes_changed_anywhere_never_stop_blf(tmp_path, level, data):
    path = tmp_path / "log.blf"
    if not path.exists():
        blf_log(path, 200, compression_level=level, max_container_size=2000)
    text = bytearray(path.read_bytes())
    for place, byte in data.draw(st.lists(st.tuples(st.integers(4, len(text) - 1), st.integers(0, 255)), max_size=5)):
        text[place] = byte
    changed = tmp_path / "changed.blf"
    changed.write_bytes(text[: data.draw(st.integers(40, len(text)))])
    frames, _ = read(changed)
    assert sum(map(len, frames.values())) <= 200


def test_blf_that_unpacks_to_too_much_is_bounded(tmp_path):
    path = tmp_path / "log.blf"
    head = blf_log(path, 1)[:144]
    bomb = zlib.compress(bytes(20 << 20), 9)
    header = b"LOBJ" + (16).to_bytes(2, "little") + (1).to_bytes(2, "little") + (32 + len(bomb)).to_bytes(4, "little")
    path.write_bytes(head + header + (10).to_bytes(4, "little") + b"\2" + bytes(15) + bomb)
    frames, damage = read(path)
    assert frames == {}
    assert damage.lost == {"container damaged": 1}


def test_text_readers_go_on_from_chunk_to_chunk(tmp_path, monkeypatch):
    for suffix in (".asc", ".trc"):
        path = tmp_path / f"log{suffix}"
        write(path, random_messages(50, fd=False))
        whole = read(path)
        with monkeypatch.context() as patch:
            patch.setattr(text_log, "CHUNK_BYTES", 100)
            assert read(path) == whole

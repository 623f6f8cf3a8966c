"""Records of a dataflash log: found wherever they are whole, whatever lies between them, in bounded memory."""

from __future__ import annotations

import io
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drivers.command import CommandScale
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import read_dataflash
from drivers.logs.dataflash_format import RecordFormat
from drivers.logs.dataflash_records import read_formats, read_records
from drivers.logs.tests.dataflash_writer import FORMATS, description, heading, layout, record
from drivers.mavlink.thrusters import MavlinkThruster

LENGTHS = {number: layout(kinds).size for number, kinds, _ in FORMATS.values()}
FORMATS_READ = read_formats(io.BytesIO(b"".join(map(description, FORMATS))))
PULSES = CommandScale(1100.0, 1500.0, 1900.0)
THRUSTERS = [MavlinkThruster(1, servo_channel=1, command_scale=PULSES, esc_index=0)]

DIVE = heading(("LOG_DISARMED", 0)) + b"".join(
    record(name, 100_000 * number + place, *values)
    for number in range(10)
    for place, (name, values) in enumerate(
        [
            ("RCOU", (1500,)),
            ("ESC", (0, 100, 100, 15, 1)),
            ("RATE", ()),
            ("ATT", ()),
            ("GPS", (0, 3, 86_400_000, 2300, 9, 1, 45, 8)),
            ("VISO", (0.1, 0, 0, 0, 0.1, 0, 0, 90)),
            ("IMU", (0,)),
            ("BARO", (1, 0, 2e5)),
            ("XKF1", (0,)),
            ("XKF4", (0,)),
            ("POS", (45, 8, -3)),
            ("RPM", (9, 9)),
        ]
    )
)

commands = st.integers(0, 2**40).map(lambda time_us: record("RCOU", time_us, 1500))
events = st.integers(0, 255).map(lambda event: record("EV", 1_000_000, event))
# what looks like the beginning of a record, inside of another
tricky = st.sampled_from([0x1295A3, 0x80_95A3, 0x5E_95A3]).map(lambda value: record("RPM", value << 8, 1.0, 2.0))
intact = st.lists(st.one_of(commands, events, tricky), max_size=12).map(b"".join)
garbage = st.one_of(
    st.binary(max_size=40),
    st.sampled_from([b"\xa3", b"\xa3\x95", b"\xa3\x95\x5e", b"\xa3\x95\x5e" * 30, b"\xa3\x95\x01" + bytes(20)]),
)
damaged = st.lists(st.one_of(intact, garbage), max_size=8).map(b"".join)


def found(log: bytes, chunk_bytes: int) -> tuple[list[tuple[int, str]], DamageReport]:
    damage = DamageReport()
    parts = read_records(io.BytesIO(log), FORMATS_READ, set(FORMATS), damage, chunk_bytes)
    places = [(int(offset), one.format.name) for part in parts for one in part for offset in one.offset]
    return sorted(places), damage


def walked(log: bytes) -> list[int]:
    """The rule, byte by byte."""
    places, at = [], 0
    while at + 3 <= len(log):
        end = at + LENGTHS.get(log[at + 2], 0)
        followed = end == len(log) or (log[end : end + 2] == b"\xa3\x95" and end + 3 <= len(log))
        if log[at : at + 2] == b"\xa3\x95" and end > at and followed:
            places.append(at)
            at = end
        else:
            at += 1
    return places


@settings(deadline=None)
@given(log=damaged, chunk_bytes=st.integers(1, 400))
@example(log=b"\xa3\x95\x5e" * 200 + record("EV", 1), chunk_bytes=7)
def test_what_is_found_follows_the_rule_however_the_log_is_cut(log, chunk_bytes):
    places, damage = found(log, chunk_bytes)
    assert [offset for offset, _ in places] == walked(log)
    assert damage.records == len(places)
    read = sum(LENGTHS[FORMATS[name][0]] for _, name in places)
    assert sum(damage.lost.values()) == len(log) - read
    assert damage.places == found(log, len(log) + 1)[1].places


@settings(deadline=None)
@given(before=intact, lost=st.binary(min_size=1, max_size=300), after=intact)
def test_records_before_and_after_damage_are_read(before, lost, after):
    places, _ = found(before + lost + after, 4096)
    offsets = {offset for offset, _ in places}
    whole = walked(before)
    assert set(whole[:-1]) <= offsets  # the last one has no head behind it any more
    resumed = [len(before) + len(lost) + offset for offset in walked(after)]
    # a head in the garbage may swallow what stands right behind it, but no more than the length of one record
    assert {offset for offset in resumed if offset >= len(before) + len(lost) + max(LENGTHS.values())} <= offsets


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_no_bytes_make_the_reader_raise(tmp_path_factory, data):
    log = bytearray(DIVE)
    for place, byte in data.draw(st.lists(st.tuples(st.integers(0, len(log) - 1), st.integers(0, 255)), max_size=30)):
        log[place] = byte
    start = data.draw(st.integers(0, len(log)))
    stop = data.draw(st.integers(start, len(log)))
    del log[start : data.draw(st.integers(start, stop))]
    path = tmp_path_factory.mktemp("log") / "dive.BIN"
    path.write_bytes(bytes(log))
    damage = DamageReport()
    try:
        readings = [one for batch in read_dataflash(path, THRUSTERS, damage, True) for one in batch]
    except ValueError as error:
        assert "dataflash" in str(error)  # not a single type is described any more
    else:
        times = [reading.time_s for reading in readings]
        assert times == sorted(times)


def test_a_log_that_lost_its_beginning_is_read_by_the_descriptions_that_follow(tmp_path):
    path = tmp_path / "dive.BIN"
    path.write_bytes(record("RCOU", 1_000_000, 1900)[5:] + record("RCOU", 1_100_000, 1900) + heading())
    damage = DamageReport()
    batches = read_dataflash(path, THRUSTERS, damage)
    assert [one.time_s for batch in batches for one in batch] == [1.1]
    assert damage.places == {"bytes that are no record": ["offset 0"]}


def test_a_type_that_is_described_wrongly_is_no_type():
    good = description("RCOU")
    assert RecordFormat.described_by(good) is not None
    for place, what in (
        (4, b"\xc8"),  # length
        (9, b"?"),  # kind of a field
        (30, b","),  # name of a field
        (28, b"C1,C1"),  # the same twice
        (28, b",,,"),
        (25, b"head,"),
    ):
        bad = bytearray(good)
        bad[place : place + len(what)] = what
        assert RecordFormat.described_by(bytes(bad)) is None


@pytest.mark.parametrize("filling", [b"\0", b"\xff", b"\xa3", b"\xa3\x95", b"\xa3\x95\x01"])
def test_memory_is_bounded_where_a_log_is_all_damage(filling):
    class Endless(io.RawIOBase):
        left = 40

        def read(self, size: int = -1) -> bytes:
            self.left -= 1
            return (filling * size)[:size] if self.left >= 0 else b""

    damage = DamageReport()
    tracemalloc.start()
    parts = list(read_records(Endless(), FORMATS_READ, {"RCOU"}, damage, 65536))  # type: ignore[arg-type]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert not any(parts)
    assert damage.lost["bytes that are no record"] == 40 * 65536
    assert peak < 10_000_000


def test_a_real_directory_is_no_log(tmp_path: Path):
    with pytest.raises(OSError, match="directory"):
        list(read_dataflash(tmp_path, THRUSTERS, DamageReport()))

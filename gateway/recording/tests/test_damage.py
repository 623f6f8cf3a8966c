"""Recordings that are cut off or damaged: what is whole is read, what is not is told, and nothing is raised."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import Writer

from drivers.logs.damage import DamageReport
from gateway.config_sections import Recording
from gateway.recording.entries import Entry, Frames
from gateway.recording.mending import mend
from gateway.recording.reading import is_recording, read_about, read_entries
from gateway.recording.scribe import Scribe
from gateway.recording.tests.dive import START_S, about, dive, read, same
from gateway.recording.waiting import Waiting
from gateway.recording.walk import records

CHUNKS = 4


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of some seconds, one chunk each."""
    folder = tmp_path_factory.mktemp("whole")
    scribe = Scribe(Recording(folder=folder, keep_free_mb=0.0), about(), lambda: START_S)
    items = dive(seconds=CHUNKS).items
    each = len(items) // CHUNKS
    for begin in range(0, len(items), each):
        scribe.write(items[begin : begin + each])
    scribe.close()
    return scribe.path


@pytest.fixture
def damaged(tmp_path: Path) -> Path:
    return tmp_path / "damaged.mcap"


def chunk_offsets(path: Path) -> list[int]:
    return [one.offset for one in records(path, DamageReport()) if one.opcode == Opcode.CHUNK]


def seconds_of(entries: list[Entry]) -> set[int]:
    """Which seconds of the dive are there."""
    return {int(one.frames.time_s[0] - START_S) for one in entries if isinstance(one, Frames)}


def is_part_of(some: list[Entry], all_of_them: Iterable[Entry]) -> bool:
    """Whether these entries stand among them, one behind the other."""
    rest = iter(all_of_them)
    return all(any(same(one, other) for other in rest) for one in some)


def cuts(path: Path) -> list[int]:
    """Bytes after which to cut: in the third chunk and its indexes, where they begin, in their heads, and behind."""
    _, _, begin, end = chunk_offsets(path)
    found = [one for one in records(path, DamageReport()) if begin <= one.offset <= end]
    chosen = [*found[:3], *found[-3:]]
    return [one.offset + more for one in chosen for more in (0, 1, 8, 9, len(one.content) - 1)]


def test_cut_off_anywhere(whole: Path, damaged: Path):
    data, entries_of_all = whole.read_bytes(), read(whole)[0]
    ends = [one.end for one in records(whole, DamageReport()) if one.opcode == Opcode.CHUNK]
    for size in cuts(whole):
        damaged.write_bytes(data[:size])
        entries, damage = read(damaged)
        assert seconds_of(entries) == set(range(sum(end <= size for end in ends)))
        assert is_part_of(entries, entries_of_all)
        assert any(cause.startswith("no end") for cause in damage.lost)


def test_cut_off_in_what_it_says_of_itself(whole: Path, damaged: Path):
    data, first = whole.read_bytes(), chunk_offsets(whole)[0]
    for size in range(9, first, 41):
        damaged.write_bytes(data[:size])
        try:
            told = read_about(damaged)
        except ValueError as error:
            assert str(damaged) in str(error)
        else:
            assert told.run == "5f3c"


def test_a_mended_file_opens_everywhere(whole: Path, damaged: Path):
    data = whole.read_bytes()
    for size in cuts(whole)[::3]:
        damaged.write_bytes(data[:size])
        before, _ = read(damaged)
        assert mend(damaged)
        assert not mend(damaged)
        after, damage = read(damaged)
        assert not damage.lost
        assert [repr(one) for one in after] == [repr(one) for one in before]
        with damaged.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            assert sum(1 for _ in reader.iter_messages()) == summary.statistics.message_count
            assert {one.name for one in reader.iter_attachments()} == {"config.toml", "files/thruster.dbc", "state"}
            assert len(summary.chunk_indexes) == len(seconds_of(after))


@pytest.mark.parametrize("chunk", range(CHUNKS - 1))
def test_a_mended_file_opens_everywhere_also_where_a_chunk_is_damaged(whole: Path, damaged: Path, chunk: int):
    """The first one has the schemas of all others."""
    data = bytearray(whole.read_bytes()[: cuts(whole)[-1]] if chunk < 2 else whole.read_bytes()[:-100])
    data[chunk_offsets(whole)[chunk] + 60] ^= 0xFF
    damaged.write_bytes(data)
    seconds = seconds_of(read(damaged)[0])
    assert mend(damaged)
    assert seconds_of(read(damaged)[0]) == seconds
    with damaged.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert sum(1 for _ in reader.iter_messages()) == summary.statistics.message_count > 0
        assert len(summary.chunk_indexes) == len(seconds)


def test_damage_in_what_it_says_of_itself(whole: Path, damaged: Path):
    """Wherever it is: nothing but ValueError with the file's name, and all that is recorded can be had and mended."""
    data, first = whole.read_bytes()[:-100], chunk_offsets(whole)[0]
    said = next(one for one in records(whole, DamageReport()) if one.opcode == Opcode.METADATA)
    for offset in range(said.offset + 9, first, 41):
        changed = bytearray(data)
        changed[offset] ^= 0xFF
        damaged.write_bytes(changed)
        try:
            read_about(damaged)
        except ValueError as error:
            assert str(damaged) in str(error)
        assert seconds_of(read(damaged)[0]) == set(range(CHUNKS))
        assert mend(damaged)


def test_a_whole_file_is_not_mended(whole: Path):
    before = whole.read_bytes()
    assert not mend(whole)
    assert whole.read_bytes() == before


def test_mending_what_is_no_recording(damaged: Path):
    damaged.write_bytes(b"(1.0) can0 123#00\n" * 10)
    with pytest.raises(ValueError, match="want an MCAP file"):
        mend(damaged)


def test_flipped_bytes(whole: Path, damaged: Path):
    """Each damage takes one chunk at most, and is told."""
    random, data, first = np.random.default_rng(5), whole.read_bytes(), chunk_offsets(whole)[0]
    end, entries_of_all = len(data) * 9 // 10, read(whole)[0]
    for offset in random.integers(first, end, 40).tolist():
        changed = bytearray(data)
        changed[offset] ^= int(random.integers(1, 256))
        damaged.write_bytes(changed)
        entries, damage = read(damaged)
        assert len(seconds_of(entries)) >= CHUNKS - 1
        assert is_part_of(entries, entries_of_all)
        assert damage.lost or len(seconds_of(entries)) == CHUNKS


def test_a_page_of_zeros_in_the_middle(whole: Path, damaged: Path):
    data, chunks = bytearray(whole.read_bytes()), chunk_offsets(whole)
    data[chunks[1] - 100 : chunks[2] + 100] = bytes(chunks[2] + 200 - chunks[1])
    damaged.write_bytes(data)
    entries, damage = read(damaged)
    assert seconds_of(entries) == {0, 3}
    assert sum(damage.lost.values()) > 0


def test_rubbish_between_chunks(whole: Path, damaged: Path):
    data, chunks = whole.read_bytes(), chunk_offsets(whole)
    rubbish = np.random.default_rng(3).bytes(5000)
    damaged.write_bytes(data[: chunks[2]] + rubbish + data[chunks[2] :])
    entries, damage = read(damaged)
    assert seconds_of(entries) == set(range(CHUNKS))
    assert len(rubbish) <= damage.lost["damaged bytes"] < len(rubbish) + 100


def test_what_had_no_room_is_told(tmp_path: Path):
    journal = Waiting(lambda: START_S, most_bytes=8000)
    dive(journal, seconds=5)
    scribe = Scribe(Recording(folder=tmp_path, keep_free_mb=0.0), about(), lambda: START_S)
    scribe.write(journal.take(1 << 20).items)
    scribe.close()
    entries, damage = read(scribe.path)
    kept = sum(len(one.frames) for one in entries if isinstance(one, Frames))
    assert kept + damage.lost["not recorded, no room: frames"] == 5 * 91
    assert journal.lost["frames"] == 5 * 91 - kept > 0


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"", "an empty file"),
        (b"\xa3\x95\x80", "dataflash"),
        (b"\x89MCAP0\r\n", "an MCAP file of another program"),
        (b"hello", "text"),
    ],
)
def test_what_is_no_recording(damaged: Path, head: bytes, words: str):
    damaged.write_bytes(head)
    assert not is_recording(head)
    for read_it in (read_about, lambda path: read_entries(path, DamageReport())):
        with pytest.raises(ValueError, match=words):
            read_it(damaged)


def test_mcap_of_another_program(damaged: Path):
    with damaged.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "other 1.0")
        channel = writer.register_channel("/x", "json", 0)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    with pytest.raises(ValueError, match="another program"):
        read_about(damaged)


def test_messages_of_another_version_are_told(whole: Path, damaged: Path):
    """Written by a gateway whose readings have other attributes."""
    with whole.open("rb") as stream, damaged.open("wb") as output:
        writer = Writer(output)
        writer.start("", "thruster-gateway 9.9")
        source = make_reader(stream)
        for one in source.iter_metadata():
            writer.add_metadata(one.name, one.metadata)
        for one in source.iter_attachments():
            writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, one.data)
        channels: dict[int, int] = {}
        for schema, channel, message in source.iter_messages():
            if channel.id not in channels:
                text = schema.data + (b"float64 depth_m\n" if channel.topic == "/events/can0/BusLoad" else b"")
                kind = writer.register_schema(schema.name, schema.encoding, text)
                channels[channel.id] = writer.register_channel(channel.topic, "cdr", kind)
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()
    entries, damage = read(damaged)
    assert damage.lost == {"/events/can0/BusLoad of another version": 1}
    rewritten = [repr(one) for one in entries if not isinstance(one, Frames)]
    assert rewritten == [
        repr(one) for one in read(whole)[0] if not isinstance(one, Frames) and "BusLoad" not in repr(one)
    ]

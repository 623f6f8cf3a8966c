"""Frames in blocks, cut anywhere, give what the same frames give one by one: bit for bit, readings and counts."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.messages.bit_field import BitField
from drivers.can.messages.field_layout import FieldLayout
from drivers.can.vesc import VescDecoder, VescThruster
from drivers.command import CommandScale

EVERYTHING = """VERSION ""
NS_ :
BS_:
BU_: ESC
BO_ 256 Command: 8 ESC
 SG_ Pwm : 0|16@1+ (1,0) [0|0] "us" ESC
 SG_ Percent : 23|16@0- (0.01,0) [0|0] "%" ESC
 SG_ Volts : 35|11@1+ (0.01,-5) [0|0] "V" ESC
BO_ 2147483905 Status: 6 ESC
 SG_ Rpm : 0|16@1- (1,0) [-6000|6000] "rpm" ESC
 SG_ Voltage : 23|12@0+ (0.01,0) [0|30] "V" ESC
 SG_ Current : 28|13@1- (0.1,0) [0|0] "A" ESC
BO_ 258 Counts: 8 ESC
 SG_ Up : 0|12@1+ (1,0) [0|0] "" ESC
 SG_ UpAndDown : 23|16@0- (0.5,0) [0|0] "" ESC
 SG_ Wide : 32|32@1+ (1,0) [0|0] "" ESC
BO_ 259 Floats: 8 ESC
 SG_ Single : 0|32@1- (1,0) [0|0] "rpm" ESC
 SG_ Half : 43|16@0- (1,0) [0|0] "V" ESC
BO_ 260 Muxed: 8 ESC
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" ESC
 SG_ Inner m1M : 8|2@1+ (1,0) [0|0] "" ESC
 SG_ Speed m2 : 8|16@1- (1,0) [0|0] "rpm" ESC
 SG_ Deep m3 : 16|16@1- (1,0) [0|0] "rpm" ESC
BO_ 2147483654 Long: 64 ESC
 SG_ Far : 300|64@1- (1e-15,0) [0|0] "rpm" ESC
 SG_ Double : 191|64@0- (1,0) [0|0] "V" ESC
 SG_ Straddling : 5|61@0- (1e-15,0) [0|0] "A" ESC
BO_ 261 Short: 10 ESC
 SG_ Speed : 64|16@1- (1,0) [0|0] "rpm" ESC
SIG_VALTYPE_ 259 Single : 1;
SIG_VALTYPE_ 259 Half : 1;
SIG_VALTYPE_ 2147483654 Double : 2;
SG_MUL_VAL_ 260 Inner Which 1-1;
SG_MUL_VAL_ 260 Speed Which 0-0, 2-4;
SG_MUL_VAL_ 260 Deep Inner 1-2;
"""
THRUSTERS = [
    DbcThruster(3, "Command.Pwm", CommandScale(1100.0, 1500.0, 1900.0, dead_band=25.0), "Muxed.Speed"),
    DbcThruster(1, "Command.Percent", CommandScale(-100.0, 0.0, 100.0, reverse=True), "Status.Rpm", reverse=True),
    DbcThruster(
        2, "Command.Volts", CommandScale(0.0, 0.0, 5.0), "Counts.Up", "pulse_count", 7, False, True, "Status.Voltage"
    ),
    DbcThruster(4, speed="Counts.UpAndDown", speed_unit="pulse_count", pole_pairs=1, current="Status.Current"),
    DbcThruster(5, speed="Counts.Wide", speed_unit="pulse_count", pole_pairs=2, voltage="Floats.Half"),
    DbcThruster(6, speed="Floats.Single", speed_unit="rad_per_s", voltage="Long.Double", current="Long.Straddling"),
    DbcThruster(7, speed="Muxed.Deep", voltage="Status.Voltage"),
    DbcThruster(8, speed="Long.Far", speed_unit="erpm", pole_pairs=7, signed=False),
    DbcThruster(9, speed="Short.Speed"),
]
DBC_MESSAGES = {(256, False): 8, (257, True): 6, (258, False): 8, (259, False): 8, (260, False): 8, (6, True): 64}
DBC_MESSAGES |= {(261, False): 10, (257, False): 8}
VESCS = [
    VescThruster(2, 7, "duty", CommandScale(-0.95, 0.0, 0.95, dead_band=0.01), pole_pairs=7),
    VescThruster(1, 8, "rpm", CommandScale(-20000.0, 0.0, 30000.0, reverse=True), 7, signed=False, reverse=True),
    VescThruster(3, 9, pole_pairs=1),
]
VESC_MESSAGES = {
    (packet << 8 | controller, True): length
    for controller in (7, 8, 9, 10)
    for packet, length in {0: 4, 1: 4, 2: 4, 3: 4, 4: 4, 9: 8, 10: 4, 12: 4, 14: 8, 16: 8, 27: 8}.items()
}


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    path = tmp_path_factory.mktemp("dbc") / "everything.dbc"
    path.write_text(EVERYTHING)
    return path


def contents(random, last):
    """Data of a message: mostly as the last with a little added, as counts and speeds go; else anything."""
    kind = random.choice(["walk", "walk", "walk", "walk", "marks", "padded", "any"])
    if kind == "walk":
        place = random.randrange(len(last))
        return last[:place] + bytes([(last[place] + random.randrange(1, 30)) % 256]) + last[place + 1 :]
    if kind == "marks":
        return bytes(random.choices([0, 1, 2, 0x7F, 0x80, 0xFF], k=len(last)))
    return last + b"\xff" * (8 - len(last)) if kind == "padded" else random.randbytes(len(last))


def stream(random, messages, count):
    """Frames whose times mostly rise, with repetitions, gaps and steps back; their lengths mostly right."""
    time_s, last = random.choice([0.0, 1.7e9]), {key: bytes(length) for key, length in messages.items()}
    for _ in range(count):
        identifier, extended = key = random.choice(list(messages))
        time_s += random.choice([0.005] * 12 + [0.001, 0.0005, 0.0, 1.9, 2.5, -0.3])
        data = contents(random, last[key])
        last[key] = data[: messages[key]]
        data = random.choice([data] * 10 + [data[:-1], data.ljust(12, b"\0"), data.ljust(64, b"\xff")])
        fd, error = len(data) > 8 or random.random() < 0.1, random.random() < 0.05
        yield CanFrame(time_s, identifier, data, extended=extended, fd=fd, error=error)


def pieces(random, frames):
    """The frames in pieces, each to be decoded as a block or frame by frame."""
    while frames:
        count = random.choice([1, 2, 5, 40, 200])
        yield frames[:count], random.random() < 0.7
        frames = frames[count:]


def check(one_by_one, in_blocks, messages, seed):
    random = Random(seed)
    for frames, as_block in pieces(random, list(stream(random, messages, 400))):
        expected = [reading for frame in frames for reading in one_by_one.decode(frame)]
        if as_block:
            found = in_blocks.decode_block(FrameBlock.of(frames)).readings()
        else:
            found = [reading for frame in frames for reading in in_blocks.decode(frame)]
        assert repr(found) == repr(expected)  # tells 0.0 from -0.0, and numbers of numpy from those of Python
    assert in_blocks.drops == one_by_one.drops


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**64))
def test_messages_of_a_database(database, seed):
    check(DbcDecoder(database, THRUSTERS), DbcDecoder(database, THRUSTERS), DBC_MESSAGES, seed)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**64))
def test_messages_of_vescs(seed):
    check(VescDecoder(VESCS), VescDecoder(VESCS), VESC_MESSAGES, seed)


def test_a_block_without_a_frame_that_is_read_gives_nothing(database):
    decoder = DbcDecoder(database, THRUSTERS)
    assert decoder.decode_block(FrameBlock.of([])).readings() == []
    assert decoder.decode_block(FrameBlock.of([CanFrame(1.0, 1, b"", extended=False)])).readings() == []
    assert not decoder.drops


@st.composite
def fields(draw):
    kind = draw(st.sampled_from(["unsigned", "signed", "float"]))
    bits = draw(
        st.sampled_from([16, 32, 64]) if kind == "float" else st.integers(1, 64) | st.sampled_from([8, 16, 32])
    )
    first = draw(st.integers(0, 512 - bits) | st.integers(0, (512 - bits) // 8).map(lambda byte: 8 * byte))
    return BitField(first, bits, draw(st.booleans()), kind)


@given(st.lists(fields(), min_size=1, max_size=6), st.binary(min_size=64, max_size=64))
def test_fields_wherever_they_lie_are_read_alike_together_alone_and_as_columns(several, data):
    layout = FieldLayout(several, 64)
    together = layout.unpack(data)
    with np.errstate(invalid="ignore"):
        columns = layout.columns(np.frombuffer(data, np.uint8)[np.newaxis])
    for field in several:
        place, alone = layout.place(field), field.reader(64)(data)
        assert repr(together[place]) == repr(alone)
        assert repr(columns[place][0].item()) == repr(alone)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((-1, 8), "first must be at least 0, got -1"),
        ((0, 0), r"bits must lie in 1\.\.64, got 0"),
        ((0, 65), r"bits must lie in 1\.\.64, got 65"),
        ((0, 24, False, "float"), "a float must have 16, 32, 64 bits, got 24"),
        ((0, 8, False, "octal"), "kind must be one of unsigned, signed, float, got 'octal'"),
    ],
)
def test_an_impossible_field_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        BitField(*options)


def test_a_field_behind_the_end_of_its_message_is_refused():
    with pytest.raises(ValueError, match="ends at bit 72, its message has 64"):
        FieldLayout([BitField(64, 8)], 8)

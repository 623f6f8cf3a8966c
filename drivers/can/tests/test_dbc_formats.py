"""One bus described in each format that vendors use, and converted: the same frames give the same readings."""

from __future__ import annotations

from random import Random

import cantools
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.tests.arxml import ArxmlMessage, ArxmlSignal, arxml
from drivers.command import CommandScale

DBC = """VERSION ""
NS_ :
BS_:
BU_: ESC
BO_ 256 Command: 4 ESC
 SG_ Pulse : 0|16@1+ (1,0) [0|0] "us" ESC
 SG_ Percent : 23|16@0- (0.01,0) [0|0] "%" ESC
BO_ 2147483905 Status: 6 ESC
 SG_ Rpm : 7|16@0- (1,0) [0|0] "rpm" ESC
 SG_ Voltage : 20|12@1+ (0.01,2) [0|0] "V" ESC
 SG_ Current : 37|14@0- (0.1,0) [0|0] "A" ESC
BO_ 2566848513 Floats: 8 ESC
 SG_ Turning : 0|32@1- (1,0) [0|0] "rpm" ESC
 SG_ Supply : 39|32@0- (1,0) [0|0] "V" ESC
BO_ 259 Muxed: 8 ESC
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" ESC
 SG_ Left m1 : 8|16@1- (1,0) [0|0] "rpm" ESC
 SG_ Right m2 : 15|16@0- (1,0) [0|0] "rpm" ESC
BO_ 260 Long: 24 ESC
 SG_ Behind : 160|32@1- (0.5,0) [0|0] "rpm" ESC
SIG_VALTYPE_ 2566848513 Turning : 1;
SIG_VALTYPE_ 2566848513 Supply : 1;
"""
KCD = """<NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0"><Document/><Bus name="Thrusters">
<Message id="0x100" name="Command" length="4">
  <Signal name="Pulse" offset="0" length="16"><Value unit="us"/></Signal>
  <Signal name="Percent" offset="16" length="16" endianess="big"><Value type="signed" slope="0.01"/></Signal>
</Message>
<Message id="0x101" name="Status" length="6" format="extended">
  <Signal name="Rpm" offset="0" length="16" endianess="big"><Value type="signed"/></Signal>
  <Signal name="Voltage" offset="20" length="12"><Value slope="0.01" intercept="2"/></Signal>
  <Signal name="Current" offset="34" length="14" endianess="big"><Value type="signed" slope="0.1"/></Signal>
</Message>
<Message id="0x18FF0001" name="Floats" length="8" format="extended">
  <Signal name="Turning" offset="0" length="32"><Value type="single"/></Signal>
  <Signal name="Supply" offset="32" length="32" endianess="big"><Value type="single"/></Signal>
</Message>
<Message id="0x103" name="Muxed" length="8"><Multiplex name="Which" offset="0" length="8">
  <MuxGroup count="1"><Signal name="Left" offset="8" length="16"><Value type="signed"/></Signal></MuxGroup>
  <MuxGroup count="2">
    <Signal name="Right" offset="8" length="16" endianess="big"><Value type="signed"/></Signal>
  </MuxGroup>
</Multiplex></Message>
<Message id="0x104" name="Long" length="24">
  <Signal name="Behind" offset="160" length="32"><Value type="signed" slope="0.5"/></Signal>
</Message>
</Bus></NetworkDefinition>
"""
SYM = """FormatVersion=6.0 // Do not edit this line!
Title="Thrusters"

{SENDRECEIVE}

[Command]
ID=100h
Len=4
Var=Pulse unsigned 0,16 /u:us
Var=Percent signed 16,16 -m /f:0.01

[Status]
ID=101h
Type=Extended
Len=6
Var=Rpm signed 0,16 -m
Var=Voltage unsigned 20,12 /f:0.01 /o:2
Var=Current signed 34,14 -m /f:0.1

[Floats]
ID=18FF0001h
Type=Extended
Len=8
Var=Turning float 0,32
Var=Supply float 32,32 -m

[Muxed]
ID=103h
Len=8
Mux=One 0,8 1
Var=Left signed 8,16

[Muxed]
Len=8
Mux=Two 0,8 2
Var=Right signed 8,16 -m

[Long]
ID=104h
Type=FDStandard
Len=24
Var=Behind signed 160,32 /f:0.5
"""
ARXML = arxml(
    [
        ArxmlMessage(
            "Command",
            0x100,
            False,
            4,
            (ArxmlSignal("Pulse", 0, 16), ArxmlSignal("Percent", 23, 16, "big", "signed", 0.01)),
        ),
        ArxmlMessage(
            "Status",
            0x101,
            True,
            6,
            (
                ArxmlSignal("Rpm", 7, 16, "big", "signed"),
                ArxmlSignal("Voltage", 20, 12, scale=0.01, offset=2.0),
                ArxmlSignal("Current", 37, 14, "big", "signed", 0.1),
            ),
        ),
        ArxmlMessage(
            "Floats",
            0x18FF0001,
            True,
            8,
            (ArxmlSignal("Turning", 0, 32, kind="float"), ArxmlSignal("Supply", 39, 32, "big", "float")),
        ),
        ArxmlMessage(
            "Muxed",
            0x103,
            False,
            8,
            (
                ArxmlSignal("Left", 8, 16, kind="signed", code=1),
                ArxmlSignal("Right", 15, 16, "big", "signed", code=2),
            ),
            selector=ArxmlSignal("Which", 0, 8),
        ),
        ArxmlMessage("Long", 0x104, False, 24, (ArxmlSignal("Behind", 160, 32, kind="signed", scale=0.5),)),
    ]
)
THRUSTERS = [
    DbcThruster(1, "Command.Pulse", CommandScale(0.0, 1500.0, 65535.0), "Status.Rpm", voltage="Status.Voltage"),
    DbcThruster(2, "Command.Percent", CommandScale(-400.0, 0.0, 400.0), "Muxed.Left", current="Status.Current"),
    DbcThruster(3, speed="Muxed.Right", voltage="Floats.Supply"),
    DbcThruster(4, speed="Floats.Turning"),
    DbcThruster(5, speed="Long.Behind"),
]
MESSAGES = {(0x100, False): 4, (0x101, True): 6, (0x18FF0001, True): 8, (0x103, False): 8, (0x104, False): 24}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Files of the same bus: written by hand, and by cantools out of the first."""
    folder = tmp_path_factory.mktemp("databases")
    for suffix, text in {"dbc": DBC, "kcd": KCD, "sym": SYM, "arxml": ARXML}.items():
        (folder / f"vendor.{suffix}").write_text(text)
    database = cantools.database.load_file(folder / "vendor.dbc")
    for suffix in ("dbc", "kcd", "sym"):
        cantools.database.dump_file(database, folder / f"converted.{suffix}")
    return folder


def frames():
    """Of all the messages, with any data; of the multiplexed one, mostly such as have a signal; and of their twins
    whose identifiers are of the other kind."""
    random = Random(1)
    for number in range(400):
        identifier, extended = random.choice(list(MESSAGES))
        length = MESSAGES[identifier, extended]
        data = random.choice([random.randbytes(length), bytes([number % 4]) + random.randbytes(length - 1)])
        other = identifier <= 0x7FF and random.random() < 0.2
        yield CanFrame(0.01 * number, identifier, data, extended=extended != other, fd=length > 8)


@pytest.mark.parametrize(
    "name", ["vendor.kcd", "vendor.sym", "vendor.arxml", "converted.dbc", "converted.kcd", "converted.sym"]
)
def test_every_format_says_the_same(files, name):
    reference, other = (DbcDecoder(files / one, THRUSTERS, 1e40) for one in ("vendor.dbc", name))
    expected = [reading for frame in frames() for reading in reference.decode(frame)]
    assert {reading.thruster for reading in expected} == {1, 2, 3, 4, 5}
    assert [reading for frame in frames() for reading in other.decode(frame)] == expected
    assert other.drops == reference.drops
    assert other.decode_block(FrameBlock.of(list(frames()))).readings() == expected


@pytest.mark.parametrize("name", ["vendor.dbc", "vendor.kcd", "vendor.sym", "vendor.arxml"])
def test_every_format_is_read_as_cantools_reads_it(files, name):
    database = cantools.database.load_file(files / name)
    decoder = DbcDecoder(files / name, [DbcThruster(1, speed="Status.Rpm", voltage="Status.Voltage")], 1e9)
    random = Random(2)
    for number in range(100):
        data = random.randbytes(6)
        values = database.decode_message(0x101, data, force_extended_id=True)
        (report,) = decoder.decode(CanFrame(0.01 * number, 0x101, data))
        assert (report.speed_rpm, report.voltage_v) == (values["Rpm"], pytest.approx(values["Voltage"]))


@pytest.mark.parametrize("suffix", ["dbc", "kcd", "sym", "arxml"])
def test_a_small_identifier_may_be_an_extended_one(files, suffix):
    decoder = DbcDecoder(files / f"vendor.{suffix}", [DbcThruster(1, speed="Status.Rpm")])
    ((identifier, extended),) = [(one.identifier, one.extended) for one in decoder.filters()]
    assert (identifier, extended) == (0x101, True)
    assert decoder.decode(CanFrame(0.0, 0x101, bytes(6)))
    assert not decoder.decode(CanFrame(0.0, 0x101, bytes(6), extended=False))


# Lengths


@pytest.mark.parametrize(
    ("data", "extended", "read"),
    [
        (bytes(6), True, True),
        (bytes(6) + b"\xff\xff", True, True),  # J1939 fills up with ones
        (bytes(6) + b"\xff\x00", True, False),
        (bytes(6) + b"\xff", True, False),
        (bytes(5), True, False),
        (bytes(4) + b"\xff" * 4, False, False),  # J1939 has no standard identifiers
        (bytes(4), False, True),
    ],
)
def test_what_j1939_pads_with_is_let_pass(files, data, extended, read):
    decoder = DbcDecoder(files / "vendor.dbc", THRUSTERS[:1])
    frame = CanFrame(1.0, 0x101 if extended else 0x100, data, extended=extended)
    assert bool(decoder.decode(frame)) == read
    assert decoder.drops["wrong length"] == (not read)


@pytest.mark.parametrize(("length", "read"), [(24, True), (32, True), (64, True), (20, False), (8, False)])
def test_what_can_fd_pads_with_is_let_pass(files, length, read):
    decoder = DbcDecoder(files / "vendor.dbc", [DbcThruster(1, speed="Long.Behind")])
    data = (bytes(20) + (-2400).to_bytes(4, "little", signed=True)).ljust(64, b"\xcc")[:length]
    found = decoder.decode(CanFrame(1.0, 0x104, data, extended=False, fd=True))
    assert [reading.speed_rpm for reading in found] == [-1200.0] * read
    assert decoder.drops["wrong length"] == (not read)


def test_a_message_of_can_fd_may_have_few_bytes_too(files):
    decoder = DbcDecoder(files / "vendor.dbc", [DbcThruster(1, speed="Status.Rpm")])
    assert decoder.decode(CanFrame(1.0, 0x101, bytes(6), fd=True))


# Files that are not what they should be


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "vendor.xml",
            KCD,
            r"vendor\.xml should be named by its format: want \.dbc, \.kcd, \.sym, \.arxml at its end",
        ),
        ("vendor", DBC, "should be named by its format"),
        ("vendor.kcd", DBC, r"vendor\.kcd cannot be read: KCD: "),
        ("vendor.arxml", KCD, r"vendor\.arxml cannot be read: ARXML: "),
        ("vendor.sym", DBC, r"vendor\.sym cannot be read: SYM: "),
        ("vendor.dbc", SYM, r"vendor\.dbc cannot be read: DBC: "),
        ("vendor.kcd", KCD[:900], r"vendor\.kcd cannot be read: KCD: "),
        ("vendor.dbc", DBC.replace("BO_ 256", "BO_ 3000"), "cannot be read: .*0xbb8 is more than 11 bits"),
    ],
)
def test_a_file_of_another_kind_is_refused_with_what_was_tried(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        DbcDecoder(tmp_path / name, THRUSTERS)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        ("0|65@1+ (1,0)", r"Wide\.S: bits must lie in 1\.\.64, got 65: mend the database"),
        ("0|24@1- (1,0)", r"Wide\.S: a float must have 16, 32, 64 bits, got 24"),
    ],
)
def test_a_signal_that_no_number_can_be_read_of_is_refused(tmp_path, signal, message):
    text = f'VERSION ""\nNS_ :\nBS_:\nBU_: X\nBO_ 1 Wide: 64 X\n SG_ S : {signal} [0|0] "" X\n'
    (tmp_path / "wide.dbc").write_text(text + ("SIG_VALTYPE_ 1 S : 1;\n" if "24" in signal else ""))
    with pytest.raises(ValueError, match=message):
        DbcDecoder(tmp_path / "wide.dbc", [DbcThruster(1, speed="Wide.S")])


def damaged(random, text):
    """A few characters are others, or lost, or there is a piece of the text where it should not be."""
    for _ in range(random.choice([1, 2, 4])):
        place, other = random.randrange(len(text)), random.randrange(len(text))
        kept = place + random.choice([0, 1, 1, 10])
        inserted = random.choice(["", text[other : other + 20], random.choice('019mM|@+-:;,"<> .e'), "65"])
        text = text[:place] + inserted + text[kept:]
    return text


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["dbc", "kcd", "sym", "arxml"]), st.integers(0, 2**64))
def test_a_damaged_file_is_refused_or_read(files, suffix, seed):
    random = Random(seed)
    path = files / f"damaged.{suffix}"
    path.write_text(damaged(random, (files / f"vendor.{suffix}").read_text()))
    try:
        one_by_one, in_blocks = DbcDecoder(path, THRUSTERS), DbcDecoder(path, THRUSTERS)
    except ValueError:
        return
    expected = [reading for frame in frames() for reading in one_by_one.decode(frame)]
    assert repr(in_blocks.decode_block(FrameBlock.of(list(frames()))).readings()) == repr(expected)


NESTED = DBC.replace(" SG_ Right m2", ' SG_ Inner m2M : 24|8@1+ (1,0) [0|0] "" ESC\n SG_ Right m3')
NESTED += "SG_MUL_VAL_ 259 Inner Which 2-2;\nSG_MUL_VAL_ 259 Right Nowhere 3-3;\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "lost.dbc",
            NESTED,
            r"speed of thruster 3: Muxed\.Right: there is no multiplexer Nowhere: mend the database",
        ),
        ("nameless.kcd", KCD.replace('name="Rpm" ', ""), "no signal of Status is named 'Rpm', nearest is '"),
    ],
)
def test_what_a_signal_depends_on_is_missed(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        DbcDecoder(tmp_path / name, THRUSTERS)


def test_a_message_of_several_frames_is_refused(tmp_path):
    text = 'VERSION ""\nNS_ :\nBS_:\nBU_: X\nBO_ 2566844926 Big: 100 X\n SG_ S : 8|8@1+ (1,0) [0|0] "" X\n'
    (tmp_path / "big.dbc").write_text(text)
    with pytest.raises(
        ValueError, match=r"message Big has 100 bytes: it takes several frames .* want a message of one"
    ):
        DbcDecoder(tmp_path / "big.dbc", [DbcThruster(1, speed="Big.S")])


def test_a_count_that_is_a_float_is_refused(files):
    thruster = DbcThruster(1, speed="Floats.Turning", speed_unit="pulse_count", pole_pairs=7)
    with pytest.raises(ValueError, match="speed of thruster 1: a pulse count must be an integer, got a float"):
        DbcDecoder(files / "vendor.dbc", [thruster])


def test_a_name_that_two_buses_of_one_file_have_is_refused(tmp_path):
    bus = KCD[KCD.index("<Bus") : KCD.index("</Network")]
    (tmp_path / "twice.kcd").write_text(KCD.replace("</Network", bus + "</Network"))
    with pytest.raises(ValueError, match="2 times a message is named 'Status': keep one of them in the database"):
        DbcDecoder(tmp_path / "twice.kcd", THRUSTERS[:1])

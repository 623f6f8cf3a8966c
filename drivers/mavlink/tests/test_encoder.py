"""What the gateway sends, read back by pymavlink."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.encoder import MavlinkEncoder, frames_of
from drivers.mavlink.messages import (
    CommandAck,
    CommandLong,
    CompanionHeartbeat,
    CompanionState,
    ComputerStatus,
    NamedValue,
    StatusText,
)
from drivers.mavlink.tests.peer import messages_in

FLOAT32 = st.floats(width=32)
PRINTABLE = st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=50)


@given(st.integers(1, 254), st.integers(0, 7), PRINTABLE)
def test_statustext_is_read_back_by_pymavlink(system, severity, text):
    (sent,) = messages_in(MavlinkEncoder(system).encode(StatusText(severity, text)))
    assert (sent.get_type(), sent.severity, sent.text, sent.id) == ("STATUSTEXT", severity, text, 0)
    assert (sent.get_srcSystem(), sent.get_srcComponent()) == (system, 192)


@pytest.mark.parametrize("state", CompanionState)
def test_heartbeat_of_an_onboard_computer(state):
    (sent,) = messages_in(MavlinkEncoder(7).encode(CompanionHeartbeat(state)))
    assert (sent.type, sent.autopilot, sent.base_mode, sent.custom_mode, sent.system_status) == (18, 8, 0, 0, state)


@given(st.integers(1, 65535), st.tuples(*[FLOAT32.filter(lambda x: not math.isinf(x))] * 7), st.integers(0, 255))
def test_command_long_is_read_back_by_pymavlink(command, parameters, confirmation):
    if command == 400:
        parameters = (0.0,) * 7
    message = CommandLong(command, parameters, target_system=3, confirmation=confirmation)
    (sent,) = messages_in(MavlinkEncoder(3).encode(message))
    assert (sent.command, sent.target_system, sent.target_component) == (command, 3, 1)
    assert sent.confirmation == confirmation
    got = [getattr(sent, f"param{i}") for i in range(1, 8)]
    assert all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(got, parameters, strict=True))


class Joiner:
    """Joins chunks as ground stations do: by sender and id, in the order of their numbers, until one has a NUL."""

    def __init__(self):
        self.texts, self._parts = [], {}

    def take(self, frame):
        (chunk,) = messages_in(frame)
        text = frame[11:-2].ljust(53, b"\0")[:50]
        assert (chunk.id, chunk.chunk_seq) == (0, 0) or chunk.id > 0
        parts = self._parts.setdefault(chunk.id, [])
        assert chunk.chunk_seq == len(parts)
        parts.append(text)
        if chunk.id == 0 or b"\0" in text:
            self.texts.append((chunk.severity, b"".join(parts).rstrip(b"\0").decode()))
            del self._parts[chunk.id]


LONG = st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=200)


@given(st.lists(st.tuples(st.integers(0, 7), LONG), min_size=1, max_size=4))
def test_long_texts_are_joined_again_as_ground_stations_do(said):
    encoder, joiner = MavlinkEncoder(1), Joiner()
    for severity, text in said:
        for frame in frames_of(encoder.encode(StatusText(severity, text))):
            joiner.take(frame)
    assert joiner.texts == said


def test_ids_of_long_texts_wrap_and_are_never_0():
    encoder, text = MavlinkEncoder(1), StatusText(6, "z" * 60)
    encoder._text_id = 65_534
    ids = [messages_in(encoder.encode(text))[0].id for _ in range(3)]
    assert ids == [65_535, 1, 2]


def test_the_computer_is_told_of_with_what_is_known_and_no_more():
    status = ComputerStatus(1.5e9, 12.5, (3.4, 250.0), (47.6,), memory_mib=(100, 900), storage_mib=(5, 70))
    (sent,) = messages_in(MavlinkEncoder(1).encode(status))
    assert (sent.time_usec, sent.uptime, sent.type) == (1_500_000_000_000_000, 12_500, 0)
    assert sent.cpu_cores == [3, 100] + [255] * 6 and sent.cpu_combined == [255] * 10
    assert sent.temperature_core == [48] + [127] * 7 and sent.temperature_board == 127
    assert (sent.ram_usage, sent.ram_total) == (100, 900)
    assert sent.storage_usage[:2] == [5, 0xFFFF_FFFF] and sent.storage_total[0] == 70
    assert set(sent.storage_type + sent.link_type + sent.link_tx_rate + sent.link_rx_max) == {0xFFFF_FFFF}
    assert sent.fan_speed == [32_767] * 4
    (bare,) = messages_in(MavlinkEncoder(1).encode(ComputerStatus(1.5e9, 5e6, tuple(range(16)))))
    assert bare.cpu_cores == list(range(8)) and bare.ram_total == 0xFFFF_FFFF
    assert bare.uptime == 5_000_000_000 % 2**32


def test_answer_and_named_value_are_read_back_by_pymavlink():
    encoder = MavlinkEncoder(1)
    (ack,) = messages_in(encoder.encode(CommandAck(31010, 2, 255, 190)))
    assert (ack.get_type(), ack.command, ack.result) == ("COMMAND_ACK", 31010, 2)
    assert (ack.target_system, ack.target_component) == (255, 190)
    (value,) = messages_in(encoder.encode(NamedValue("T3RES", -12.5, 5_000_000.0)))
    assert (value.name, value.value, value.time_boot_ms) == ("T3RES", -12.5, 5_000_000_000 % 2**32)


def test_sequence_numbers_run_and_wrap():
    encoder = MavlinkEncoder(1)
    numbers = [
        messages_in(encoder.encode(CompanionHeartbeat(CompanionState.ACTIVE)))[0].get_seq() for _ in range(300)
    ]
    assert numbers == [i % 256 for i in range(300)]


@pytest.mark.parametrize(
    "build",
    [
        lambda: MavlinkEncoder(255),
        lambda: MavlinkEncoder(0),
        lambda: MavlinkEncoder(1, 1),
        lambda: StatusText(8, "x"),
        lambda: StatusText(4, ""),
        lambda: StatusText(4, "x" * 201),
        lambda: StatusText(4, "event twin\t"),
        lambda: StatusText(4, "Tauchgang \u00fcber 10 m"),
        lambda: CommandLong(400, (1.0, 2989.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1),
        lambda: CommandLong(176, (1.0,) * 6, 1),
        lambda: CommandLong(176, (math.inf,) * 7, 1),
        lambda: CommandLong(176, (0.0,) * 7, 0),
        lambda: CommandLong(0, (0.0,) * 7, 1),
        lambda: NamedValue("elevenchars", 0.0, 0.0),
        lambda: NamedValue("", 0.0, 0.0),
        lambda: NamedValue("STW", math.nan, 0.0),
        lambda: NamedValue("STW", 1e39, 0.0),
        lambda: ComputerStatus(math.nan, 0.0),
        lambda: ComputerStatus(0.0, 0.0, (math.inf,)),
        lambda: ComputerStatus(0.0, 0.0, memory_mib=(0, 2**32)),
        lambda: MavlinkEncoder(1).encode("heartbeat"),
    ],
)
def test_callers_mistakes_are_value_errors(build):
    with pytest.raises(ValueError, match="got"):
        build()

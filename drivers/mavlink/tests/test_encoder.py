"""What the gateway sends, read back by pymavlink."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.messages import CommandLong, CompanionHeartbeat, CompanionState, StatusText
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
        lambda: MavlinkEncoder(1).encode("heartbeat"),
    ],
)
def test_callers_mistakes_are_value_errors(build):
    with pytest.raises(ValueError, match="got"):
        build()

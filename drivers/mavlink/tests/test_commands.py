"""Commands to us: what is taken, what is refused, and what is not ours to answer."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.commands import DURATION_MAX_S, RATE_MAX
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.frames import Packet
from drivers.mavlink.messages import CommandAck
from drivers.mavlink.tests.peer import Peer
from drivers.readings import OperatorAct, OperatorRequest

ACKNOWLEDGE, ACCEPT, MUTE = OperatorAct
DENIED, UNSUPPORTED = 2, 3
COMMAND_LONG, COMMAND_INT = 76, 75
FLOAT32 = st.floats(width=32)


class PassAll:
    """A gate that lets everybody in, and finds those signed that it is told."""

    def __init__(self, signed):
        self.signed = signed

    def refusal(self, frame, packet, time_s):
        return ""


def command(number=ACKNOWLEDGE, code=3.0, duration_s=0.0, system=1, component=192, confirmation=0):
    rest = (0.0,) * 5
    return dialect.MAVLink_command_long_message(system, component, number, confirmation, code, duration_s, *rest)


def command_int(number=ACKNOWLEDGE, code=3.0, duration_s=0.0, system=1, component=192):
    return dialect.MAVLink_command_int_message(
        system, component, 0, number, 0, 0, code, duration_s, math.nan, math.nan, 0, 0, 0.0
    )


def ground_station():
    return Peer(255, 190)


def decoder(**options):
    return MavlinkDecoder([], autopilot_system=1, **options)


def test_an_operator_is_heard():
    decode, sender = decoder(), ground_station()
    assert decode.decode(sender.pack(command()), 5.0) == [OperatorRequest(5.0, ACKNOWLEDGE, 3, 0.0, 255, 190)]
    assert decode.decode(sender.pack(command(MUTE, 102.0, 60.0)), 5.1) == [
        OperatorRequest(5.1, MUTE, 102, 60.0, 255, 190)
    ]
    assert decode.answers() == [] and decode.drops == {}


@pytest.mark.parametrize("mavlink1", [False, True])
def test_the_other_form_of_a_command_and_the_old_protocol_are_heard_too(mavlink1):
    (request,) = decoder().decode(ground_station().pack(command_int(ACCEPT, 7.0), mavlink1=mavlink1), 5.0)
    assert request == OperatorRequest(5.0, ACCEPT, 7, 0.0, 255, 190)


def test_a_parameter_that_the_act_has_not_may_hold_anything():
    (request,) = decoder().decode(ground_station().pack(command(ACCEPT, 1.0, math.nan)), 0.0)
    assert request.duration_s == 0.0


@pytest.mark.parametrize(("system", "component"), [(1, 0), (0, 192), (0, 0), (1, 1), (1, 191), (2, 192)])
def test_what_is_not_addressed_to_us_is_not_ours(system, component):
    decode = decoder()
    assert decode.decode(ground_station().pack(command(system=system, component=component)), 0.0) == []
    assert decode.answers() == [] and decode.drops == {}


def test_before_there_is_an_autopilot_we_are_nobody():
    decode = MavlinkDecoder([])
    assert decode.decode(ground_station().pack(command(system=0)), 0.0) == []
    assert decode.decode(ground_station().pack(command()), 0.0) == []
    assert decode.answers() == []


@pytest.mark.parametrize("number", [400, 512, 176, 31013, 31014, 1, 65535])
def test_another_command_is_not_supported(number):
    decode = decoder()
    assert decode.decode(ground_station().pack(command(number)), 0.0) == []
    assert decode.answers() == [CommandAck(number, UNSUPPORTED, 255, 190)]
    assert decode.answers() == []
    assert decode.drops == {"command not supported": 1}


@pytest.mark.parametrize("sender", [Peer(254, 190), Peer(1, 1), Peer(1, 194), Peer(2, 1)])
def test_who_is_no_operator_is_denied(sender):
    decode = decoder(operators=[255, 250])
    assert decode.decode(sender.pack(command()), 0.0) == []
    (answer,) = decode.answers()
    assert (answer.command, answer.result) == (ACKNOWLEDGE, DENIED)
    assert decode.drops == {"command from no operator": 1}
    assert decode.decode(Peer(250, 1).pack(command()), 0.0)


def test_where_there_is_a_key_commands_must_be_signed_whatever_else_the_gate_lets_in():
    decode = decoder(gate=PassAll(signed=False))
    assert decode.decode(ground_station().pack(command()), 0.0) == []
    assert [answer.result for answer in decode.answers()] == [DENIED]
    assert decode.drops == {"command not signed": 1}


@pytest.mark.parametrize(
    ("number", "code", "duration_s"),
    [
        (ACKNOWLEDGE, math.nan, 0.0),
        (ACKNOWLEDGE, math.inf, 0.0),
        (ACCEPT, -1.0, 0.0),
        (ACCEPT, 2.5, 0.0),
        (ACCEPT, 256.0, 0.0),
        (MUTE, 3.0, math.nan),
        (MUTE, 3.0, -1.0),
        (MUTE, 3.0, 2.0 * DURATION_MAX_S),
        (MUTE, 3.0, math.inf),
    ],
)
def test_implausible_parameters_are_denied(number, code, duration_s):
    decode = decoder()
    assert decode.decode(ground_station().pack(command(number, code, duration_s)), 0.0) == []
    assert decode.answers() == [CommandAck(number, DENIED, 255, 190)]
    assert decode.drops == {"command with implausible parameters": 1}


def test_the_same_packet_by_two_routes_is_one_command_and_a_repetition_another():
    decode, sender = decoder(), ground_station()
    packet = sender.pack(command())
    assert len(decode.decode(packet + packet, 0.0)) == 1
    assert decode.decode(packet, 0.5) == []
    assert decode.drops["command by another route"] == 2
    assert len(decode.decode(sender.pack(command(confirmation=1)), 1.0)) == 1  # it missed our answer
    assert len(decode.decode(packet, 5.0)) == 1  # sequence numbers come again


def test_strangers_make_us_say_little_and_cannot_drown_the_operator():
    decode, stranger, operator = decoder(), Peer(77, 1), ground_station()
    for number in range(200):
        decode.decode(stranger.pack(command(400 + number)), number / 1000.0)
    assert len(decode.decode(operator.pack(command()), 0.2)) == 1
    assert len(decode.answers()) == RATE_MAX
    assert decode.drops[f"commands beyond {RATE_MAX} a second"] == 200 - RATE_MAX
    decode.decode(stranger.pack(command(400)), 1.1)
    assert len(decode.answers()) == 1


def test_an_operator_with_a_stuck_button_is_heard_ten_times_a_second():
    decode, operator = decoder(), ground_station()
    heard = [decode.decode(operator.pack(command()), n / 50.0) for n in range(100)]
    assert sum(map(len, heard)) == 2 * RATE_MAX


def test_nobody_is_not_answered():
    decode = decoder()
    assert decode.decode(Peer(0, 0).pack(command()), 0.0) == []
    assert decode.answers() == [] and decode.drops == {"command from nobody": 1}


def test_answers_that_nobody_sends_do_not_pile_up():
    decode, stranger = decoder(), Peer(77, 1)
    for number in range(500):
        decode.decode(stranger.pack(command(400 + number)), float(number))
    assert len(decode.answers()) == 64


@given(
    st.sampled_from([COMMAND_LONG, COMMAND_INT]),
    st.one_of(st.binary(max_size=60), st.binary(min_size=28, max_size=28).map(lambda b: b + b"\x22\x79\x01\xc0")),
    st.integers(0, 255),
    st.integers(0, 255),
    st.booleans(),
)
def test_no_payload_raises_and_every_one_comes_to_one_end(message_id, payload, system, component, signed):
    decode = decoder()
    packet = Packet(message_id, system, component, payload, 0, signed)
    readings = decode._addressed(packet, 1.0)
    answers = decode.answers()
    assert len(readings) + len(answers) <= 1
    for request in readings:
        assert request.system_id == 255
        assert 0 <= request.code <= 255 and 0.0 <= request.duration_s <= DURATION_MAX_S
    assert len(answers) == 0 or sum(decode.drops.values()) == 1


@given(st.sampled_from(list(OperatorAct)), FLOAT32, FLOAT32)
def test_any_parameters_are_taken_as_they_are_or_denied(act, code, duration_s):
    decode = decoder()
    readings = decode.decode(ground_station().pack(command(act, code, duration_s)), 0.0)
    plausible = code in range(256) and (act is not MUTE or 0.0 <= duration_s <= DURATION_MAX_S)
    assert len(readings) == int(plausible)
    assert [answer.result for answer in decode.answers()] == ([] if plausible else [DENIED])
    if plausible:
        assert (readings[0].act, readings[0].code) == (act, code)

"""An autopilot that answers late, wrongly or not at all, that signs, and that answers the time."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.commander import Estimates
from hil_tests.rig.commands import Command, Result
from hil_tests.rig.conduct import NOT_SHOWN, SILENCE, Conduct, Reply
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Motion

KEY = bytes(range(32))
START_S = 1_700_000_000.0


class Talk:
    """A companion with pymavlink's own codec, and an autopilot, without a wire."""

    def __init__(self, key: bytes | None = None, **options) -> None:
        self.ardusub = ArduSub()
        self.said: list[bytes] = []
        self.autopilot = MavlinkAutopilot(self.said.append, self.ardusub, key=key, **options)
        self.codec = self.new_codec(key)

    def new_codec(self, key: bytes | None, system: int = 1) -> mavlink.MAVLink:
        codec = mavlink.MAVLink(None, srcSystem=system, srcComponent=192)
        codec.robust_parsing = True
        codec.signing.secret_key, codec.signing.sign_outgoing = key, key is not None
        codec.signing.timestamp = round((START_S - 1_420_070_400) * 1e5)
        return codec

    def command(self, time_s: float, command: int, *parameters: float, confirmation: int = 0, codec=None) -> list:
        """Sends it, and gives back all acknowledgements."""
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        message = mavlink.MAVLink_command_long_message(1, 1, command, confirmation, *padded)
        self.autopilot.receive(time_s, message.pack(codec or self.codec))
        return list(self.heard("COMMAND_ACK"))

    def advance(self, time_s: float) -> None:
        self.autopilot.advance(time_s, Telemetry(time_s - START_S, Motion(), (0.0,) * 8))

    def heard(self, kind: str) -> Iterator:
        said, self.said[:] = list(self.said), []
        for datagram in said:
            for message in self.codec.parse_buffer(datagram) or []:
                if message.get_type() == kind:
                    yield message


def test_replies_come_in_their_order_then_as_they_should():
    talk = Talk()
    talk.autopilot.conduct.then(
        Command.DO_SET_MODE, SILENCE, Reply(Result.TEMPORARILY_REJECTED), NOT_SHOWN, second=2.0
    )
    results = [[ack.result for ack in talk.command(START_S + n, 176, 1, 2)] for n in range(3)]
    assert results == [[], [Result.TEMPORARILY_REJECTED], [Result.ACCEPTED]]
    assert talk.ardusub.mode is Mode.MANUAL
    assert [ack.result for ack in talk.command(START_S + 3.0, 176, 1, 9)] == [Result.ACCEPTED]
    assert talk.ardusub.mode is Mode.SURFACE
    talk.command(START_S + 4.0, 176, 1, 2, confirmation=3)
    assert talk.ardusub.mode is Mode.ALT_HOLD
    noted = [(command.result, command.confirmation) for command in talk.autopilot.notes.commands]
    assert noted[0] == (None, 0) and noted[-1] == (Result.ACCEPTED, 3)


def test_one_reply_can_stand_for_all():
    talk = Talk(conduct=Conduct())
    talk.autopilot.conduct.always(Command.DO_SET_MODE, Reply(Result.DENIED))
    assert [talk.command(START_S, 176, 1, mode)[0].result for mode in (2, 9, 2)] == [Result.DENIED] * 3
    talk.autopilot.conduct.always(Command.DO_SET_MODE, Reply(None, obeyed=True), second=2.0)
    assert talk.command(START_S, 176, 1, 2) == []
    assert talk.ardusub.mode is Mode.ALT_HOLD


def test_an_answer_in_progress_is_given_later():
    talk = Talk()
    talk.autopilot.conduct.then(Command.DO_SET_MODE, Reply(Result.ACCEPTED, obeyed=True, after_s=2.0))
    assert [ack.result for ack in talk.command(START_S, 176, 1, 2)] == [Result.IN_PROGRESS]
    talk.advance(START_S + 1.9)
    assert not list(talk.heard("COMMAND_ACK"))
    talk.advance(START_S + 2.0)
    [ack] = talk.heard("COMMAND_ACK")
    assert (ack.result, ack.target_system, ack.target_component) == (Result.ACCEPTED, 1, 192)


def test_commands_of_others_than_the_ground_station_can_be_ignored():
    talk = Talk(conduct=Conduct(ground_station_only=True))
    assert talk.command(START_S, 176, 1, 2) == []
    assert talk.autopilot.notes.commands[0].result is None
    assert talk.command(START_S, 176, 1, 2, codec=talk.new_codec(None, system=255))[0].result == Result.ACCEPTED


def test_modes_that_need_an_unknown_depth_fail_with_a_text():
    talk = Talk()
    talk.ardusub.estimates = Estimates(depth=False)
    [ack] = talk.command(START_S, 176, 1, 2)
    assert ack.result == Result.FAILED
    talk.command(START_S, 176, 1, 2)
    texts = [message.text for message in talk.heard("STATUSTEXT")]
    assert texts == []  # the acknowledgements above took it
    assert talk.ardusub.answer(176, (1.0, 2.0)).text == "Mode change failed: ALT_HOLD need alt estimate"


def test_a_signed_autopilot_takes_only_what_is_signed_with_its_key():
    talk = Talk(KEY)
    talk.advance(START_S)
    assert talk.command(START_S, 176, 1, 2)[0].result == Result.ACCEPTED
    assert talk.command(START_S, 176, 1, 9, codec=talk.new_codec(None)) == []
    assert talk.command(START_S, 176, 1, 9, codec=talk.new_codec(bytes(32))) == []
    assert talk.autopilot.notes.counts["BAD_DATA"] == 2
    assert talk.ardusub.mode is Mode.ALT_HOLD


def test_its_signatures_go_on_after_a_restart():
    talk = Talk(KEY)
    beats = 0
    for second in range(20):
        talk.advance(START_S + second)
        beats += len(list(talk.heard("HEARTBEAT")))
        if second == 9:
            talk.autopilot.restart(START_S + second, silent_s=1.5)
    assert beats == 19  # the second after the restart is silent
    assert talk.codec.signing.badsig_count == 0


@pytest.mark.parametrize("key", [None, KEY])
def test_it_answers_the_time_and_asks_for_it(key):
    talk = Talk(key)
    talk.advance(START_S + 12.5)
    asked = [message for message in talk.heard("TIMESYNC") if message.tc1 == 0]
    assert len(asked) == 1
    talk.autopilot.receive(START_S + 12.6, mavlink.MAVLink_timesync_message(0, 4711).pack(talk.codec))
    [answer] = talk.heard("TIMESYNC")
    assert (answer.ts1, answer.tc1) == (4711, 12_500_000_001)
    talk.autopilot.receive(START_S + 12.7, mavlink.MAVLink_timesync_message(99, asked[0].ts1).pack(talk.codec))
    assert talk.autopilot.notes.clock_answers == 1


def test_a_time_below_zero_is_refused():
    with pytest.raises(ValueError, match="after_s = -1"):
        Reply(Result.ACCEPTED, after_s=-1.0)

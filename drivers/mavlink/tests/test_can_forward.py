"""CAN over MAVLink: an autopilot played by hand, with the time in our hand too."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFilter, CanFrame
from drivers.mavlink.can_filter import filter_messages, forwarding_ids
from drivers.mavlink.can_forward import COMMAND_CAN_FORWARD, REFUSED_PERIOD_S, SILENCE_S, CanForward
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.forwarded_frames import ForwardedFrame, ForwardedFrames
from drivers.mavlink.messages import CanFilterModify, CommandLong, CommandResult, FilterOperation
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import AutopilotHeartbeat, AutopilotReboot, CommandAcknowledgement, LinkState

IDS = (341, 1034)
ARDUPILOT, PX4 = 3, 12
EXTENDED, REMOTE, ERROR = 1 << 31, 1 << 30, 1 << 29


def heartbeat(time_s, system_id=1, autopilot=ARDUPILOT):
    return AutopilotHeartbeat(time_s, system_id, 1, autopilot, 12, False, 19, 4)


def answer(time_s, result=CommandResult.ACCEPTED, system_id=1):
    return CommandAcknowledgement(time_s, system_id, 1, COMMAND_CAN_FORWARD, result, 255)


def forwarded(time_s, bus=1):
    return ForwardedFrame(bus, CanFrame(time_s, 0x1404_0A0B, b"\x01\xc0"))


class Played:
    """A bus that is asked for, second by second."""

    def __init__(self, bus=1, ids=IDS, autopilot=ARDUPILOT):
        self.forward = CanForward("can0", bus, ids)
        self.autopilot = autopilot
        self.time_s = 0.0
        self.asked, self.states = [], []

    def second(self, *readings, frames=(), beats=True):
        """The next second: what comes in it, and what follows."""
        self.time_s += 1.0
        beat = [heartbeat(self.time_s, autopilot=self.autopilot)] if beats else []
        timed = [reading(self.time_s) if callable(reading) else reading for reading in readings]
        ours = self.forward.frames([make(self.time_s) for make in frames])
        asked = self.forward.update([*beat, *timed], self.time_s)
        state = self.forward.state(self.time_s)
        self.asked.append(asked)
        self.states += [] if state is None else [(state.up, state.detail)]
        return ours

    def seconds(self, count, *readings, **options):
        for _ in range(count):
            self.second(*readings, **options)

    def requests(self):
        return [[one.parameters[0] for one in asked if isinstance(one, CommandLong)] for asked in self.asked]


def test_nothing_is_asked_of_nobody():
    forward = CanForward("can0", 1, IDS)
    assert forward.update([], 0.0) == []
    assert forward.state(10.0) is None
    assert forward.stop(10.0) == []


def test_filter_comes_first_and_both_come_every_second():
    played = Played(bus=2)
    played.seconds(3, answer, frames=[lambda t: forwarded(t, 2)])
    for asked in played.asked:
        wanted, request = asked
        assert wanted == CanFilterModify(2, FilterOperation.REPLACE, IDS, 1, 1)
        assert (request.command, request.parameters[0], request.target_component) == (32000, 2.0, 1)
    assert played.forward.update([], played.time_s + 0.5) == []


def test_no_filter_takes_away_what_somebody_else_has_left():
    played = Played(ids=None)
    played.second()
    assert played.asked[0][0] == CanFilterModify(1, FilterOperation.REPLACE, (), 1, 1)


def test_long_list_replaces_once_and_is_then_only_completed():
    played = Played(ids=tuple(range(40)))
    played.seconds(2)
    operations = [[one.operation for one in asked[:-1]] for asked in played.asked]
    replace, add = FilterOperation.REPLACE, FilterOperation.ADD
    assert operations == [[replace, add, add], [add, add, add]]
    assert [one for part in played.asked[1][:-1] for one in part.ids] == list(range(40))
    played.second(AutopilotReboot(played.time_s, 1))
    assert [one.operation for one in played.asked[-1][:-1]] == [replace, add, add]


def test_frames_say_that_it_is_up_whatever_became_of_the_answers():
    played = Played()
    assert played.second(frames=[forwarded]) == [forwarded(1.0).frame]
    assert played.states == [(True, "")]


def test_a_grant_alone_says_so_too():
    played = Played()
    played.seconds(20, answer)
    assert played.states == [(True, "")]
    assert played.forward.frames([]) == []


@pytest.mark.parametrize(
    ("result", "autopilot", "why"),
    [
        (CommandResult.FAILED, ARDUPILOT, "autopilot has no CAN1 (CAN_P1_DRIVER)"),
        (CommandResult.UNSUPPORTED, PX4, "PX4 does not forward CAN"),
        (CommandResult.UNSUPPORTED, ARDUPILOT, "autopilot does not forward CAN"),
        (CommandResult.DENIED, ARDUPILOT, "forwarding denied"),
        (9, ARDUPILOT, "forwarding result 9"),
    ],
)
def test_refusal_is_told_with_its_reason_and_asked_again_rarely(result, autopilot, why):
    played = Played(autopilot=autopilot)
    played.seconds(30, lambda t: answer(t, result))
    assert played.states == [(False, why)]
    assert sum(map(len, played.requests())) <= 2 + 30 / REFUSED_PERIOD_S
    played.second(answer, frames=[forwarded])
    assert played.states[-1] == (True, "")
    played.seconds(3, answer, frames=[forwarded])
    assert played.requests()[-3:] == [[1.0]] * 3


def test_not_now_is_no_refusal():
    played = Played()
    played.seconds(3, lambda t: answer(t, CommandResult.TEMPORARILY_REJECTED))
    assert played.states == []
    assert played.requests() == [[1.0]] * 3


def test_no_answer_at_all_is_told():
    played = Played()
    played.seconds(10)
    assert played.states == [(False, "autopilot does not answer")]
    assert played.requests() == [[1.0]] * 10


def test_lost_frames_and_answers_are_no_news():
    played = Played()
    for n in range(60):
        played.second(*([answer] if n % 4 == 0 else []), frames=[forwarded] if n % 3 == 0 else [])
    assert played.states == [(True, "")]


def test_answers_of_other_autopilots_mean_nothing():
    played = Played()
    played.seconds(4, lambda t: answer(t, CommandResult.FAILED, system_id=2))
    assert played.states == []


def test_another_program_that_takes_it_over_is_told():
    played = Played()
    played.seconds(3, answer, frames=[forwarded])
    played.seconds(8, answer, frames=[lambda t: forwarded(t, bus=2)])
    assert played.states == [(True, ""), (True, "another program has CAN2 forwarded")]
    assert played.forward.drops == Counter({"frame of another bus": 8})
    assert played.forward.stop(played.time_s) == []  # it is not ours to end
    played = Played()
    played.seconds(3, answer, frames=[forwarded])
    played.seconds(8, answer)
    assert played.states == [(True, ""), (True, "no frames; has another program taken it?")]


@pytest.mark.parametrize("news", [AutopilotReboot(3.5, 1), LinkState(3.5, "mavlink", False, "silent for 6 s")])
def test_restart_of_autopilot_or_link_is_no_state_of_the_bus_and_all_is_asked_anew(news):
    played = Played(ids=tuple(range(20)))
    played.seconds(3, answer, frames=[forwarded])
    played.asked.append(played.forward.update([news], 3.5))
    played.seconds(4, beats=False)
    played.second()
    assert FilterOperation.REPLACE in [one.operation for asked in played.asked[3:] for one in asked[:-1]]
    played.second(frames=[forwarded])
    assert played.states == [(True, "")]


def test_silent_autopilot_says_nothing_of_the_bus():
    played = Played()
    played.seconds(3, answer, frames=[forwarded])
    played.seconds(20, beats=False)
    assert played.states == [(True, "")]


def test_stop_ends_the_forwarding_and_leaves_no_filter():
    played = Played()
    played.seconds(2, answer)
    request, nothing = played.forward.stop(played.time_s)
    assert (request.command, request.parameters[0]) == (COMMAND_CAN_FORWARD, 0.0)
    assert nothing == CanFilterModify(1, FilterOperation.REPLACE, (), 1, 1)
    assert played.forward.update([], played.time_s + 5.0) == []
    assert played.forward.stop(played.time_s) == []


def test_stop_of_what_was_never_granted_is_not_asked_for():
    played = Played()
    played.seconds(2, lambda t: answer(t, CommandResult.FAILED))
    assert played.forward.stop(played.time_s + SILENCE_S) == []


# The filter ---------------------------------------------------------------------------------------


def compared(identifier):
    """What ArduPilot compares, by AP_MAVLinkCAN.cpp."""
    if not identifier & 0xFF:
        return 0
    return (identifier >> 16) & 0xFF if identifier & 0x80 else (identifier >> 8) & 0xFFFF


@pytest.mark.parametrize(
    ("wanted", "ids"),
    [
        (CanFilter(1034 << 8, 0x00FF_FF80, extended=True), (1034,)),
        (CanFilter(9 << 8 | 3, EXTENDED_MASK, extended=True), (9,)),  # VESC: STATUS of controller 3
        (CanFilter(9 << 8 | 0x83, EXTENDED_MASK, extended=True), (0,)),  # ... of controller 131
        (CanFilter(0x201, STANDARD_MASK, extended=False), (2,)),
        (CanFilter(0x281, STANDARD_MASK, extended=False), (0,)),
        (CanFilter(0x200, STANDARD_MASK, extended=False), (0,)),
        (CanFilter(0x201, 0x0FF, extended=False), None),
        (CanFilter(0, 0, extended=True), None),
    ],
)
def test_ids_of_a_filter(wanted, ids):
    assert forwarding_ids([wanted]) == ids


def test_one_filter_that_cannot_be_said_is_none_at_all():
    assert forwarding_ids([CanFilter(1034 << 8, 0x00FF_FF80, extended=True), CanFilter(0, 0, extended=True)]) is None
    assert forwarding_ids([]) is None


@st.composite
def filters(draw):
    extended = draw(st.booleans())
    limit = EXTENDED_MASK if extended else STANDARD_MASK
    full = draw(st.integers(0, limit) | st.just(limit) | st.just(limit & 0xFFFF80))
    return CanFilter(draw(st.integers(0, limit)), full, extended)


@given(st.lists(filters(), min_size=1, max_size=4), st.data())
def test_no_frame_that_is_wanted_is_filtered_out(wanted, data):
    ids = forwarding_ids(wanted)
    one = data.draw(st.sampled_from(wanted))
    limit = EXTENDED_MASK if one.extended else STANDARD_MASK
    identifier = one.identifier & one.mask | data.draw(st.integers(0, limit)) & ~one.mask & limit
    assert one.matches(CanFrame(0.0, identifier, b"", extended=one.extended))
    anonymous = identifier & 0xFF == 0 and one.mask & 0xFF != 0xFF
    assert ids is None or anonymous or compared(identifier) in ids


def test_filter_on_the_wire():
    (message,) = filter_messages((341, 1034), 2, 7, 1, anew=False)
    (read,) = messages_in(MavlinkEncoder(1).encode(message))
    assert (read.get_msgId(), read.target_system, read.target_component, read.bus) == (388, 7, 1, 2)
    assert (read.operation, read.num_ids, read.ids) == (0, 2, [341, 1034] + [0] * 14)


@pytest.mark.parametrize("broken", [{"bus": 0}, {"bus": 10}, {"ids": (1,) * 17}, {"ids": (65536,)}, {"ids": (-1,)}])
def test_filter_out_of_its_bounds_is_refused(broken):
    with pytest.raises(ValueError, match="must"):
        CanFilterModify(**{"bus": 1, "operation": FilterOperation.ADD, "ids": (), "target_system": 1, **broken})


# The frames ---------------------------------------------------------------------------------------


def decoded(*messages, system=1, wanted=True):
    """What a decoder makes of an autopilot's messages."""
    peer, drops = Peer(), Counter()
    frames = ForwardedFrames(drops)
    decoder = MavlinkDecoder([], can_frames=frames if wanted else None)
    decoder.decode(peer.heartbeat(), 0.0)
    sender = peer if system == 1 else Peer(system)
    for message in messages:
        assert decoder.decode(sender.pack(message), 1.0) == []
    return frames.take(), drops, decoder


def classic(word, data, bus=0, length=None):
    length = len(data) if length is None else length
    return dialect.MAVLink_can_frame_message(1, 192, bus, length, word, data.ljust(8, b"\0"))


def flexible(word, data, bus=0, length=None):
    length = len(data) if length is None else length
    return dialect.MAVLink_canfd_frame_message(1, 192, bus, length, word, data.ljust(64, b"\0"))


def test_frames_come_out_with_their_bus_kind_and_time():
    frames, drops, _ = decoded(
        classic(EXTENDED | 0x1404_0A0B, b"\x01\x02\xc0"),
        classic(0x123, b"", bus=1),
        flexible(EXTENDED | 0x55, bytes(range(12))),
    )
    assert frames == [
        ForwardedFrame(1, CanFrame(1.0, 0x1404_0A0B, b"\x01\x02\xc0")),
        ForwardedFrame(2, CanFrame(1.0, 0x123, b"", extended=False)),
        ForwardedFrame(1, CanFrame(1.0, 0x55, bytes(range(12)), fd=True)),
    ]
    assert not drops


@pytest.mark.parametrize(
    ("message", "cause"),
    [
        (classic(EXTENDED | REMOTE | 5, b""), "remote frame"),
        (classic(ERROR | 5, b""), "error frame"),
        (classic(EXTENDED | 5, b"", length=9), "malformed frame"),
        (classic(0x800, b""), "malformed frame"),
        (flexible(EXTENDED | 5, b"", length=9), "malformed frame"),
        (flexible(EXTENDED | 5, b"", length=65), "malformed frame"),
    ],
)
def test_what_is_no_data_frame_is_dropped_and_counted(message, cause):
    frames, drops, _ = decoded(message)
    assert frames == []
    assert drops == Counter({cause: 1})


def test_frames_of_other_autopilots_are_not_taken():
    frames, _, decoder = decoded(classic(EXTENDED | 5, b""), system=2)
    assert frames == []
    assert decoder.drops["not our autopilot"] == 1


def test_frames_that_nobody_wants_are_not_unpacked():
    frames, _, decoder = decoded(classic(EXTENDED | 5, b""), wanted=False)
    assert frames == []
    assert not decoder.heard


@given(st.integers(0, 2**32 - 1), st.integers(0, 255), st.integers(0, 255), st.binary(max_size=64), st.booleans())
def test_no_values_make_it_raise(word, bus, length, data, fd):
    drops = Counter()
    frames = ForwardedFrames(drops)
    padded = data.ljust(64, b"\0")[: 64 if fd else 8]
    (frames.fd if fd else frames.classic)((word, 1, 192, bus, length, padded), 1.0)
    taken = frames.take()
    assert len(taken) + drops.total() == 1
    assert all(one.bus == bus + 1 and len(one.frame.data) == length for one in taken)

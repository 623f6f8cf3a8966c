"""The pipeline: from readings to texts; the same whatever the calls; nonsense is counted and accuses nobody."""

import math
import random
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detectors.verdict import Level
from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.frame import CanFrame
from drivers.mavlink.messages import StatusText
from drivers.readings import (
    AutopilotConflict,
    AutopilotHeartbeat,
    CommandAcknowledgement,
    LinkState,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.channel import ThrusterJudgement
from gateway.config import Config
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Now, Pipeline
from gateway.severity import Severity
from gateway.supervision.actions import Action
from gateway.tests.conftest import FULL_RPM, ThresholdDetector
from gateway.wiring import can_decoder, mavlink_decoder

START_S = 1.7e9
RATE_HZ = 50


def fraction(time_s: float) -> float:
    return 0.5 + 0.3 * math.sin(0.5 * (time_s - START_S))


def drive(seconds: float, fault_s: float = math.inf, start_s: float = START_S) -> list[tuple[str, list]]:
    """Two thrusters; thruster 2 loses a fifth of its speed at `fault_s`, and its command comes over MAVLink."""
    arrivals = []
    for n in range(round(seconds * RATE_HZ)):
        time_s = start_s + n / RATE_HZ
        arrivals.append(("can0", [ThrusterCommand(time_s, 1, fraction(time_s))]))
        share = 0.8 if n / RATE_HZ >= fault_s else 1.0
        speeds = (FULL_RPM * fraction(time_s), share * FULL_RPM * fraction(time_s))
        reports = [ThrusterReport(time_s + 0.004, k, rpm, 16.0, 3.0) for k, rpm in enumerate(speeds, start=1)]
        arrivals.append(("can0", reports))
        if n % 3 == 0:  # 17 Hz, late
            arrivals.append(("mavlink", [ThrusterCommand(time_s + 0.006, 2, fraction(time_s))]))
        if n % RATE_HZ == 0:
            arrivals.append(("mavlink", [AutopilotHeartbeat(time_s + 0.006, 1, 1, 3, 12, True, 19, 4)]))
    return arrivals


def play(pipeline: Pipeline, arrivals: list[tuple[str, list]]) -> list:
    return [outcome for link, readings in arrivals for outcome in pipeline.feed(link, readings)]


def pipeline(config: Config) -> Pipeline:
    return Pipeline(config, Factories(thruster=ThresholdDetector))


def findings(outcomes: list) -> list[Finding]:
    return [outcome for outcome in outcomes if isinstance(outcome, Finding)]


def faults(outcomes: list) -> list[Finding]:
    return [finding for finding in findings(outcomes) if finding.level is Level.FAULT]


def texts(outcomes: list) -> list[str]:
    """What the pilot reads, but for what is no news of a fault."""
    said = [outcome for outcome in outcomes if isinstance(outcome, StatusText)]
    return [outcome.text for outcome in said if outcome.severity < Severity.INFO]


def test_healthy_thrusters_are_judged_and_nobody_is_bothered(config):
    watched = pipeline(config)
    outcomes = play(watched, drive(12.0))
    judged = [outcome.thruster for outcome in outcomes if isinstance(outcome, ThrusterJudgement)]
    assert judged.count(1) >= 12 * RATE_HZ - 2 and judged.count(2) >= 12 * RATE_HZ - 4
    assert texts(outcomes) == []
    assert {finding.level for finding in findings(outcomes)} == {Level.NORMAL}
    assert watched.levels()["thruster 2"] is Level.NORMAL
    assert watched.drops() == {}
    assert watched.newest["thruster 2"].sample.voltage_v == 16.0


def test_fault_is_told_within_three_samples_of_showing(config):
    outcomes = play(pipeline(config), drive(8.0, fault_s=5.0))
    (fault,) = faults(outcomes)
    assert fault.subject == "thruster 2"
    assert 5.0 <= fault.time_s - START_S <= 5.0 + 3 / RATE_HZ
    assert fault.text.startswith("T2 entangled? ") and fault.text.endswith("%)")
    assert fault.text in texts(outcomes)


def test_failsafe_is_asked_and_its_answer_recorded(config):
    sections = config.failsafe.model_copy(update={"thruster_fault": (Action.HOLD,), "delay_s": 0.0})
    watched = pipeline(replace(config, failsafe=sections))
    outcomes = play(watched, drive(5.5, fault_s=5.0))
    answer = CommandAcknowledgement(START_S + 5.5, 1, 1, 176, 0, 255)
    outcomes += watched.feed("mavlink", [answer])
    assert "Hold done for T2" not in texts(outcomes)  # said is not done
    outcomes += watched.feed("mavlink", [AutopilotHeartbeat(START_S + 5.6, 1, 1, 3, 12, True, 2, 4)])
    assert "Hold done for T2" in texts(outcomes)
    (command,) = [outcome for outcome in outcomes if type(outcome).__name__ == "CommandLong"]
    assert (command.command, command.parameters[1], command.target_system) == (176, 2.0, 1)


@settings(max_examples=10)
@given(st.lists(st.integers(0, 900), max_size=30), st.randoms(use_true_random=False))
def test_same_findings_however_advance_is_called_and_readings_are_batched(config_once, places, chance):
    arrivals = drive(6.0, fault_s=4.0)
    expected = findings(play(pipeline(config_once), arrivals))
    watched, found, last_s = pipeline(config_once), [], START_S
    for n, (link, readings) in enumerate(arrivals):
        for reading in readings:
            if n in places:
                found += watched.advance(last_s + chance.random() * (reading.time_s - last_s))
            found += watched.feed(link, [reading])
            last_s = reading.time_s
    lines = [finding.json_line() for finding in findings(found)]
    assert lines == [finding.json_line() for finding in expected]


def as_events(arrivals: list[tuple[str, list]]) -> list:
    """One event for each reading, and the time before each of them."""
    readings = [(link, reading) for link, together in arrivals for reading in together]
    return [event for link, one in readings for event in (Now(one.time_s), Arrival(link, [one]))]


def in_batches(watched: Pipeline, events: list, cuts: list[int]) -> list:
    starts = sorted({0, *(cut for cut in cuts if cut < len(events)), len(events)})
    return [outcome for start, stop in pairwise(starts) for outcome in watched.take(events[start:stop])]


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(0, 3500), max_size=40))
def test_batches_of_any_length_give_the_outcomes_of_one_by_one_in_their_order(config_once, cuts):
    events = as_events([*drive(6.0, fault_s=4.0), ("can0", [LinkState(START_S + 6.0, "can0", False, "gone")])])
    one_by_one, batched = pipeline(config_once), pipeline(config_once)
    expected = in_batches(one_by_one, events, list(range(len(events))))
    assert repr(in_batches(batched, events, cuts)) == repr(expected)
    assert batched.snapshot() == one_by_one.snapshot()


def test_the_real_detector_says_the_same_in_batches_bit_for_bit(config_once):
    arrivals = drive(16.0, fault_s=13.0)
    expected = play(Pipeline(config_once), arrivals)
    assert faults(expected)
    chance = random.Random(5)
    cuts = [chance.randrange(2 * len(arrivals)) for _ in range(60)]
    events = [Arrival(link, readings) for link, readings in arrivals]
    assert repr(in_batches(Pipeline(config_once), events, cuts)) == repr(expected)


@pytest.fixture(scope="module")
def config_once(tmp_path_factory):
    from gateway.config import parse
    from gateway.tests.conftest import TWO_THRUSTERS

    return parse(TWO_THRUSTERS, tmp_path_factory.mktemp("config"))


@pytest.mark.parametrize("cut", [1, 333, 700])
def test_restored_from_a_snapshot_it_goes_on_bit_for_bit(config, cut):
    arrivals = drive(6.0, fault_s=4.0)
    whole, first = pipeline(config), pipeline(config)
    expected = play(whole, arrivals)
    before = play(first, arrivals[:cut])
    after = play(Pipeline.restore(first.snapshot()), arrivals[cut:])
    assert repr(before + after) == repr(expected)


def test_snapshot_of_something_else_is_refused():
    import pickle

    with pytest.raises(ValueError, match="want a Pipeline"):
        Pipeline.restore(pickle.dumps([1]))


def test_what_was_learnt_is_recalled_where_it_fits(config):
    learning = replace(config, align=config.align.model_copy(update={"sample_rate_hz": None}))
    old, new = pipeline(learning), pipeline(learning)
    play(old, drive(8.0))
    assert new.recall(old.learnt()) == []
    outcomes = play(new, drive(1.0, start_s=START_S + 1000.0))
    verdicts = [outcome.verdict.level for outcome in outcomes if isinstance(outcome, ThrusterJudgement)]
    assert len(verdicts) > RATE_HZ and set(verdicts) == {Level.NORMAL}  # neither rate nor curve is learnt again


def test_other_settings_keep_the_commissioned_curve_and_other_sources_nothing(config):
    old = pipeline(config)
    play(old, drive(4.0))
    old.learnt()["thruster 1"].detector.commissioned = "curve"
    other = pipeline(replace(config, align=config.align.model_copy(update={"gap_s": 0.2})))
    assert other.recall(old.learnt()) == []
    detector = other.learnt()["thruster 1"].detector
    assert (detector.commissioned, detector.samples) == ("curve", 0)
    turned = config.thruster[0].command.model_copy(update={"bidirectional": False})
    rewired = (config.thruster[0].model_copy(update={"command": turned}), config.thruster[1])
    assert pipeline(replace(config, thruster=rewired)).recall(old.learnt()) == ["thruster 1"]


def test_accept_reaches_detector_and_supervisor(config):
    watched = pipeline(config)
    play(watched, drive(6.0, fault_s=4.0))
    assert texts(watched.accept("thruster 2", START_S + 6.0)) == ["T2 fault cleared: operator accepted"]
    assert watched.learnt()["thruster 2"].detector.accepted == 1
    with pytest.raises(ValueError, match="want one of thruster 1, thruster 2"):
        watched.accept("thruster 3", START_S)


def test_silent_rpm_is_found_by_time_alone_and_is_no_fault(config):
    watched = pipeline(config)
    play(watched, drive(4.0))
    outcomes = []
    for n in range(20):
        time_s = START_S + 4.0 + n / 5
        outcomes += watched.feed("mavlink", [AutopilotHeartbeat(time_s, 1, 1, 3, 12, True, 19, 4)])
        outcomes += watched.feed("can0", [ThrusterReport(time_s, 1, FULL_RPM * fraction(START_S + 4.0))])
    assert sorted(texts(outcomes)) == ["Commands silent 1.5 s", "T1 command silent 1.5 s", "T2 ESC silent 1.5 s"]
    assert faults(outcomes) == []
    outcomes = []
    for n in range(200):
        outcomes += watched.advance(START_S + 8.0 + n / 10)
    assert texts(outcomes) == ["can0 silent 1.6 s", "mavlink silent 5.1 s"]


def test_readings_of_another_source_than_the_configured_one_are_counted(config):
    watched = pipeline(config)
    play(watched, drive(4.0))
    watched.feed("can0", [ThrusterCommand(START_S + 4.0, 2, -1.0)])  # thruster 2 is commanded over MAVLink
    watched.feed("mavlink", [ThrusterReport(START_S + 4.0, 2, 0.0), ThrusterReport(START_S + 4.0, 77, 0.0)])
    assert watched.drops() == {"not the configured source": 3}
    assert watched.newest["thruster 2"].sample.speed_rpm > 0.0


def test_several_autopilots_are_told_until_one_is_left(config):
    watched = pipeline(config)
    told = texts(watched.feed("mavlink", [AutopilotConflict(START_S, (1, 7))]))
    assert told == ["mavlink has several autopilots: 1, 7"]
    beat = AutopilotHeartbeat(START_S, 1, 1, 3, 12, True, 19, 4)  # the one that was known before
    for n in range(6):
        assert texts(watched.feed("mavlink", [replace(beat, time_s=START_S + n)])) == []
    watched.feed("mavlink", [AutopilotConflict(START_S + 6.0, (1,))])
    over = [
        text for n in range(6, 12) for text in texts(watched.feed("mavlink", [replace(beat, time_s=START_S + n)]))
    ]
    assert over == ["mavlink ok again"]


def test_link_down_and_up_again(config):
    watched = pipeline(config)
    play(watched, drive(4.0))
    told = texts(watched.feed("can0", [LinkState(START_S + 4.0, "can0", False, "interface is down")]))
    told += texts(watched.advance(START_S + 4.2))
    assert told == ["can0 down: interface is down"]
    watched.feed("can0", [LinkState(START_S + 4.3, "can0", True, "")])
    assert texts(play(watched, drive(4.0, start_s=START_S + 4.4))) == ["can0 ok again"]


times = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(START_S, START_S + 30.0))
numbers = st.integers(-1, 4)
anything = st.one_of(
    st.builds(ThrusterCommand, times, numbers, st.floats()),
    st.builds(ThrusterReport, times, numbers, st.floats(), st.floats(), st.floats()),
    st.builds(LinkState, times, st.sampled_from(["can0", "mavlink", "x"]), st.booleans(), st.text(max_size=60)),
    st.builds(AutopilotHeartbeat, times, st.integers(0, 255), st.just(1), st.integers(0, 20), st.integers(0, 40),
              st.booleans(), st.integers(0, 99), st.integers(0, 9)),
    st.builds(CommandAcknowledgement, times, numbers, numbers, st.integers(0, 600), st.integers(0, 9), st.just(0)),
    st.builds(AutopilotConflict, times, st.tuples(numbers, numbers)),
)  # fmt: skip


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from(["can0", "mavlink", "nowhere"]), st.lists(anything, max_size=4)), max_size=30)
)
def test_no_reading_whatever_raises_or_is_a_fault(config_once, nonsense):
    watched = pipeline(config_once)
    outcomes = play(watched, nonsense)
    assert faults(outcomes) == []


def broken_frames(seed: int) -> list[CanFrame]:
    """Healthy traffic of both ESCs, each third frame damaged, lost, repeated, late or foreign.

    Commands for eight ESCs, as of a real vehicle: a transfer of one frame has no CRC but that of the CAN controller.
    """
    chance, frames = random.Random(seed), []
    for n in range(12 * RATE_HZ):
        time_s, command = START_S + n / RATE_HZ, round(8191 * fraction(START_S + n / RATE_HZ))
        frames += encode_raw_command([command] * 8, 10, n % 32, time_s=time_s)
        for index in range(2):
            status = EscStatus(0, 16.0, 3.0, 300.0, round(FULL_RPM * fraction(time_s)), 0, index)
            frames += encode_esc_status(status, 20 + index, n % 32, time_s=time_s + 0.004)
    return [damaged for frame in frames for damaged in _damaged(frame, chance)]


def _damaged(frame: CanFrame, chance: random.Random) -> list[CanFrame]:
    data = bytearray(frame.data)
    if chance.random() > 1 / 3:
        return [frame]
    match chance.randrange(6):
        case 0:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        case 1:
            return []
        case 2:
            return [frame, frame]
        case 3:
            return [replace(frame, time_s=frame.time_s - chance.choice([0.1, 5.0, 1e6]))]
        case 4:
            return [frame, replace(frame, identifier=frame.identifier ^ (1 << chance.randrange(29)))]
        case 5:
            data = data[: chance.randrange(len(data) + 1)]
    return [replace(frame, data=bytes(data))]


@pytest.mark.parametrize("seed", range(3))
def test_damaged_frames_are_counted_and_accuse_nobody(config, seed):
    decoder, watched = can_decoder(config.can[0], config.thruster), Pipeline(config)
    outcomes = []
    for frame in broken_frames(seed):
        outcomes += watched.feed("can0", decoder.decode(frame))
        if frame.time_s > START_S:
            outcomes += watched.feed("mavlink", [ThrusterCommand(frame.time_s, 2, fraction(frame.time_s))])
    assert faults(outcomes) == []
    assert sum(isinstance(outcome, ThrusterJudgement) for outcome in outcomes) > 1000
    assert sum(decoder.drops.values()) > 500
    assert watched.drops()["command time ran backwards"] > 0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.binary(max_size=300), max_size=10))
def test_no_bytes_of_mavlink_whatever_raise(config_once, chunks):
    decoder, watched = mavlink_decoder(config_once.mavlink, config_once.thruster), pipeline(config_once)
    for n, data in enumerate(chunks):
        assert faults(watched.feed("mavlink", decoder.decode(data, START_S + n))) == []


def test_what_is_no_longer_watched_is_not_remembered(config):
    before = pipeline(config)
    play(before, drive(6.0, fault_s=4.0))
    assert before.levels()["thruster 2"] is Level.FAULT
    after = pipeline(replace(config, thruster=config.thruster[:1]))
    after.resume(before.remember())
    assert "thruster 2" not in after.levels() and "thruster 1" in after.levels()

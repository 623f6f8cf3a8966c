"""The speed watch in the pipeline: from positions and headings to texts; the same whatever the calls."""

import math
import random
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detectors.speed import SpeedCurve
from detectors.speed.gridded_flow import GriddedFlow
from detectors.verdict import Level
from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.mavlink.tests.peer import Peer
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    AutopilotReboot,
    GlobalPosition,
    LinkState,
    LocalPosition,
    PositionFix,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.channel import SpeedJudgement
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Now, Pipeline
from gateway.severity import Severity
from gateway.supervision.actions import Action
from gateway.tests.conftest import (
    FULL_RPM,
    SPEED_WATCH,
    TWO_THRUSTERS,
    GroundSpeedDetector,
    ThresholdDetector,
    over_the_disk,
)
from gateway.wiring import mavlink_decoder

START_S = 1.7e9
RATE_HZ = 20
STAND_INS = Factories(ThresholdDetector, GroundSpeedDetector)
FLOW_MPS = (0.3, -0.2)


def sail(
    seconds: float, fault_s: float = math.inf, flow_mps=(0.0, 0.0), noise_m: float = 0.0
) -> list[tuple[str, list]]:
    """A zig-zag at 1 m/s through water that may move, half as fast from `fault_s` on; both thrusters are healthy."""
    chance = np.random.default_rng(7)
    north, east, heading, arrivals = 0.0, 0.0, 0.3, []
    for n in range(round(seconds * RATE_HZ)):
        time_s = START_S + n / RATE_HZ
        wanted = 1.1 if (n / RATE_HZ) % 40.0 < 20.0 else -0.5
        heading += min(max(wanted - heading, -0.4 / RATE_HZ), 0.4 / RATE_HZ)
        speed_mps = 1.0 if n / RATE_HZ < fault_s else 0.5
        north += (speed_mps * math.cos(heading) + flow_mps[0]) / RATE_HZ
        east += (speed_mps * math.sin(heading) + flow_mps[1]) / RATE_HZ
        readings: list = [Attitude(time_s, 0.0, 0.0, math.remainder(heading, math.tau), 0.0, 0.0, 0.0)]
        if n % 2 == 0:
            place = (north + noise_m * chance.normal(), east + noise_m * chance.normal(), 5.0)
            readings.append(LocalPosition(time_s, place, (0.0, 0.0, 0.0)))
        if n % RATE_HZ == 0:
            readings.append(AutopilotHeartbeat(time_s, 1, 1, 3, 12, True, 19, 4))
        arrivals.append(("mavlink", [*readings, ThrusterCommand(time_s, 2, 0.5)]))
        reports = [ThrusterReport(time_s + 0.004, number, 0.5 * FULL_RPM) for number in (1, 2)]
        arrivals.append(("can0", [ThrusterCommand(time_s, 1, 0.5), *reports]))
    return arrivals


def later(arrivals: list[tuple[str, list]], by_s: float) -> list[tuple[str, list]]:
    return [(link, [replace(one, time_s=one.time_s + by_s) for one in readings]) for link, readings in arrivals]


def play(pipeline: Pipeline, arrivals: list[tuple[str, list]]) -> list:
    return [outcome for link, readings in arrivals for outcome in pipeline.feed(link, readings)]


def watching(config: Config) -> Pipeline:
    return Pipeline(config, STAND_INS)


def judged(outcomes: list) -> list[SpeedJudgement]:
    return [outcome for outcome in outcomes if isinstance(outcome, SpeedJudgement)]


def faults(outcomes: list) -> list[Finding]:
    return [one for one in outcomes if isinstance(one, Finding) and one.level is Level.FAULT]


def texts(outcomes: list) -> list[str]:
    """What the pilot reads, but for what is no news of a fault."""
    said = [outcome for outcome in outcomes if isinstance(outcome, StatusText)]
    return [outcome.text for outcome in said if outcome.severity < Severity.INFO]


def as_events(arrivals: list[tuple[str, list]]) -> list:
    """One event for each reading, and the time before each of them."""
    readings = [(link, reading) for link, together in arrivals for reading in together]
    return [event for link, one in readings for event in (Now(one.time_s), Arrival(link, [one]))]


def in_batches(pipeline: Pipeline, events: list, cuts: list[int]) -> list:
    starts = sorted({0, *(cut for cut in cuts if cut < len(events)), len(events)})
    return [outcome for start, stop in pairwise(starts) for outcome in pipeline.take(events[start:stop])]


@pytest.fixture(scope="module")
def config_once(tmp_path_factory):
    return parse(TWO_THRUSTERS + SPEED_WATCH, tmp_path_factory.mktemp("config"))


def test_half_speed_in_a_current_is_told_and_the_current_is_not(speed_config):
    outcomes = play(Pipeline(speed_config), sail(75.0, fault_s=55.0, flow_mps=FLOW_MPS, noise_m=0.05))
    (fault,) = faults(outcomes)
    assert (fault.detector, fault.subject) == ("speed", "vehicle")
    assert 55.0 < fault.time_s - START_S < 75.0
    assert fault.text.startswith("Speed 0.") and ", want 0.8-1.2 (flow 0." in fault.text
    assert [text for text in texts(outcomes) if text.startswith("Speed")] == [fault.text]
    last = judged(outcomes)[-1].verdict
    assert last.speed_mps == pytest.approx(0.5, abs=0.1)
    assert last.flow_mps == pytest.approx(FLOW_MPS, abs=0.1)


def test_the_real_detector_says_the_same_in_batches_bit_for_bit(config_once):
    arrivals = sail(25.0, fault_s=15.0, flow_mps=FLOW_MPS, noise_m=0.05)
    chance = random.Random(5)
    cuts = [chance.randrange(len(arrivals)) for _ in range(60)]
    events = [Arrival(link, readings) for link, readings in arrivals]
    expected = play(Pipeline(config_once), arrivals)
    assert len(judged(expected)) > 200
    assert repr(in_batches(Pipeline(config_once), events, cuts)) == repr(expected)


@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(0, 5000), max_size=40))
def test_batches_of_any_length_give_the_outcomes_of_one_by_one_in_their_order(config_once, cuts):
    events = as_events([*sail(12.0, fault_s=8.0), ("mavlink", [LinkState(START_S + 13.0, "mavlink", False, "gone")])])
    one_by_one, batched = watching(config_once), watching(config_once)
    expected = in_batches(one_by_one, events, list(range(len(events))))
    assert faults(expected)
    assert repr(in_batches(batched, events, cuts)) == repr(expected)
    assert batched.snapshot() == one_by_one.snapshot()


@pytest.mark.parametrize("cut", [1, 201, 350])
def test_restored_from_a_snapshot_it_goes_on_bit_for_bit(speed_config, cut):
    arrivals = sail(12.0, fault_s=8.0)
    whole, first = watching(speed_config), watching(speed_config)
    expected = play(whole, arrivals)
    before = play(first, arrivals[:cut])
    after = play(Pipeline.restore(first.snapshot()), arrivals[cut:])
    assert repr(before + after) == repr(expected)


def test_samples_carry_the_command_of_the_thrusters_that_drive_ahead(speed_config):
    outcomes = play(watching(speed_config), sail(5.0))
    samples = [judgement.sample for judgement in judged(outcomes)]
    assert {sample.command for sample in samples[5:]} == {0.5}
    assert [round((b.time_s - a.time_s) * 10) for a, b in pairwise(samples)] == [1] * (len(samples) - 1)


def test_words_of_a_fault_from_onset_to_end(speed_config):
    watched = watching(speed_config)
    told = texts(play(watched, sail(12.0, fault_s=8.0)))
    told += texts(play(watched, later(sail(8.0), 12.0)))
    assert told == ["Speed 0.75 m/s, want 0.8-1.2 (flow 0.4 @ 090)", "Speed ok again: 1.00 m/s"]


def test_failsafe_of_its_own(speed_config):
    failsafe = speed_config.failsafe.model_copy(update={"speed_fault": (Action.HOLD,), "delay_s": 0.0})
    outcomes = play(watching(replace(speed_config, failsafe=failsafe)), sail(12.0, fault_s=8.0))
    asked = {(one.command, one.parameters[1]) for one in outcomes if isinstance(one, CommandLong)}
    assert asked == {(176, 2.0)}
    only_findings = speed_config.failsafe.model_copy(update={"speed_fault": (Action.NONE,)})
    outcomes = play(watching(replace(speed_config, failsafe=only_findings)), sail(12.0, fault_s=8.0))
    assert len(faults(outcomes)) == 1 and texts(outcomes) == []


def test_disarming_clears_and_the_operator_accepts(speed_config):
    watched = watching(speed_config)
    play(watched, sail(12.0, fault_s=8.0))
    assert texts(watched.accept("vehicle", START_S + 12.0)) == ["Speed fault cleared: operator accepted"]
    assert watched.learnt()["vehicle"].detector.accepted == 1
    again = watching(speed_config)
    play(again, sail(12.0, fault_s=8.0))
    disarmed = AutopilotHeartbeat(START_S + 12.0, 1, 1, 3, 12, False, 19, 3)
    assert texts(again.feed("mavlink", [disarmed])) == ["Speed fault cleared: vehicle disarmed"]


def test_heading_and_position_that_fall_silent_are_told(speed_config):
    watched = watching(speed_config)
    play(watched, sail(5.0))
    told = []
    for n in range(320):
        time_s = START_S + 5.0 + n / 20
        beat = AutopilotHeartbeat(time_s, 1, 1, 3, 12, True, 19, 4)
        command = [ThrusterCommand(time_s, 2, 0.5)]
        reports = [ThrusterReport(time_s, number, 0.5 * FULL_RPM) for number in (1, 2)]
        told += texts(watched.feed("mavlink", [beat, *command]))
        told += texts(watched.feed("can0", [ThrusterCommand(time_s, 1, 0.5), *reports]))
    assert [re.sub(r"\.\d", "", text) for text in told] == ["Heading silent 1 s", "Position silent 10 s"]


def test_position_is_not_missed_on_deck(speed_config):
    watched = watching(speed_config)
    told = []
    for n in range(200):
        time_s = START_S + n / 5
        beat = AutopilotHeartbeat(time_s, 1, 1, 3, 12, False, 19, 3)
        told += texts(watched.feed("mavlink", [beat, Attitude(time_s, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0)]))
    assert "Position" not in " ".join(told)


def test_autopilot_that_restarts_ends_what_was_half_joined(speed_config):
    watched = watching(speed_config)
    arrivals = sail(5.0)
    play(watched, arrivals)
    assert judged(watched.feed("mavlink", [AutopilotReboot(START_S + 5.0, 1)])) == []
    later = [Attitude(START_S + 5.0 + n / 20, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0) for n in range(1, 20)]
    assert judged(watched.feed("mavlink", later)) == []


def test_readings_for_the_speed_watch_come_over_mavlink_only(speed_config):
    watched = watching(speed_config)
    shifted = [("can0" if link == "mavlink" else link, readings) for link, readings in sail(5.0)]
    assert judged(play(watched, shifted)) == []


RECORDING = Path(__file__).parents[3] / "shared/data/ardusub_logs/small.tlog"


def test_recorded_dive_with_an_underwater_gps_that_stood_still(tmp_path):
    """A BlueROV2 whose acoustic positioning said one place all the time, with a good fix."""
    if not RECORDING.exists():
        pytest.skip(f"no recording at {RECORDING}: shared/data must lie beside the project's root")
    servo = TWO_THRUSTERS.replace('"can0", esc_index = 0 }\nrpm', '"mavlink", servo_channel = 1 }\nahead = 1\nrpm', 1)
    config = parse(servo + "[speed]\n", tmp_path)
    decoder, watched = mavlink_decoder(config.mavlink, config.thruster), Pipeline(config)
    data, start, outcomes = RECORDING.read_bytes(), 0, []
    while start + 8 < len(data):
        time_s, start = int.from_bytes(data[start : start + 8], "big") / 1e6, start + 8
        size = data[start + 1] + (12 if data[start] == 0xFD else 8)
        outcomes += watched.feed("mavlink", decoder.decode(data[start : start + size], time_s))
        start += size
    samples = [judgement.sample for judgement in judged(outcomes)]
    assert len(samples) > 1000 and len({sample.north_m for sample in samples}) > 700  # of 792 local positions
    assert {sample.command is None for sample in samples} == {False, True}
    assert watched.drops()["position repeated"] > 900
    assert faults(outcomes) == []


# What was learnt ----------------------------------------------------------------------------------


def test_what_was_learnt_is_recalled_where_it_fits(speed_config):
    old, new = watching(speed_config), watching(speed_config)
    play(old, sail(5.0))
    assert new.recall(old.learnt()) == []
    detector = new.learnt()["vehicle"].detector
    assert detector.samples > 15 and detector.resumed == 1


def test_recalled_fault_is_not_told_without_new_evidence_and_an_earlier_clock_works(speed_config):
    old, new = Pipeline(speed_config), Pipeline(speed_config)
    assert faults(play(old, sail(75.0, fault_s=55.0, flow_mps=FLOW_MPS)))
    assert new.recall(over_the_disk(old.learnt())) == []
    before = later(sail(8.0, flow_mps=FLOW_MPS), -1.6e9)
    outcomes = play(new, before)
    assert faults(outcomes) == [] and new.drops()["speed: late or repeated"] == 0
    assert {round(one.sample.time_s - one.verdict.time_s) for one in judged(outcomes)} == {0}


def test_forecasts_that_differ_only_in_the_midst_of_their_grids_are_two(speed_config):
    axes = np.arange(24.0), np.array([0.0]), np.linspace(-9e3, 9e3, 9), np.linspace(-9e3, 9e3, 9)
    still = np.zeros((24, 1, 9, 9, 2))
    running = still.copy()
    running[12, 0, 4, 4] = 0.7
    assert repr(GriddedFlow(*axes, still)) == repr(GriddedFlow(*axes, running))
    old = watching(with_settings(speed_config, flow_model=GriddedFlow(*axes, still)))
    play(old, sail(5.0))
    for grid, kept in ((still.copy(), True), (running, False)):
        other = watching(with_settings(speed_config, flow_model=GriddedFlow(*axes, grid)))
        assert other.recall(old.learnt()) == []
        assert (other.learnt()["vehicle"].detector.samples > 0) is kept


def with_settings(config: Config, **changes: object) -> Config:
    changed = replace(config.detector.speed, **changes)
    return replace(config, detector=replace(config.detector, speed=changed))


def test_other_settings_keep_a_learnt_speed_but_not_against_a_given_one_and_other_thrusters_nothing(speed_config):
    learning = with_settings(speed_config, speed_min_mps=None, speed_max_mps=None)
    old = watching(learning)
    play(old, sail(5.0))
    curve, given = SpeedCurve((0.5, 1.0), (0.7, 1.0)), SpeedCurve((0.5,), (0.8,))
    old.learnt()["vehicle"].detector.curve = curve
    for changes, kept in (({"tolerance": 0.3}, curve), ({"speed_curve": given}, None)):
        other = watching(with_settings(learning, **changes))
        assert other.recall(old.learnt()) == []
        detector = other.learnt()["vehicle"].detector
        assert (detector.curve, detector.samples) == (kept, 0)
    turned = speed_config.thruster[0].model_copy(update={"ahead": -1.0})
    rewired = replace(speed_config, thruster=(turned, speed_config.thruster[1]))
    assert watching(rewired).recall(old.learnt()) == ["vehicle"]  # the thruster itself is as it was
    assert watching(replace(speed_config, speed=None)).recall(old.learnt()) == ["vehicle"]


@pytest.mark.parametrize("estimator", ["interacting", "kalman", "adaptive", "published"])
def test_real_detector_comes_back_from_disk_and_goes_on_the_same(tmp_path, estimator):
    text = f'{TWO_THRUSTERS}{SPEED_WATCH}[detector.speed]\nestimator = "{estimator}"\n'
    config, arrivals = parse(text, tmp_path), sail(12.0, flow_mps=FLOW_MPS)
    watched = Pipeline(config, Factories(thruster=ThresholdDetector))
    play(watched, arrivals[:400])
    back = over_the_disk(watched.learnt())["vehicle"]
    samples = [judgement.sample for judgement in judged(play(watched, arrivals[400:]))]
    detector = over_the_disk({"vehicle": back})["vehicle"].detector
    assert [repr(detector.update(sample)) for sample in samples] == [repr(back.detector.update(s)) for s in samples]
    assert len(samples) > 15


# Nonsense -----------------------------------------------------------------------------------------

times = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(START_S, START_S + 30.0))
numbers = st.floats(-1e7, 1e7)
places = st.tuples(numbers, numbers, numbers)
angles = st.floats(-6.3, 6.3)
depths = st.one_of(st.none(), st.floats(-1e4, 1e4))
anything = st.one_of(
    st.builds(Attitude, times, angles, angles, angles, angles, angles, angles),
    st.builds(LocalPosition, times, places, places),
    st.builds(GlobalPosition, times, st.floats(-1.57, 1.57), angles, numbers, places),
    st.builds(PositionFix, times, st.floats(-1.57, 1.57), angles, depths, depths, st.just("GPS_INPUT 220.0")),
    st.builds(ThrusterCommand, times, st.integers(0, 3), st.floats()),
    st.builds(AutopilotReboot, times, st.just(1)),
)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["can0", "mavlink"]), st.lists(anything, max_size=8)), max_size=30))
def test_no_reading_whatever_raises_or_is_a_fault(config_once, nonsense):
    assert faults(play(Pipeline(config_once), nonsense)) == []


@pytest.mark.parametrize("seed", range(3))
def test_damaged_packets_of_positions_and_headings_raise_nothing(config_once, seed):
    decoder, watched = MavlinkDecoder([], autopilot_system=1), Pipeline(config_once)
    chance, autopilot, acoustic = random.Random(seed), Peer(), Peer(1, 220)
    for n in range(400):
        fix = acoustic.gps_input(437_000_000 + 5 * n, time_us=1 + 50_000 * n) if n % 4 == 0 else b""
        data = bytearray(autopilot.attitude(1000 + 50 * n) + fix)
        if chance.random() < 0.3:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        assert faults(watched.feed("mavlink", decoder.decode(bytes(data), START_S + n / 20))) == []
    assert decoder.drops["checksum"] > 50

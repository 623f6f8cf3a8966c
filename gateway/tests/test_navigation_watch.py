"""The navigation watch in the pipeline: from readings of its sensors to texts; the same whatever the calls."""

import math
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from detectors.navigation import DepthSample, DvlSample, ImuSample
from detectors.verdict import Level
from drivers.mavlink.messages import CommandLong, StatusText
from drivers.mavlink.tests.peer import Peer
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    AutopilotReboot,
    BodyVelocity,
    GlobalPosition,
    Inertial,
    LinkState,
    PositionFix,
    WaterPressure,
)
from gateway.channel import NavigationJudgement
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Now, Pipeline
from gateway.severity import Severity
from gateway.supervision.actions import Action
from gateway.tests.conftest import NAVIGATION_WATCH, TWO_THRUSTERS, CruiseDetector, ThresholdDetector, over_the_disk
from gateway.wiring import mavlink_decoder

START_S = 1.7e9
IMU_HZ, DVL_HZ, DEPTH_HZ, ATTITUDE_HZ = 50, 5, 10, 20
SURFACE_PA, PA_PER_M = 101_325.0, 1025.0 * 9.80665
STAND_INS = Factories(thruster=ThresholdDetector, navigation=CruiseDetector)
DEPTH_M = 5.0


def dive(
    seconds: float, fault_s: float = math.inf, dvl_mps: float = 0.0, begin_s: float = 0.0, rate_hz: int = IMU_HZ
):
    """A vehicle that goes north at 1 m/s, level; from `fault_s` on its DVL says something else."""
    arrivals = []
    for n in range(round(begin_s * 100), round((begin_s + seconds) * 100)):
        at_s, boot_s = START_S + n / 100, 50.0 + n / 100
        readings: list = []
        if n % (100 // rate_hz) == 0:
            readings.append(Inertial(at_s, boot_s, "RAW_IMU", (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)))
        if n % (100 // ATTITUDE_HZ) == 0:
            readings.append(Attitude(at_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, boot_s))
        if n % (100 // DEPTH_HZ) == 0:
            readings.append(WaterPressure(at_s, boot_s, 2, SURFACE_PA + DEPTH_M * PA_PER_M, None))
        if n % (100 // DVL_HZ) == 3:
            velocity = (dvl_mps if n / 100 >= fault_s else 1.0, 0.0, 0.0)
            readings.append(BodyVelocity(at_s, None, velocity, "VISION_POSITION_DELTA 255.0"))
        if n % 100 == 0:
            readings.append(AutopilotHeartbeat(at_s, 1, 1, 3, 12, True, 19, 4))
        if readings:
            arrivals.append(("mavlink", readings))
    return arrivals


def play(pipeline: Pipeline, arrivals: list) -> list:
    return [outcome for link, readings in arrivals for outcome in pipeline.feed(link, readings)]


def watching(config: Config) -> Pipeline:
    return Pipeline(config, STAND_INS)


def judged(outcomes: list) -> list[NavigationJudgement]:
    return [outcome for outcome in outcomes if isinstance(outcome, NavigationJudgement)]


def findings(outcomes: list) -> list[Finding]:
    return [one for one in outcomes if isinstance(one, Finding) and one.detector == "navigation"]


def faults(outcomes: list) -> list[Finding]:
    return [one for one in findings(outcomes) if one.level is Level.FAULT]


def texts(outcomes: list) -> list[str]:
    """What the pilot reads, but for what is no news of a fault."""
    said = [outcome for outcome in outcomes if isinstance(outcome, StatusText)]
    return [outcome.text for outcome in said if outcome.severity < Severity.INFO]


def without_thrusters(outcomes: list) -> list[str]:
    return [text for text in texts(outcomes) if not re.match(r"T\d|can0|Commands", text)]


def as_events(arrivals: list) -> list:
    """One event for each reading, and the time before each of them."""
    readings = [(link, reading) for link, together in arrivals for reading in together]
    return [event for link, one in readings for event in (Now(one.time_s), Arrival(link, [one]))]


def in_batches(pipeline: Pipeline, events: list, cuts: list[int]) -> list:
    starts = sorted({0, *(cut for cut in cuts if cut < len(events)), len(events)})
    return [outcome for start, stop in pairwise(starts) for outcome in pipeline.take(events[start:stop])]


@pytest.fixture(scope="module")
def config_once(tmp_path_factory):
    return parse(TWO_THRUSTERS + NAVIGATION_WATCH, tmp_path_factory.mktemp("config"))


def test_a_lying_dvl_is_told_and_that_it_is_over(navigation_config):
    watched = watching(navigation_config)
    told = without_thrusters(play(watched, dive(12.0, fault_s=8.0)))
    told += without_thrusters(play(watched, dive(8.0, begin_s=12.0)))
    assert told == ["DVL off by 1.0 m/s backward, isolated", "DVL ok again"]


def test_the_finding_names_the_sensor(navigation_config):
    outcomes = play(watching(navigation_config), dive(12.0, fault_s=8.0))
    (fault,) = faults(outcomes)
    assert (fault.detector, fault.subject) == ("navigation", "dvl")
    assert 8.0 <= fault.time_s - START_S < 8.5
    levels = {(one.subject, one.level) for one in findings(outcomes)}
    assert ("depth sensor", Level.NORMAL) in levels and ("depth sensor", Level.FAULT) not in levels


def test_doubt_is_told_when_it_lasts_and_who_it_was(navigation_config):
    watched = watching(navigation_config)
    brief = without_thrusters(play(watched, dive(10.0, fault_s=8.0, dvl_mps=0.5)))
    brief += without_thrusters(play(watched, dive(8.0, begin_s=10.0)))
    assert brief == []
    lasting = without_thrusters(play(watched, dive(5.0, fault_s=0.0, dvl_mps=0.5, begin_s=18.0)))
    lasting += without_thrusters(play(watched, dive(8.0, fault_s=0.0, begin_s=23.0)))
    assert lasting == [
        "Nav: DVL or accelerometer off",
        "DVL off by 1.0 m/s backward, isolated",
        "Nav: it is the DVL",
    ]


def test_every_sample_is_judged_once_and_in_the_order_of_time(navigation_config):
    watched = watching(navigation_config)
    samples = [one.sample for one in judged(play(watched, dive(10.0)))]
    kinds = [sum(isinstance(one, kind) for one in samples) for kind in (ImuSample, DvlSample, DepthSample)]
    assert kinds[0] == pytest.approx(10 * IMU_HZ - 5, abs=2)
    assert kinds[1:] == pytest.approx([8 * DVL_HZ, 8 * DEPTH_HZ], abs=2)  # at first, a better source is waited for
    times = [one.time_s for one in samples]
    assert times == sorted(times)
    depths = [one.depth_m for one in samples if isinstance(one, DepthSample)]
    assert depths == pytest.approx([DEPTH_M] * len(depths))
    assert watched.remarks()["navigation"] == "RAW_IMU, VISION_POSITION_DELTA 255.0, SCALED_PRESSURE2, IMU at 50 Hz"


def test_before_alignment_nothing_is_known_and_it_says_why(navigation_config):
    verdicts = [one.verdict for one in judged(play(watching(navigation_config), dive(8.0)))]
    unknown = [verdict for verdict in verdicts if verdict.level is Level.UNKNOWN]
    assert verdicts[: len(unknown)] == unknown and unknown[-1].reason == "aligned"
    assert {"waiting for the IMU", "waiting for the DVL"} <= {verdict.reason for verdict in unknown}
    assert unknown[-1].state.velocity_mps == pytest.approx((1.0, 0.0, 0.0))


def test_observations_come_with_dvl_and_depth_and_when_something_changed(navigation_config):
    told = judged(play(watching(navigation_config), dive(12.0, fault_s=8.0)))
    changes = [one for one in told if one.changed]
    assert 3 <= len(changes) <= 6
    assert isinstance(changes[-1].sample, DvlSample) and changes[-1].verdict.level is Level.FAULT


def test_slow_inertial_samples_are_no_use_and_it_says_so(navigation_config):
    verdicts = [one.verdict for one in judged(play(watching(navigation_config), dive(8.0, rate_hz=5)))]
    assert {verdict.level for verdict in verdicts} == {Level.UNKNOWN}
    assert verdicts[-1].reason == "IMU at 5.0 Hz is too slow"


def test_a_gap_begins_with_alignment_again_and_keeps_the_installation(navigation_config):
    watched = watching(navigation_config)
    play(watched, dive(8.0))
    first = watched.learnt()["navigation"].detector
    outcomes = play(watched, dive(8.0, begin_s=11.0))
    reasons = [one.verdict.reason for one in judged(outcomes)]
    assert reasons.count("aligned") == 1
    assert watched.learnt()["navigation"].detector is first
    assert watched.drops()["navigation: gap of the IMU"] == 1
    assert {one.sensor.value for one in judged(outcomes)[30].verdict.sensors} == {"dvl", "depth"}


def test_restart_of_the_autopilot(navigation_config):
    watched = watching(navigation_config)
    play(watched, dive(8.0))
    watched.feed("mavlink", [AutopilotReboot(START_S + 15.0, 1)])
    rebooted = [
        (link, [replace(one, boot_s=one.boot_s - 64.0) if getattr(one, "boot_s", None) else one for one in readings])
        for link, readings in dive(8.0, begin_s=15.0)
    ]
    outcomes = play(watched, rebooted)
    assert [one.verdict.reason for one in judged(outcomes)].count("aligned") == 1
    assert judged(outcomes)[-1].sample.time_s - START_S == pytest.approx(22.9, abs=0.05)


def test_a_short_gap_is_the_detectors_to_bridge(navigation_config):
    watched = watching(navigation_config)
    play(watched, dive(8.0))
    outcomes = play(watched, dive(4.0, begin_s=10.0))
    assert {one.verdict.level for one in judged(outcomes)} == {Level.NORMAL}


@settings(max_examples=8, deadline=None)
@given(st.lists(st.integers(0, 3000), max_size=40))
def test_batches_of_any_length_give_the_outcomes_of_one_by_one_in_their_order(config_once, cuts):
    events = as_events([*dive(9.0, fault_s=8.0), ("mavlink", [LinkState(START_S + 9.5, "mavlink", False, "gone")])])
    one_by_one, batched = watching(config_once), watching(config_once)
    expected = in_batches(one_by_one, events, list(range(len(events))))
    assert faults(expected)
    assert repr(in_batches(batched, events, cuts)) == repr(expected)
    assert batched.snapshot() == one_by_one.snapshot()


@pytest.mark.parametrize("cut", [1, 150, 330])
def test_restored_from_a_snapshot_it_goes_on_bit_for_bit(navigation_config, cut):
    arrivals = dive(9.0, fault_s=8.0)
    whole, first = watching(navigation_config), watching(navigation_config)
    expected = play(whole, arrivals)
    before = play(first, arrivals[:cut])
    after = play(Pipeline.restore(first.snapshot()), arrivals[cut:])
    assert repr(before + after) == repr(expected)


def test_the_link_may_jitter_and_the_order_holds(navigation_config):
    chance, late = np.random.default_rng(2), 0.0
    arrivals = []
    for link, readings in dive(12.0, fault_s=8.0):
        late = max(late - 0.01, 0.0) + (chance.exponential(0.05) if chance.random() < 0.1 else 0.0)
        arrivals.append((link, [replace(one, time_s=one.time_s + late) for one in readings]))
    outcomes = play(watching(navigation_config), arrivals)
    times = [one.sample.time_s for one in judged(outcomes)]
    assert times == sorted(times)
    assert without_thrusters(outcomes) == ["DVL off by 1.0 m/s backward, isolated"]


def test_failsafe_of_its_own(navigation_config):
    failsafe = navigation_config.failsafe.model_copy(update={"navigation_fault": (Action.HOLD,), "delay_s": 0.0})
    outcomes = play(watching(replace(navigation_config, failsafe=failsafe)), dive(10.0, fault_s=8.0))
    asked = {(one.command, one.parameters[1]) for one in outcomes if isinstance(one, CommandLong)}
    assert asked == {(176, 2.0)}


def test_disarming_clears_and_arming_tells_again(navigation_config):
    watched = watching(navigation_config)
    play(watched, dive(12.0, fault_s=8.0))
    disarmed = AutopilotHeartbeat(START_S + 12.0, 1, 1, 3, 12, False, 19, 3)
    assert texts(watched.feed("mavlink", [disarmed])) == ["DVL fault cleared: vehicle disarmed"]
    armed_again = without_thrusters(play(watched, dive(2.0, fault_s=0.0, begin_s=12.01)))
    assert armed_again == ["DVL off by 1.0 m/s backward, isolated"]


def test_the_operator_accepts_all_sensors(navigation_config):
    made: list[CruiseDetector] = []

    def make(*arguments):
        made.append(CruiseDetector(*arguments))
        return made[-1]

    watched = Pipeline(navigation_config, Factories(thruster=ThresholdDetector, navigation=make))
    watched.accept("navigation", START_S)
    play(watched, dive(12.0, fault_s=8.0))
    assert texts(watched.accept("navigation", START_S + 12.0)) == ["DVL fault cleared: operator accepted"]
    assert [one.accepted for one in made] == [1]


def test_sensors_that_fall_silent_are_told(navigation_config):
    watched = watching(navigation_config)
    play(watched, dive(8.0))
    told = []
    for n in range(100):
        beat = AutopilotHeartbeat(START_S + 8.0 + n / 10, 1, 1, 3, 12, True, 19, 4)
        told += texts(watched.feed("mavlink", [beat]))
    silent = [re.sub(r"\.\d", "", text) for text in told if not text.startswith(("T", "can0"))]
    assert silent == ["IMU silent 1 s", "Depth silent 3 s", "DVL silent 5 s"]


def test_a_dvl_without_bottom_is_not_missed_on_deck(navigation_config):
    watched = watching(navigation_config)
    play(watched, dive(8.0))
    told = []
    for n in range(100):
        beat = AutopilotHeartbeat(START_S + 8.0 + n / 10, 1, 1, 3, 12, False, 19, 3)
        told += texts(watched.feed("mavlink", [beat]))
    assert not any(text.startswith("DVL") for text in told)


# Where it begins ------------------------------------------------------------------------------------


def fixed(arrivals: list, at_s: float, latitude_deg: float) -> list:
    place = math.radians(latitude_deg), math.radians(10.4)
    fix = PositionFix(START_S + at_s, *place, None, 1.0, "GPS_INPUT 220.0")
    return [*arrivals[: round(at_s * 100)], ("mavlink", [fix]), *arrivals[round(at_s * 100) :]]


def begun(config: Config, arrivals: list) -> list[CruiseDetector]:
    made: list[CruiseDetector] = []

    def make(*arguments):
        made.append(CruiseDetector(*arguments))
        return made[-1]

    arrivals = sorted(arrivals, key=lambda one: one[1][0].time_s)
    play(Pipeline(config, Factories(thruster=ThresholdDetector, navigation=make)), arrivals)
    return made


def test_it_begins_where_the_configuration_says(tmp_path):
    config = parse(TWO_THRUSTERS + NAVIGATION_WATCH + "latitude_deg = 63.4\nlongitude_deg = 10.4", tmp_path)
    (detector,) = begun(config, dive(8.0))
    assert math.degrees(detector.initial.latitude_rad) == pytest.approx(63.4)
    assert detector.initial.depth_m == pytest.approx(DEPTH_M)


def test_the_first_fix_moves_it_from_a_place_that_was_rough(navigation_config):
    made = begun(navigation_config, fixed(dive(14.0), 8.0, 63.4))
    assert [math.degrees(one.initial.latitude_rad) for one in made] == pytest.approx([45.0, 63.4])


def test_the_first_fix_close_by_is_a_measurement(tmp_path):
    config = parse(TWO_THRUSTERS + NAVIGATION_WATCH + "latitude_deg = 63.4\nlongitude_deg = 10.4", tmp_path)
    assert len(begun(config, fixed(dive(14.0), 8.0, 63.401))) == 1


def test_a_later_fix_far_away_is_the_detectors_to_judge(navigation_config):
    arrivals = fixed(fixed(dive(20.0), 8.0, 63.4), 15.0, 10.0)
    assert len(begun(navigation_config, arrivals)) == 2


# What survives --------------------------------------------------------------------------------------


def test_the_installation_survives_a_restart_of_the_program(navigation_config):
    old, new = watching(navigation_config), watching(navigation_config)
    play(old, dive(8.0))
    learnt = old.learnt()
    learnt["navigation"].detector.values[0] = -1.85
    assert new.recall(over_the_disk(learnt)) == []
    play(new, dive(8.0, begin_s=1000.0))
    recalled = new.learnt()["navigation"].detector
    assert recalled.values[0] == -1.85
    np.testing.assert_array_equal(recalled.covariance, learnt["navigation"].detector.covariance)


def test_a_restart_before_alignment_loses_nothing(navigation_config):
    old = watching(navigation_config)
    play(old, dive(8.0))
    between = watching(navigation_config)
    between.recall(old.learnt())
    assert between.learnt()["navigation"].detector is old.learnt()["navigation"].detector


def test_another_dvl_has_another_installation(navigation_config):
    old = watching(navigation_config)
    play(old, dive(8.0))
    moved = navigation_config.navigation.model_copy(update={"dvl_lever_arm_m": (1.0, 0.0, 0.0)})
    new = watching(replace(navigation_config, navigation=moved))
    assert new.recall(old.learnt()) == ["navigation"]
    denser = navigation_config.navigation.model_copy(update={"water_density_kgm3": 998.0})
    assert watching(replace(navigation_config, navigation=denser)).recall(old.learnt()) == []


# From the wire --------------------------------------------------------------------------------------


def wire(seconds: float, fault_s: float) -> list[tuple[float, bytes]]:
    """The same dive as an ArduSub and a Water Linked extension send it."""
    autopilot, extension, frames = Peer(1, 1), Peer(255, 0), []
    for n in range(round(seconds * 100)):
        boot_ms, at_s = 50_000 + 10 * n, START_S + n / 100
        message = dialect.MAVLink_raw_imu_message(1000 * boot_ms, 0, 0, -1000, 0, 0, 0, 0, 0, 0)
        data = autopilot.heartbeat(base_mode=0xD1) if n % 100 == 0 else b""
        data += autopilot.pack(message) if n % 2 == 0 else b""
        if n % 5 == 0:
            data += autopilot.pack(dialect.MAVLink_attitude_message(boot_ms, 0, 0, 0, 0, 0, 0))
        if n % 10 == 0:
            data += autopilot.pack(dialect.MAVLink_scaled_pressure2_message(boot_ms, 1515.8, 0, 900))
        if n % 20 == 0:
            delta = (0.2 if n / 100 < fault_s else 0.0, 0.0, 0.0)
            data += extension.pack(dialect.MAVLink_vision_position_delta_message(0, 200_000, (0, 0, 0), delta, 90.0))
        frames.append((at_s, data))
    return frames


def test_from_mavlink_bytes_to_the_text(navigation_config):
    decoder = mavlink_decoder(navigation_config.mavlink, navigation_config.thruster, navigation=True)
    watched, told = watching(navigation_config), []
    for time_s, data in wire(12.0, fault_s=8.0):
        told += texts(watched.feed("mavlink", decoder.decode(data, time_s)))
    assert [text for text in told if text.startswith("DVL")] == ["DVL off by 1.0 m/s backward, isolated"]
    assert decoder.drops == {}


anything = st.floats(allow_nan=True, allow_infinity=True)
triples = st.tuples(anything, anything, anything)
times = st.one_of(anything, st.floats(START_S, START_S + 30.0))
boots = st.one_of(st.none(), anything)
readings = st.one_of(
    st.builds(Inertial, times, boots, st.sampled_from(["RAW_IMU", "x"]), triples, triples),
    st.builds(BodyVelocity, times, boots, triples, st.sampled_from(["ODOMETRY 1.1", "VISION_POSITION_DELTA 255.0"])),
    st.builds(WaterPressure, times, anything, st.integers(-1, 4), anything, anything),
    st.builds(Attitude, times, anything, anything, anything, anything, anything, anything, boots),
    st.builds(GlobalPosition, times, anything, anything, anything, triples, boots),
    st.builds(PositionFix, times, anything, anything, anything, anything, st.just("GPS_INPUT 1.1")),
    st.builds(AutopilotReboot, times, st.integers(0, 3)),
)


@settings(max_examples=50, deadline=None)
@given(st.lists(readings, max_size=30))
def test_no_reading_whatever_raises(config_once, nonsense):
    play(watching(config_once), [("mavlink", nonsense)])

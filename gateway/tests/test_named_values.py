"""What ground stations can plot."""

import math

import pytest

from detectors.navigation import DepthSample, NavigationState, NavigationVerdict, Sensor, SensorVerdict
from detectors.speed import PoseSample
from detectors.thruster.sample import ThrusterSample
from detectors.verdict import Level
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.tests.peer import messages_in
from gateway.channel import NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.named_values import FRESH_S, Plots, named_values
from gateway.tests.conftest import speed_verdict, verdict

# that ArduSub sends itself
ARDUSUB = {"CamTilt", "CamPan", "TetherTrn", "Lights1", "Lights2", "PilotGain", "InputHold", "RollPitch", "RFTarget"}
NOW_S = 1000.0


def thruster(number, time_s=NOW_S, **fields):
    sample = ThrusterSample(time_s, 0.5, 1000.0)
    return ThrusterJudgement(number, sample, verdict(time_s, Level.NORMAL, **fields))


def speed(time_s=NOW_S, **fields):
    return SpeedJudgement(PoseSample(time_s, 0.0, 0.0, 0.0), speed_verdict(time_s, Level.NORMAL, **fields))


def navigation(time_s=NOW_S):
    sensors = tuple(
        SensorVerdict(sensor, Level.NORMAL, score=0.1 * (1 + place)) for place, sensor in enumerate(Sensor)
    )
    state = NavigationState(time_s, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    said = NavigationVerdict(time_s=time_s, level=Level.NORMAL, score=0.4, state=state, sensors=sensors)
    return NavigationJudgement(DepthSample(time_s, 1.0), said, None, None, False)


def values(*judgements, **options):
    newest = {str(place): judgement for place, judgement in enumerate(judgements)}
    return {one.name: one.value for one in named_values(newest, NOW_S, **options)}


def test_every_kind_of_judgement_has_its_names():
    told = values(thruster(3, score=0.2, residual_rpm=-12.0), speed(), navigation())
    assert told.pop("DVLF") == pytest.approx(0.1 * (1 + list(Sensor).index(Sensor.DVL)))
    assert {told.pop("DEPTHF"), told.pop("GYROF"), told.pop("ACCELF")} <= {0.1, 0.2, 0.1 * 3, 0.4}
    assert told == {"T3": 0.2, "T3RES": -12.0, "SPDF": 0.1, "STW": 1.0, "FLOWN": 0.0, "FLOWE": 0.4, "NAVF": 0.4}


def test_what_is_not_known_is_left_out():
    assert values(thruster(1, score=math.inf, residual_rpm=math.nan)) == {}
    assert set(values(speed(speed_mps=math.nan, flow_mps=(math.nan, 0.1)))) == {"SPDF", "FLOWE"}
    assert values() == {}


def test_the_vertical_current_has_no_name():
    assert set(values(speed(flow_mps=(0.1, 0.2, 0.3)))) == {"SPDF", "STW", "FLOWN", "FLOWE"}


def test_an_old_judgement_is_not_told_as_if_it_were_new():
    assert values(thruster(1, NOW_S - FRESH_S - 0.1), thruster(2, NOW_S - FRESH_S + 0.1)).keys() == {"T2", "T2RES"}


def test_time_counts_from_the_beginning():
    (one, *_) = named_values({"a": thruster(1)}, NOW_S, began_s=NOW_S - 2.5)
    assert one.boot_s == 2.5


def test_values_come_at_even_intervals_or_not_at_all():
    plots, never = Plots(0.5), Plots(0.0)
    for each in (plots, never):
        each.take("thruster 1", thruster(1, NOW_S))
        each.take("thruster 1", thruster(1, NOW_S, score=0.7))
    ticks = [NOW_S + n / 10 for n in range(21)]
    told = [(one.boot_s, one.value) for tick_s in ticks for one in plots.advance(tick_s) if one.name == "T1"]
    assert told == [(pytest.approx(n / 2), 0.7) for n in range(5)]
    assert [one for tick_s in ticks for one in never.advance(tick_s)] == []


def test_names_fit_and_are_nobody_elses():
    told = named_values({"t": thruster(99), "s": speed(), "n": navigation()}, NOW_S)
    encoder = MavlinkEncoder(1)
    for one in told:
        (sent,) = messages_in(encoder.encode(one))
        assert sent.name == one.name and sent.value == pytest.approx(one.value, rel=1e-6)
        assert one.name not in ARDUSUB

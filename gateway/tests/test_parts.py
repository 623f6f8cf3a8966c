"""The small parts: texts, findings, ticks, silence, state on disk."""

import io
import json
import math
import pickle
import re
import subprocess
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.speed import PoseSample
from detectors.thruster import ThrusterConfig, ThrusterDetector
from detectors.thruster.sample import FaultKind, ThrusterSample
from detectors.verdict import Level
from drivers.can.bus import CanLink
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.messages import StatusText
from drivers.readings import AutopilotHeartbeat, LinkState, OperatorAct
from gateway import state, texts
from gateway.channel import Learnt, SpeedJudgement
from gateway.findings import Finding, FindingsFile
from gateway.moment import Moment, present
from gateway.rules import observations
from gateway.severity import Severity
from gateway.silence import SilenceWatch, Watched
from gateway.state import State
from gateway.summary import Summary
from gateway.tests.conftest import ThresholdDetector, speed_verdict, verdict
from gateway.timeline import Timeline


def words(number: int, speed_rpm: float, **fields: object) -> str:
    sample, said = ThrusterSample(0.0, 0.5, speed_rpm), verdict(0.0, Level.FAULT, **fields)
    return texts.fitted(f"T{number} {texts.thruster_trouble(said)}", texts.thruster_details(sample, said))


@pytest.mark.parametrize(
    ("text", "arguments"),
    [
        ("T3 entangled? 812 rpm, want 1043 (-22%)", (3, 812.4, FaultKind.ENTANGLED, 1043.0)),
        ("T3 entangled? -812 rpm, want -1043 (-22%)", (3, -812.4, FaultKind.ENTANGLED, -1043.0)),
        ("T1 propeller lost? 1300 rpm, want 1000 (+30%)", (1, 1300.0, FaultKind.PROPELLER_LOST, 1000.0)),
        ("T12 blocked or dead? 0 rpm, want -2043 (-100%)", (12, 0.0, FaultKind.STOPPED, -2043.0)),
        ("T2 RPM sensor? 500 rpm, want 0", (2, 500.0, FaultKind.SENSOR, 0.4)),
        ("T2 RPM sensor? 0 rpm, want 0", (2, -0.3, FaultKind.SENSOR, -0.4)),  # nothing has no sign
        ("T1 RPM sensor? -2471 rpm, want -2483 (+0%)", (1, -2471.0, FaultKind.SENSOR, -2483.0)),
        ("T2 dead? 0 rpm", (2, 0.0, FaultKind.DEAD, math.nan)),
    ],
)
def test_thruster_texts(text, arguments):
    number, speed_rpm, kind, predicted_rpm = arguments
    assert words(number, speed_rpm, kind=kind, predicted_rpm=predicted_rpm) == text


def test_wear_is_told_by_how_much():
    assert words(3, 900.0, kind=FaultKind.WORN, wear=-0.13) == "T3 worn or fouled? -13% since commissioned"


@given(
    st.integers(1, 99),
    st.floats(-1e7, 1e7),
    st.floats(allow_nan=True),
    st.sampled_from([kind for kind in FaultKind if kind]),
    st.floats(allow_nan=True),
)
def test_thruster_text_always_fits_and_names_kind(number, speed_rpm, predicted_rpm, kind, wear):
    text = words(number, speed_rpm, kind=kind, predicted_rpm=predicted_rpm, wear=wear)
    assert len(text) <= 50 and text.startswith(f"T{number} {kind}?")
    assert not re.search(r"-0(%| rpm|,|$)", text)


def speed_words(level: Level, **fields: object) -> str:
    judgement = SpeedJudgement(PoseSample(0.0, 0.0, 0.0, 0.0), speed_verdict(0.0, level, **fields))
    (told,) = observations(judgement)
    return told.text()


@pytest.mark.parametrize(
    ("text", "level", "fields"),
    [
        ("Speed 0.52 m/s, want 0.9-1.2 (flow 0.4 @ 085)", Level.FAULT, {"speed_mps": 0.52, "flow_mps": (0.035, 0.4)}),
        ("Speed 0.52 m/s, want 0.9-1.2 (flow 0.4 @ 000)", Level.FAULT, {"speed_mps": 0.52, "flow_mps": (0.4, -1e-4)}),
        (
            "Speed 0.52 m/s, want 0.9-1.2 (flow 0.4 @ 270)",
            Level.SUSPECT,
            {"speed_mps": 0.52, "flow_mps": (0, -0.4, 1)},
        ),
        ("Speed 0.52 m/s, want 0.9-1.2", Level.FAULT, {"speed_mps": 0.52, "flow_mps": (math.nan, math.nan)}),
        (
            "Speed 0.00 m/s, want 0.9-1.2 (flow 0.0 @ 180)",
            Level.FAULT,
            {"speed_mps": -1e-9, "flow_mps": (-1e-9, 0.0)},
        ),
        (
            "Speed -0.20 m/s, want -1.2 to -0.9 (flow 0.4 @ 090)",
            Level.FAULT,
            {"speed_mps": -0.2, "speed_min_mps": -1.2, "speed_max_mps": -0.9},
        ),
        (
            "Speed 0.01 m/s, want 0.02-0.03 (flow 0.0 @ 090)",
            Level.FAULT,
            {"speed_mps": 0.01, "speed_min_mps": 0.016, "speed_max_mps": 0.026, "flow_mps": (0.0, 0.01)},
        ),
        ("Speed 0.52 m/s (flow 0.4 @ 090)", Level.FAULT, {"speed_mps": 0.52, "speed_min_mps": math.nan}),
        (
            "Speed flow not as foreseen? (flow 0.4 @ 090)",
            Level.SUSPECT,
            {"speed_mps": math.nan, "reason": "flow not as foreseen"},
        ),
        ("Speed ok: 1.01 m/s", Level.NORMAL, {"speed_mps": 1.01}),
        ("Speed unknown: learning", Level.UNKNOWN, {"speed_mps": math.nan, "reason": "learning"}),
        ("Speed unknown", Level.UNKNOWN, {}),
    ],
)
def test_speed_texts(text, level, fields):
    fields = {"speed_min_mps": 0.9, **fields}
    if "want -1.2 to" in text:
        text = text.rpartition(" (")[0]  # what does not fit is left out whole
    assert speed_words(level, **fields) == text


anywhere = st.floats(allow_nan=True)


@given(st.sampled_from(Level), anywhere, st.tuples(anywhere, anywhere), anywhere, anywhere, st.text(max_size=60))
def test_speed_text_always_fits(level, speed_mps, flow_mps, low_mps, high_mps, reason):
    fields = {"speed_mps": speed_mps, "flow_mps": flow_mps, "speed_min_mps": low_mps, "speed_max_mps": high_mps}
    text = speed_words(level, **fields, reason=reason)
    assert len(text) <= 50 and text.startswith("Speed")
    whole = len(text) < 50  # of numbers without end the last may be cut
    assert not (whole and re.search(r"(?<!\d)-0(\.0+)?( m/s|-|$)", text))


FINDING = Finding(
    1.7e9 + 1 / 3, "thruster", "thruster 3", Level.FAULT, 1.23456789, "T3 dead? 0 rpm", Severity.CRITICAL
)


def test_finding_is_one_line_of_json():
    assert FINDING.json_line() == (
        '{"time_s": 1700000000.333333, "detector": "thruster", "subject": "thruster 3", "level": "FAULT", '
        '"score": 1.234568, "text": "T3 dead? 0 rpm", "severity": "CRITICAL"}'
    )
    silent = Finding(1.0, "link", "link can0", Level.SUSPECT, math.nan, "can0 silent 2.0 s", Severity.WARNING)
    assert json.loads(silent.json_line())["score"] is None


def test_findings_are_appended_and_a_line_cut_off_by_a_crash_is_closed(tmp_path):
    path = tmp_path / "findings.jsonl"
    path.write_bytes(b'{"time_s": 1.0, "detec')
    with FindingsFile(path) as file:
        file.append(FINDING)
        assert path.read_bytes().endswith(FINDING.json_line().encode() + b"\n")  # before it is closed
    with FindingsFile(path) as file:
        file.append(FINDING)
    assert path.read_text().splitlines()[1:] == [FINDING.json_line()] * 2


@given(st.lists(st.floats(0.0, 20.0), min_size=1), st.lists(st.floats(0.0, 20.0)))
def test_ticks_depend_on_the_last_time_only(times_s, more_s):
    end_s = max(times_s)
    sparse, dense = Timeline(), Timeline()
    assert sparse.admits(0.0) and dense.admits(0.0)
    expected = list(sparse.ticks(end_s))
    given_out = [
        tick for time_s in [*times_s, *(t for t in more_s if t <= end_s), end_s] for tick in dense.ticks(time_s)
    ]
    assert given_out == expected == [n / 10 for n in range(len(expected))]


def test_single_far_time_is_refused_and_a_lasting_one_believed():
    timeline = Timeline()
    assert timeline.admits(100.0)
    list(timeline.ticks(100.0))
    assert not timeline.admits(1e9)
    assert timeline.admits(101.0)
    assert [timeline.admits(5000.0 + n) for n in range(6)] == [False] * 4 + [True] * 2
    assert not timeline.admits(math.nan)
    assert [timeline.admits(n) for n in range(10)] == [False] * 10  # back is never believed
    assert timeline.drops == {"time far from the last": 15, "no time": 1}
    assert list(timeline.ticks(5004.2)) == [5004.0, 5004.1, 5004.2]


LINK = Watched("link", "link can0", "can0", "can0", 1.5)
SIGNALS = [
    Watched("signal", "thruster 1 rpm", "T1 RPM", "can0", 1.5),
    Watched("signal", "thruster 1 command", "T1 command", "can0", 1.5, armed_only=True),
]


def levels(watch: SilenceWatch, time_s: float, disarmed: bool = False) -> dict[str, tuple[Level, str]]:
    return {seen.subject: (seen.level, seen.text()) for seen in watch.judge(time_s, disarmed)}


def heard(watch: SilenceWatch, time_s: float, *subjects: str) -> None:
    watch.hear_link("can0", time_s)
    for subject in subjects:
        watch.hear_signal(subject, time_s)


def test_silent_signal_is_told_while_its_link_is_alive():
    watch = SilenceWatch([LINK], SIGNALS)
    levels(watch, 0.0)
    for tick in range(1, 21):
        heard(watch, tick / 10, *["thruster 1 command"], *["thruster 1 rpm"] * (tick <= 4))
        seen = levels(watch, tick / 10)
    assert seen == {
        "link can0": (Level.NORMAL, "can0 ok"),
        "thruster 1 rpm": (Level.SUSPECT, "T1 RPM silent 1.6 s"),
        "thruster 1 command": (Level.NORMAL, "T1 command ok"),
    }


def test_silent_link_is_told_and_not_each_of_its_signals():
    watch = SilenceWatch([LINK], SIGNALS)
    levels(watch, 0.0)
    heard(watch, 0.1, "thruster 1 rpm", "thruster 1 command")
    told = set()
    for tick in range(2, 40):
        told |= {seen for seen in levels(watch, tick / 10).items() if seen[1][0] is Level.SUSPECT}
    assert {subject for subject, _ in told} == {"link can0"}
    heard(watch, 4.0, "thruster 1 rpm")  # back: the command, last heard long ago, gets its time
    assert levels(watch, 4.0)["thruster 1 command"][0] is Level.NORMAL
    assert levels(watch, 4.0)["link can0"] == (Level.NORMAL, "can0 ok: after 3.9 s")


def test_command_is_not_missed_while_disarmed():
    watch = SilenceWatch([LINK], SIGNALS)
    for tick in range(0, 100):
        heard(watch, tick / 10, "thruster 1 rpm")
        assert "thruster 1 command" not in levels(watch, tick / 10, disarmed=True)
    assert levels(watch, 10.0, disarmed=False).get("thruster 1 command", (Level.NORMAL,))[0] is Level.NORMAL


def test_what_was_never_heard_is_missed_after_a_while():
    watch = SilenceWatch([LINK], [])
    watch.link_state(LinkState(0.0, "can0", False, "no such CAN interface"))
    assert levels(watch, 0.0) == levels(watch, 4.9) == {}
    assert levels(watch, 5.1) == {"link can0": (Level.SUSPECT, "can0 down: no such CAN interface")}


def test_link_that_goes_down_is_told_at_once():
    watch = SilenceWatch([LINK], SIGNALS)
    heard(watch, 0.0)
    levels(watch, 0.0)
    watch.link_state(LinkState(0.1, "can0", False, "bus-off"))
    assert levels(watch, 0.1) == {"link can0": (Level.SUSPECT, "can0 down: bus-off")}
    watch.link_state(LinkState(0.2, "can0", True, ""))
    assert levels(watch, 0.2)["link can0"][0] is Level.NORMAL


@pytest.mark.parametrize(
    ("last", "line"),
    [
        ({}, "levels: none"),
        ({"thruster 1": Level.NORMAL, "link can0": Level.NORMAL}, "levels: all NORMAL"),
        ({"thruster 1": Level.NORMAL, "thruster 2": Level.FAULT}, "levels: thruster 2 FAULT, all others NORMAL"),
        (
            {"thruster 1": Level.UNKNOWN, "thruster 2": Level.SUSPECT, "thruster 3": Level.FAULT},
            "levels: thruster 3 FAULT, thruster 2 SUSPECT, thruster 1 UNKNOWN",
        ),
    ],
)
def test_summary_names_only_what_is_not_normal_the_worst_first(last, line):
    assert line in Summary(levels=last).lines()


@pytest.mark.parametrize(
    ("last", "line"),
    [
        ({"gateway": Level.NORMAL}, "levels: all judged NORMAL"),
        (
            {"gateway": Level.NORMAL, "link can0": Level.SUSPECT},
            "levels: link can0 SUSPECT, all others judged NORMAL",
        ),
    ],
)
def test_summary_calls_nothing_normal_that_was_never_judged(last, line):
    lines = Summary(levels=last, unjudged=["thruster 1"]).lines()
    assert line in lines
    assert "never judged: thruster 1" in lines


NOW = Moment("this boot", 1000.0, 1.7e9)


def learnt() -> dict[str, Learnt]:
    detector = ThresholdDetector()
    detector.memory = OrderedDict(curve=np.arange(3.0), generator=np.random.default_rng(1), level=Level.FAULT)
    return {"thruster 3": Learnt("sources", "settings", 50.0, detector)}


def test_state_comes_back_whole(tmp_path):
    path = tmp_path / "state"
    state.save(path, State(NOW, 1.7e9, learnt(), [Level.FAULT]))
    whole = state.load(path)
    assert (whole.saved, whole.passing) == (NOW, [Level.FAULT])
    back = whole.learnt["thruster 3"]
    assert (back.sources, back.alignment) == ("sources", 50.0)
    assert back.detector.memory["curve"].tolist() == [0.0, 1.0, 2.0]
    assert back.detector.memory["generator"].random() == np.random.default_rng(1).random()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("method", [{}, {"dynamics": False, "search": "swarm", "threshold_rpm": 80.0}])
def test_real_detector_comes_back_from_disk_and_goes_on_the_same(method):
    detector = ThrusterDetector(ThrusterConfig(**method))
    chance = np.random.default_rng(5)
    commands = 0.55 + 0.3 * np.sin(np.arange(800) / 15.0)
    samples = [ThrusterSample(n / 50, u, 3000.0 * u + chance.normal(0.0, 5.0)) for n, u in enumerate(commands)]
    for sample in samples[:700]:
        detector.update(sample)
    back = (
        state.unpack(state.pack(State(NOW, 1.7e9, {"thruster 1": Learnt("", "", 50.0, detector)})))
        .learnt["thruster 1"]
        .detector
    )
    assert [repr(back.update(sample)) for sample in samples[700:]] == [
        repr(detector.update(sample)) for sample in samples[700:]
    ]


def test_no_state_is_nothing_learnt(tmp_path):
    assert state.load(tmp_path / "none") is None


class Evil:
    def __reduce__(self):
        return subprocess.check_output, (["true"],)


@pytest.mark.parametrize(
    "content",
    [
        *({"a": "text"}, [1], {"a": Evil()}, {"a": pickle.dumps}, {"a": np.save}, {3: Learnt("", "", None, 0)}),
        *({"a": CanLink}, {"a": MavlinkLink}, {"a": open}, {"a": Path}),
    ],
)
def test_state_with_something_else_inside_is_refused(content):
    with pytest.raises(state.StateError):
        state.unpack(state.pack(State(NOW, 1.7e9, content)))
    with pytest.raises(state.StateError):
        state.unpack(state.pack(content))


@pytest.mark.parametrize("saved", [None, "3.0", Moment(1, 2.0, 3.0), Moment("boot", None, 3.0), Moment("", 2.0, "3")])
def test_state_of_no_time_is_refused(saved):
    with pytest.raises(state.StateError, match="something else"):
        state.unpack(state.pack(State(saved, 1.7e9, learnt())))
    with pytest.raises(state.StateError, match="something else"):
        state.unpack(state.pack(State(NOW, saved, learnt())))


def test_values_of_the_drivers_may_be_in_it():
    said = AutopilotHeartbeat(1.0, 1, 1, 3, 12, True, 19, 4), StatusText(6, "text"), OperatorAct.MUTE
    assert state.unpack(state.pack(State(NOW, 1.7e9, {}, said))).passing == said


@pytest.mark.parametrize(
    ("now", "age_s"),
    [
        (Moment("this boot", 1034.0, 5.0), 34.0),  # whatever the wall clock was set to meanwhile
        (NOW, 0.0),
        (Moment("next boot", 1034.0, 1.7e9 + 34.0), None),  # a clock without a battery would say 34 s
        (Moment("this boot", 999.0, 1.7e9 + 34.0), None),
        (Moment("this boot", math.nan, 1.7e9), None),
    ],
)
def test_age_is_known_within_one_boot(now, age_s):
    assert NOW.age_s(now) == age_s


def test_this_machine_tells_its_moments_apart():
    before = present()
    age_s = before.age_s(present())
    assert age_s is not None and 0.0 <= age_s < 5.0
    assert before.date().startswith("20") and Moment("", 0.0, math.inf).date() == "inf s"


@given(st.binary(max_size=60), st.integers(0, 2000), st.integers(0, 255))
def test_damaged_state_is_refused(garbage, place, byte):
    whole = state.pack(State(NOW, 1.7e9, learnt()))
    place %= len(whole)
    damaged = whole[:place] + bytes([byte]) + whole[place + 1 :]
    for data in (garbage, damaged if damaged != whole else b"", whole[:place]):
        with pytest.raises(state.StateError):
            state.unpack(data)


class _WrittenByGetattr:
    """Pickles as some versions of Python 3.11 pickle a member of an enumeration: (getattr, (class, name))."""

    def __init__(self, kind, name):
        self._kind, self._name = kind, name

    def __reduce__(self):
        return getattr, (self._kind, self._name)


def test_members_of_enumerations_come_back_as_every_python_pickles_them():
    written = pickle.dumps(_WrittenByGetattr(Level, "FAULT"))
    assert state._Unpickler(io.BytesIO(written)).load() is Level.FAULT


@pytest.mark.parametrize(("kind", "name"), [(Level, "__class__"), (Level, "mro"), (dict, "fromkeys")])
def test_nothing_else_is_reached_that_way(kind, name):
    written = pickle.dumps(_WrittenByGetattr(kind, name))
    with pytest.raises(state.StateError):
        state._Unpickler(io.BytesIO(written)).load()

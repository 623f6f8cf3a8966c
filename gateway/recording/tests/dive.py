"""A dive to be recorded, of everything a little, with all that is awkward in it."""

from dataclasses import dataclass
from math import inf, nan
from pathlib import Path

import numpy as np

from detectors.navigation import DvlSample, NavigationState, NavigationVerdict
from detectors.navigation.sample import Sensor, SensorVerdict
from detectors.speed.sample import PoseSample, SpeedVerdict
from detectors.thruster import ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from drivers.bus_readings import EscConflict, Health, NodeHealth, NodeMode
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.damage import DamageReport
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, StatusText
from drivers.readings import (
    AutopilotConflict,
    BusLoad,
    FrameLoss,
    Inertial,
    Lateness,
    LinkState,
    OperatorAct,
    OperatorRequest,
    PositionFix,
    ThrusterCommand,
    ThrusterReport,
    WaterPressure,
)
from gateway.channel import NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.findings import Finding
from gateway.recording.entries import About, Entry, Found, Frames, Heard, Spoken, Tick, Told
from gateway.recording.items import Item
from gateway.recording.reading import read_entries
from gateway.recording.waiting import Waiting
from gateway.severity import Severity

START_S = 1_795_372_763.123456789
EVENTS = (
    ("can0", LinkState(START_S + 0.1, "can0", True, ""), None),
    ("can0", BusLoad(START_S + 0.3, "can0", 1 / 3), None),
    ("can1", FrameLoss(START_S + 0.4, "can1", 12, 3), None),
    ("gateway", Lateness(START_S + 0.5, 0.1, 2), 7),
    ("mavlink", OperatorRequest(START_S + 0.6, OperatorAct.ACCEPT, 3, 0.0, 255, 190), None),
    ("mavlink", AutopilotConflict(START_S + 0.7, (1, 2, 9)), None),
    ("mavlink", AutopilotConflict(START_S + 0.7, ()), None),
    ("mavlink", LinkState(START_S + 0.8, "mavlink", False, "Grün ≠"), None),
)
FINDINGS = (
    Finding(
        START_S + 0.2, "thruster", "thruster 1", Level.FAULT, 1.25, "T1 entangled? 900/1200 rpm", Severity.CRITICAL
    ),
    Finding(START_S + 0.9, "link", "link can0", Level.SUSPECT, nan, "can0 silent", Severity.WARNING),
)
TEXT = StatusText(2, "T1 entangled? 900/1200 rpm")


def about(**changes: object) -> About:
    """What a recording says of itself."""
    values = {
        "run": "5f3c",
        "part": 1,
        "started_s": START_S,
        "vehicle": "BlueROV2 Heavy (Ä)",
        "version": "0.1.0",
        "config": '[vehicle]\nname = "BlueROV2 Heavy (Ä)"\n',
        "files": {"thruster.dbc": b"\x00VERSION"},
        "state": b"learnt",
        "resumed": True,
    }
    return About(**(values | changes))


def frames(count: int, begin_s: float, fd: bool = False) -> FrameBlock:
    """Frames of all kinds, as many as one likes."""
    return FrameBlock.of(
        [
            CanFrame(
                begin_s + 0.00013 * number,
                (0x1FFF_FFFF if number % 3 == 0 else 0x7FF) - number % 0x7FF,
                bytes([number % 256] * (number % (65 if fd and number % 2 else 9))),
                extended=number % 3 == 0,
                fd=fd and number % 2 == 1,
                error=number % 7 == 5,
            )
            for number in range(count)
        ]
    )


@dataclass(frozen=True, slots=True)
class Recorded:
    """What has been put into a journal: to be written, and to come back."""

    items: tuple[Item, ...]
    entries: tuple[Entry, ...]
    place: int


def dive(journal: Waiting | None = None, seconds: int = 1) -> Recorded:
    """A dive of some seconds."""
    taken = journal or Waiting(lambda: START_S)
    entries: list[Entry] = []
    for number in range(seconds):
        entries += _second(taken, START_S + number)
    batch = None if journal else taken.take(1 << 30)
    return Recorded(() if batch is None else batch.items, tuple(entries), taken.place)


def _second(journal: Waiting, begin_s: float) -> list[Entry]:
    entries: list[Entry] = []
    for bus, count, fd in (("can0", 40, False), ("can1", 30, True), ("can0", 20, True), ("can1", 1, False)):
        block = frames(count, begin_s + 0.01 * len(entries), fd)
        entries.append(Frames(bus, block, journal.place + np.arange(1, count + 1)))
        journal.frames(bus, block)
    for data in (b"\xfd\x09heard", b""):
        journal.heard(data, begin_s + 0.25)
        entries.append(Heard(journal.place, begin_s + 0.25, data))
    for link, reading, before in EVENTS:
        journal.reading(link, reading, before)
        entries.append(Told(journal.place, link, reading, before))
    _look(journal, begin_s)
    entries += [Found(journal.place, one) for one in FINDINGS]
    journal.said(b"\xfe\x01said", begin_s + 0.95)
    entries.append(Spoken(journal.place, begin_s + 0.95, b"\xfe\x01said"))
    journal.now(begin_s + 0.96)
    entries.append(Tick(journal.place, begin_s + 0.96))
    return entries


def _look(journal: Waiting, time_s: float) -> None:
    """What is only to be looked at."""
    journal.decoded(
        "can0",
        [
            ThrusterCommand(time_s, 1, -0.5),
            ThrusterReport(time_s, 1, 1200.5, 15.9, None, None, 3),
            ThrusterReport(time_s + 0.1, 1, None, None, None, None, None),
            ThrusterReport(time_s + 0.1, 2, 1.0),
            NodeHealth(time_s, 3, Health.WARNING, NodeMode.OPERATIONAL, 12, (1, 2)),
            EscConflict(time_s, 1, 0, (3, 4), None),
        ],
    )
    journal.decoded(
        "mavlink",
        [
            Inertial(time_s, None, "RAW_IMU", (0.1, 0.2, -9.8), (0.0, 0.0, 0.5)),
            WaterPressure(time_s, 12.5, 2, 101_325.0, None),
            PositionFix(time_s, 0.9, 0.1, None, 3.0, "GPS_INPUT"),
        ],
    )
    journal.outcomes((*judgements(time_s), *FINDINGS, TEXT, CompanionHeartbeat(CompanionState.ACTIVE)), time_s)


def judgements(time_s: float) -> tuple[ThrusterJudgement, SpeedJudgement, NavigationJudgement]:
    """One of each detector."""
    level = Level.SUSPECT
    thruster = ThrusterVerdict(
        time_s=time_s, level=level, score=0.7, residual_rpm=-30.0, predicted_rpm=1230.5, threshold_rpm=nan,
        order=3, window=700, delay=2, lag_s=0.08, refitted=True, reason="speed is off",
    )  # fmt: skip
    speed = SpeedVerdict(time_s=time_s, level=level, score=0.2, speed_mps=0.9, flow_mps=(0.1, -0.2), flag=0)
    state = NavigationState(time_s, 0.9, 0.1, 12.0, (0.4, 0.0, 0.1), (0.0, 0.1, 1.5))
    navigation = NavigationVerdict(
        time_s=time_s, level=level, score=0.5, state=state, innovation=(0.1, nan, 0.0, 0.3),
        statistics={"ratio": 0.5}, sensors=(SensorVerdict(Sensor.DVL, level, 0.5, isolated=True),),
        position_error_m=inf,
    )  # fmt: skip
    return (
        ThrusterJudgement(2, ThrusterSample(time_s, 0.5, 1200.5, 15.9, None), thruster),
        SpeedJudgement(PoseSample(time_s, 1.0, 2.0, 0.3), speed, ("dvl",)),
        NavigationJudgement(DvlSample(time_s, (0.4, 0.0, 0.1)), navigation, None, None, True),
    )


def same(one: Entry, other: Entry) -> bool:
    """Whether two entries are the same to the last bit."""
    if not (isinstance(one, Frames) and isinstance(other, Frames)):
        return type(one) is type(other) and repr(one) == repr(other)
    columns = ("time_s", "identifier", "kind", "length", "data")
    return (
        one.bus == other.bus
        and np.array_equal(one.place, other.place)
        and all(np.array_equal(getattr(one.frames, name), getattr(other.frames, name)) for name in columns)
    )


def read(path: Path) -> tuple[list[Entry], DamageReport]:
    """All entries of a file, and what was lost."""
    damage = DamageReport()
    return [entry for entries in read_entries(path, damage) for entry in entries], damage

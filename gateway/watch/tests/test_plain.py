"""Lines of text: one for each change, and none for what is as it was."""

from dataclasses import replace
from math import nan

from detectors.verdict import Level
from gateway.severity import Severity
from gateway.telemetry import LinkTelemetry, Said, SubjectTelemetry
from gateway.watch.plain import Changes, changes
from gateway.watch.source import Look
from gateway.watch.tests.scene import ENTANGLED, telemetry, thruster


def look(told=None, state: str = "live", fresh: bool = True, **more: object) -> Look:
    return Look(told, state, fresh=fresh, time="12:00", **more)


def test_at_first_all_is_told():
    assert Changes().take(look(telemetry())) == [
        "12:00  live",
        "12:00  Test vehicle  0:01:00  judging 0.2 s behind  found: FAULT 1",
        f"12:00  FAULT   T3  score 3.17  {ENTANGLED}",
        "12:00  UNKNOWN DVL",
        "12:00  NORMAL  T1-T2, vehicle, link can0, T1-T3 esc",
        "12:00  link can0 up",
        "12:00  link can0 dropped: overrun 3",
        "12:00  dropped at pipeline: late 2",
        "12:00  recording to dive_001.mcap, 12.3 MB",
        "12:00  INFO: Watching 3 thrusters",
        f"12:00  CRITICAL: {ENTANGLED}",
    ]


def test_what_only_goes_on_growing_is_told_once():
    seen = Changes()
    seen.take(look(telemetry(since_s=60.0)))
    texts = telemetry().texts
    for second in range(1, 30):
        older = tuple(replace(said, age_s=said.age_s + second) for said in texts)
        links = (replace(telemetry().links[0], drops={"overrun": 3 + second}), telemetry().links[1])
        later = telemetry(
            since_s=60.0 + second, texts=older, links=links, recording=f"recording to dive_001.mcap, {second}.0 MB"
        )
        assert seen.take(look(later, note=f"{second} s")) == []  # fmt: skip


def test_changes_are_told_as_they_come():
    seen = Changes()
    seen.take(look(telemetry(fault=False)))
    found = telemetry(SubjectTelemetry("autopilot", Level.SUSPECT, nan, text="Autopilot silent"))
    assert seen.take(look(found))[:2] == [
        f"12:00  FAULT   T3  score 3.17  {ENTANGLED}",
        "12:00  SUSPECT autopilot  Autopilot silent",
    ]
    down = LinkTelemetry("mavlink", False, "no heartbeat", 7, {"bad CRC": 1}, nan)
    said = (*found.texts, Said(0.0, Severity.INFO, "T3 fault cleared"))
    mended = replace(found, subjects=(thruster(3), *found.subjects[3:]), links=(down,), texts=said, recording="")
    assert seen.take(look(mended)) == [
        "12:00  NORMAL  T3",
        "12:00  link mavlink DOWN  no heartbeat",
        "12:00  link mavlink dropped: bad CRC 1",
        "12:00  nothing is recorded",
        "12:00  INFO: T3 fault cleared",
    ]


def test_that_it_is_gone_is_told_once_and_what_it_said_before_is_not_told_again():
    seen = Changes()
    assert seen.take(look(None, "no gateway runs", fresh=False)) == ["12:00  no gateway runs"]
    seen.take(look(telemetry()))
    assert seen.take(look(telemetry(), "no gateway runs", fresh=False)) == ["12:00  no gateway runs"]
    assert seen.take(look(telemetry(), "no gateway runs", fresh=False)) == []
    assert seen.take(look(telemetry())) == ["12:00  live"]


def test_the_end_is_the_last_line():
    assert Changes().take(look(telemetry(), "end of the dive", ended=True))[-1] == "12:00  end of the dive"


class Looks:
    """A source of these looks."""

    def __init__(self, *looks: Look) -> None:
        self._looks = list(looks)

    def look(self) -> Look:
        return self._looks.pop(0)

    def close(self) -> None:
        pass


def test_it_waits_between_looks_and_stops_at_the_end():
    waited = []
    source = Looks(look(None, "a"), look(None, "b"), look(None, "end", ended=True))
    assert list(changes(source, lambda: waited.append(1))) == ["12:00  a", "12:00  b", "12:00  end"]
    assert len(waited) == 2

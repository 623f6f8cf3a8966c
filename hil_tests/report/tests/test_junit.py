"""JUnit XML: held against the rules of its schema that viewers rely on."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree as ET

from hil_tests.report.junit import junit_xml, printable, write_junit
from hil_tests.report.outcome import Outcome
from hil_tests.report.tests.dive import dive
from hil_tests.report.tests.plays import command, finding, mode, mode_command, play, text

WRITTEN = datetime(2026, 11, 22, 15, 4, 5, tzinfo=UTC)
WANTED = {"finding": {"subject": "thruster 3", "level": "FAULT"}, "within_s": 2.0}
# Children of a test case, in the order in which the schema has them.
ORDER = ["properties", "skipped", "error", "failure", "system-out", "system-err"]


def plays() -> list[Outcome]:
    came = {"findings": [finding(25.31)], "texts": [text(25.4, "T3 entangled?")], "modes": [mode(0.0, "MANUAL")]}
    return [
        play(expect=(WANTED,), commands=[mode_command(26.0, 2)], wire_counts={"can0": {"frames lost": 3}}, **came),
        play(expect=(WANTED, WANTED | {"within_s": 0.1}), **came),
        play(expect=(WANTED,), broken="the gateway stopped: \x1b[31mno\x00 bus", path=Path("/runs/a.b/broken.yaml")),
    ]


def parsed(outcomes: list[Outcome]) -> ET.Element:
    return ET.fromstring(junit_xml(outcomes, WRITTEN))  # noqa: S314  our own


def test_totals_are_those_of_the_cases() -> None:
    root = parsed(plays())
    suite = root.find("testsuite")
    assert root.tag == "testsuites"
    assert suite is not None
    cases = suite.findall("testcase")
    for element in (root, suite):
        assert int(element.attrib["tests"]) == len(cases) == 3
        assert int(element.attrib["failures"]) == len(suite.findall("testcase/failure")) == 1
        assert int(element.attrib["errors"]) == len(suite.findall("testcase/error")) == 1
        assert float(element.attrib["time"]) == sum(float(case.attrib["time"]) for case in cases)
    assert datetime.fromisoformat(suite.attrib["timestamp"]) == WRITTEN.replace(tzinfo=None)


def test_every_case_is_as_the_schema_has_it() -> None:
    for case in parsed(plays()).iter("testcase"):
        assert {"name", "classname", "time"} == set(case.attrib)
        tags = [child.tag for child in case]
        assert tags == sorted(set(tags), key=ORDER.index)
        for one in case.iter("property"):
            assert set(one.attrib) == {"name", "value"}
        for trouble in (*case.iter("failure"), *case.iter("error")):
            assert set(trouble.attrib) == {"message", "type"}


def test_a_failure_says_what_was_missed_and_only_that() -> None:
    failure = parsed(plays()).find("testsuite/testcase/failure")
    assert failure is not None
    assert failure.attrib["message"] == "FAULT of thruster 3 within 0.1 s of 0:25"
    assert failure.text is not None
    assert "0.21 s too late" in failure.text
    assert "within 2 s" not in failure.text


def test_a_case_tells_what_happened_in_order() -> None:
    case = parsed(plays()).find("testsuite/testcase")
    assert case is not None
    properties = {one.attrib["name"]: one.attrib["value"] for one in case.iter("property")}
    assert properties["seed"] == "0"
    assert properties["way"] == "virtual time"
    assert properties["vehicle"] == "bluerov2_heavy"
    told = case.findtext("system-out") or ""
    marks = ["ok ", "MANUAL", "thruster 3 entangled begins", "finding    FAULT", "T3 entangled?", "hold ("]
    places = [told.index(mark) for mark in marks]
    assert places == sorted(places)
    assert "can0: frames lost 3" in told


def test_what_was_well_all_along_is_counted_and_no_more() -> None:
    told = parsed([dive()]).findtext("testsuite/testcase/system-out") or ""
    assert "thruster 3: learning" in told
    assert "thruster 4" not in told
    assert "vehicle: Hold asked for T3" in told
    assert "findings of what was never worse than NORMAL: 15" in told


def test_requests_for_messages_are_not_told() -> None:
    told = parsed([play(commands=[command(0.1, 511, 30.0)])]).findtext("testsuite/testcase/system-out") or ""
    assert "511" not in told


def test_names_are_plain_words_and_classes_folders() -> None:
    cases = parsed(plays()).findall("testsuite/testcase")
    assert [case.attrib["classname"] for case in cases] == ["scenarios", "scenarios", "runs.a.b"]
    assert cases[0].attrib["name"] == "weeds on a horizontal thruster"


def test_no_character_that_xml_has_not() -> None:
    error = parsed(plays()).find("testsuite/testcase/error")
    assert error is not None
    assert "\\x1b[31mno\\x00 bus" in (error.text or "")
    assert printable("a\tb\nc \ud800 \uffff \x7f é 🐟") == "a\tb\nc \\ud800 \\uffff \x7f é 🐟"


def test_no_plays_are_a_suite_of_none(tmp_path: Path) -> None:
    write_junit([], tmp_path / "junit.xml")
    root = ET.parse(tmp_path / "junit.xml").getroot()  # noqa: S314  our own
    assert root.attrib["tests"] == "0"
    assert root.find("testsuite") is not None

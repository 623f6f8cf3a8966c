"""Plays as JUnit XML, for whatever shows the tests of a CI run: one test case a scenario."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree as ET

from hil_tests.report.account import account, name_of
from hil_tests.report.check import Check
from hil_tests.report.expectations import checks
from hil_tests.report.outcome import Outcome

SUITE = "gateway hil play"
# Char of XML 1.0: what is none, half a surrogate pair too, cannot be written there even as a reference.
NO_CHARACTER = re.compile("[^\\t\\n\\r\\x20-\\ud7ff\\ue000-\\ufffd\\U00010000-\\U0010ffff]")


def write_junit(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write the file.

    Raises:
        OSError: it cannot be written.
    """
    path.write_bytes(junit_xml(outcomes, datetime.now(UTC)))


def junit_xml(outcomes: Sequence[Outcome], written: datetime) -> bytes:
    """The document, in UTF-8: failures are checks that were missed, errors are plays that came to no end.

    Args:
        outcomes: one test case each, in their order.
        written: when; aware of its time zone.
    """
    cases = [_case(outcome) for outcome in outcomes]
    totals = {
        "tests": str(len(cases)),
        "failures": str(sum(case.find("failure") is not None for case in cases)),
        "errors": str(sum(case.find("error") is not None for case in cases)),
        "skipped": "0",
        "time": _seconds(sum(outcome.wall_s for outcome in outcomes)),
    }
    root = ET.Element("testsuites", {"name": SUITE} | totals)
    timestamp = written.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S")
    suite = ET.SubElement(root, "testsuite", {"name": SUITE, "timestamp": timestamp} | totals)
    suite.extend(cases)
    ET.indent(root)
    document: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return document


def _case(outcome: Outcome) -> ET.Element:
    """Children in the order of the schema: properties, failure or error, system-out."""
    attributes = {"name": name_of(outcome), "classname": _class(outcome), "time": _seconds(outcome.wall_s)}
    case = ET.Element("testcase", {key: printable(value) for key, value in attributes.items()})
    properties = ET.SubElement(case, "properties")
    for name, value in _properties(outcome).items():
        ET.SubElement(properties, "property", name=name, value=printable(value))
    missed = [one for one in checks(outcome) if not one.passed]
    if missed:
        kind = "failure" if outcome.broken is None else "error"
        message = printable("; ".join(one.expected for one in missed))
        trouble = ET.SubElement(case, kind, message=message, type="missed" if kind == "failure" else "broken")
        trouble.text = printable("\n".join(_missed(one) for one in missed))
    ET.SubElement(case, "system-out").text = printable("\n".join(account(outcome)))
    return case


def _class(outcome: Outcome) -> str:
    """Viewers make folders of dots."""
    return ".".join(part for part in outcome.path.parent.parts if part not in {".", "..", "/"}) or "hil"


def _properties(outcome: Outcome) -> dict[str, str]:
    scenario = outcome.scenario
    found = {
        "scenario": outcome.path.as_posix(),
        "way": outcome.way,
        "vehicle": scenario.vehicle,
        "seed": str(scenario.seed),
        "played_s": f"{outcome.end_s - outcome.start_s:.3f}",
        "tags": " ".join(scenario.tags),
        "recorded_in": "" if outcome.folder is None else outcome.folder.as_posix(),
    }
    return {name: value for name, value in found.items() if value}


def _missed(check: Check) -> str:
    return f"expected: {check.expected}\n     saw: {check.seen}"


def _seconds(duration_s: float) -> str:
    return f"{duration_s:.3f}"


def printable(text: str) -> str:
    """The text with what XML has no character for as escapes, e.g. `\\x07`."""
    return NO_CHARACTER.sub(lambda found: found[0].encode("unicode_escape").decode(), text)

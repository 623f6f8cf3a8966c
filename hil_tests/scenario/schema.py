"""JSON Schema of scenario files, for editors: made of the model and of the table of failures.

An editor that knows it completes `failure:` once `subject:` is there, shows which quantities the failure needs and
what they mean, and marks what is wrong while it is written. Draft 7 is what most of them understand.
"""

from __future__ import annotations

import json
from math import inf
from pathlib import Path
from typing import Any

from hil_tests.scenario.document import Scenario
from hil_tests.scenario.entry import Beginning, entry_model
from hil_tests.scenario.expectations import EXPECTED, FORBIDDEN
from hil_tests.scenario.failures import TABLE, FailureKind, Target, kinds_of
from hil_tests.scenario.fault import BUS_NAME, SINGLE, THRUSTER_NUMBER

SCHEMA_FILE = Path(__file__).with_name("scenario.schema.json")
DIALECT = "http://json-schema.org/draft-07/schema#"

Schema = dict[str, Any]

_NUMBERED = {
    Target.THRUSTER: ("thruster N", f"^thruster {THRUSTER_NUMBER}$", "what really happens to it"),
    Target.RPM: ("thruster N rpm", f"^thruster {THRUSTER_NUMBER} rpm$", "what is reported of its speed"),
    Target.COMMAND: ("thruster N command", f"^thruster {THRUSTER_NUMBER} command$", "what its ESC is told"),
    Target.BUS: ("a CAN bus", f"^(?!thruster)(?!({'|'.join(SINGLE)})$){BUS_NAME}$", "by its name, such as can0"),
}


def scenario_schema() -> Schema:
    """The schema, as JSON's own types."""
    schema: Schema = _cleaned(Scenario.model_json_schema())
    definitions = schema["$defs"]
    del definitions["Subject"]
    definitions["Fault"] = _fault()
    definitions |= {_name(row): _row(row) for row in TABLE}
    for name, kinds in (("Expectation", EXPECTED), ("Prohibition", FORBIDDEN)):
        definitions[name]["oneOf"] = [{"required": [kind]} for kind in kinds]
    return {"$schema": DIALECT, "title": "HIL scenario", **schema}


def schema_text() -> str:
    """The schema as it is shipped."""
    return json.dumps(scenario_schema(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _cleaned(node: Any) -> Any:
    """Without the titles that pydantic makes, and without the nulls: what is null is left out in a file."""
    if isinstance(node, list):
        return [_cleaned(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = {key: _cleaned(value) for key, value in node.items() if not _is_noise(key, value)}
    branches = [branch for branch in kept.get("anyOf", []) if branch != {"type": "null"}]
    if len(branches) == 1:
        del kept["anyOf"]
        return branches[0] | kept
    return kept | ({"anyOf": branches} if branches else {})


def _is_noise(key: str, value: object) -> bool:
    return (key == "title" and isinstance(value, str)) or (key == "default" and value in (None, inf))


def _fault() -> Schema:
    beginning = _cleaned(Beginning.model_json_schema())
    one = {"anyOf": [_subject(target) for target in Target]}
    beginning["properties"]["subject"] |= {
        "anyOf": [*one["anyOf"], {"type": "array", "items": one, "minItems": 1, "description": "each of them"}]
    }
    return {
        "description": "What goes wrong: on whom, when, and how badly.",
        "type": "object",
        "required": beginning["required"],
        "properties": beginning["properties"],
        "allOf": [_where_of(target) for target in Target],
    }


def _subject(target: Target) -> Schema:
    if target in _NUMBERED:
        name, pattern, text = _NUMBERED[target]
        return {"type": "string", "pattern": pattern, "description": f"{name}: {text}"}
    return {"const": next(name for name, known in SINGLE.items() if known is target)}


def _where_of(target: Target) -> Schema:
    """What an entry can be whose subject is of a target, alone or among others."""
    befalls = {"anyOf": [_subject(target), {"type": "array", "contains": _subject(target)}]}
    rows = kinds_of(target).values()
    failures = [{"const": row.failure, "description": row.text} for row in rows]
    return {
        "if": {"required": ["subject"], "properties": {"subject": befalls}},
        "then": {"properties": {"failure": {"oneOf": failures}}, "allOf": list(map(_keys_of, rows))},
    }


def _keys_of(row: FailureKind) -> Schema:
    is_row = {"required": ["failure"], "properties": {"failure": {"const": row.failure}}}
    return {"if": is_row, "then": {"$ref": f"#/$defs/{_name(row)}"}}


def _row(row: FailureKind) -> Schema:
    own = _cleaned(entry_model(row).model_json_schema())
    shared = Beginning.model_fields
    return {
        "description": row.text,
        "additionalProperties": False,
        "required": [key for key in own["required"] if key not in shared],
        "properties": {key: True if key in shared else value for key, value in own["properties"].items()},
    }


def _name(row: FailureKind) -> str:
    return f"{row.target}_{row.failure}"

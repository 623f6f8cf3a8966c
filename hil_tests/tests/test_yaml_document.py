"""YAML files: plain values with their lines, and whatever is no such file is told and not raised."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_tests.yaml_document import DocumentError, read_text


def problem(text: str) -> str:
    with pytest.raises(DocumentError) as caught:
        read_text(text, "file.yaml")
    (found,) = caught.value.problems
    return str(found)


def test_values_and_their_lines() -> None:
    document = read_text("a: 1\nb:\n  - x: off\n    y: 0x1F\n  - 1e3\n", "file.yaml")
    assert document.data == {"a": 1, "b": [{"x": "off", "y": 31}, 1000.0]}
    lines = {("a",): 1, ("b",): 2, ("b", 0): 3, ("b", 0, "y"): 4, ("b", 1): 5}
    assert {location: document.line(location) for location in lines} == lines


def test_the_line_of_what_is_not_there_is_that_of_what_it_belongs_to() -> None:
    document = read_text("a: 1\nb:\n  - x: 1\n", "file.yaml")
    assert document.line(("b", 0, "z")) == 3
    assert document.line(("c", "d")) == 1
    assert document.line(("a", "d")) == 1


def test_an_empty_file_is_an_empty_table() -> None:
    assert read_text("", "file.yaml").data == {}
    assert read_text("# nothing\n", "file.yaml").data == {}


def test_nothing_is_left_out_and_null_is_said() -> None:
    assert read_text("a:\nb: null\nc: {d: ~, e: }\n", "file.yaml").data == {"b": None, "c": {"d": None}}


def test_aliases_are_what_they_stand_for() -> None:
    assert read_text("a: &x {b: 1}\nc: *x\n", "file.yaml").data == {"a": {"b": 1}, "c": {"b": 1}}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("a: [1", "file.yaml:1: not valid YAML"),
        ("a: 1\n b: 2", "file.yaml:2: not valid YAML"),
        ("a: 1\na: 2", "file.yaml:2: a: is there twice: want one of them"),
        ("a:\n  - b: 1\n    b: 2", "file.yaml:3: a[0].b: is there twice"),
        ("a: 1\n---\nb: 1", "not valid YAML"),
        ("a: !!python/name:os.system x", "cannot be read"),
        ("a: !thing {b: 1}", 'file.yaml:1: a = "!thing": a tag of YAML that means nothing here'),
        ("? [1, 2]\n: 3", "a key that is no word"),
        ("a: &x [*x]", "things in things without end"),
        ("a: \x00", "not valid YAML"),
        ("[" * 3000, "without end"),
        (f"a: {'9' * 5000}", "cannot be read: want a plain number or text"),
    ],
    ids=lambda text: text[:20].replace("\x00", "NUL"),
)
def test_what_is_no_such_file(text: str, wanted: str) -> None:
    assert wanted in problem(text)


def test_a_short_text_cannot_stand_for_more_than_memory_holds() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    assert "without end" in problem("\n".join(lines))


@given(st.text(st.sampled_from("ab:-[]{}#&*!?|>%@`\"', \n\t0."), max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        document = read_text(text, "file.yaml")
    except DocumentError as error:
        assert error.problems
    else:
        assert document.line(()) == 1

"""Texts that make the TOML parser itself fail."""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.config import parse
from gateway.problems import ConfigError


@pytest.mark.parametrize(
    "text",
    [f"number = {'9' * 5000}", f"a = {'[' * 5000}", f"a = {'{a = ' * 5000}"],
    ids=["a number of 5000 digits", "lists in lists", "tables in tables"],
)
def test_it_is_refused_in_words(text):
    with pytest.raises(ConfigError, match="not valid TOML"):
        parse(text, Path())


@pytest.mark.parametrize(
    "value", [f"0x{'f' * 8000}", f"{{{'a.' * 2000}b = 1}}"], ids=["a number", "tables in tables"]
)
def test_a_value_too_large_to_be_shown_is_a_problem_like_others(value):
    with pytest.raises(ConfigError, match=r"unknown = .* too large to show"):
        parse(f"unknown = {value}", Path())


def test_a_thruster_is_not_called_by_a_number_that_cannot_be_shown():
    large = f"0x{'f' * 8000}"
    with pytest.raises(ConfigError, match=r"thruster\[0\]"):
        parse(f"[[thruster]]\nnumber = {large}", Path())


def test_no_file_has_a_name_of_thousands_of_letters():
    name = 5000 * "x"
    with pytest.raises(ConfigError, match=r"can\[name=a\].database = .*: no such file"):
        parse(f'[[can]]\nname = "a"\nchannel = "a"\nprotocol = "dbc"\ndatabase = "{name}.dbc"', Path())

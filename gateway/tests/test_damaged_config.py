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

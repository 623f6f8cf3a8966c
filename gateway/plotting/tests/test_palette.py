"""Colours that are seen in sunlight and at night, by all."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from gateway.plotting.figure import Colour
from gateway.plotting.palette import DARK_INK, DAY, LIGHT_INK, NIGHT, Palette, contrast, filled, ink, night_colours

PAPER, DARK_GROUND = "#ffffff", "#0f161c"
LEVELS = (Colour.UNKNOWN, Colour.NORMAL, Colour.SUSPECT, Colour.FAULT)
# what is drawn side by side in one panel
TOGETHER = (
    LEVELS,
    (Colour.MEASURED, Colour.PREDICTED, Colour.FAULT),
    (Colour.MEASURED, Colour.PREDICTED, Colour.OTHER),
    (Colour.OTHER, Colour.COMMAND),
    (Colour.FAINT, Colour.FAULT, Colour.MEASURED),
)
# Machado, Oliveira, Fernandes 2009: what who lacks the cones for red, or for green, sees of linear red, green, blue
BLIND = {
    "red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
}


@pytest.mark.parametrize(("palette", "ground"), [(DAY, PAPER), (NIGHT, DARK_GROUND)])
def test_lines_stand_out_from_the_ground(palette: Palette, ground: str) -> None:
    assert set(palette) == set(Colour)
    for name, colour in palette.items():
        assert contrast(colour, ground) >= 3.0, name


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)


def test_words_on_bars_can_be_read() -> None:
    for level in LEVELS:
        assert contrast(ink(DAY[level]), DAY[level]) >= 4.5
    at_night = night_colours()[LIGHT_INK]
    assert at_night == DARK_INK
    for colour in Colour:
        assert contrast(at_night, NIGHT[colour]) >= 4.5


@pytest.mark.parametrize("palette", [DAY, NIGHT])
@pytest.mark.parametrize("cones", list(BLIND))
def test_the_colour_blind_can_tell_what_is_drawn_together(palette: Palette, cones: str) -> None:
    for group in TOGETHER:
        for one, other in combinations(group, 2):
            apart = np.linalg.norm(_seen(palette[one], cones) - _seen(palette[other], cones))
            assert apart > 0.1, f"{one} and {other}"


def _seen(colour: str, cones: str) -> np.ndarray:
    """In Oklab (Ottosson 2020), in which equal distances look about equal."""
    encoded = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.array(BLIND[cones]) @ linear, 0.0, 1.0)
    to_lms = [[0.4122215, 0.5363325, 0.0514460], [0.2119035, 0.6806995, 0.1073970], [0.0883025, 0.2817188, 0.6299787]]
    to_lab = [
        [0.2104543, 0.7936178, -0.0040720],
        [1.9779985, -2.4285922, 0.4505937],
        [0.0259040, 0.7827718, -0.8086758],
    ]
    return np.array(to_lab) @ np.cbrt(np.array(to_lms) @ linear)


def test_surfaces() -> None:
    assert filled("#0a5cad", 0.2) == "rgba(10,92,173,0.2)"

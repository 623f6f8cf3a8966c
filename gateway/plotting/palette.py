"""Which colour stands for what: in daylight, and on a dark ground.

Every line has a contrast of 3 or more to its ground (WCAG 2, 1.4.11), so that it is seen in sunlight. The levels
differ in lightness as well as in hue: who cannot tell red from green can tell them.
"""

from __future__ import annotations

from collections.abc import Mapping

from gateway.plotting.figure import Colour

Palette = Mapping[Colour, str]

DAY: Palette = {
    Colour.MEASURED: "#0a5cad",
    Colour.PREDICTED: "#d46c00",
    Colour.COMMAND: "#7a3fb5",
    Colour.RESIDUAL: "#b5176b",
    Colour.THRESHOLD: "#a8001c",
    Colour.OTHER: "#00857a",
    Colour.FAINT: "#8795a1",
    Colour.UNKNOWN: "#83909c",
    Colour.NORMAL: "#0b735a",
    Colour.SUSPECT: "#cc8200",
    Colour.FAULT: "#c60d1d",
}
NIGHT: Palette = {
    Colour.MEASURED: "#5db0ff",
    Colour.PREDICTED: "#ffae42",
    Colour.COMMAND: "#b48cff",
    Colour.RESIDUAL: "#ff7ab8",
    Colour.THRESHOLD: "#ff7070",
    Colour.OTHER: "#3fd0c0",
    Colour.FAINT: "#7c8b98",
    Colour.UNKNOWN: "#8b99a6",
    Colour.NORMAL: "#39e0b4",
    Colour.SUSPECT: "#ffb800",
    Colour.FAULT: "#ff3b3b",
}
DARK_INK, LIGHT_INK = "#10181f", "#ffffff"
BAND_OPACITY, SPAN_OPACITY = 0.2, 0.13
NIGHT_DENSER = 1.5
# of linear light, red, green, blue (WCAG 2, relative luminance)
_LUMINANCE = (0.2126, 0.7152, 0.0722)


def night_colours() -> dict[str, str]:
    """Each colour that `to_plotly` may use, and what it is on a dark ground: a page exchanges them."""
    found = {LIGHT_INK: DARK_INK}  # all colours of the night are light
    for colour, day in DAY.items():
        night = NIGHT[colour]
        found[day] = night
        found |= {
            filled(day, opacity): filled(night, NIGHT_DENSER * opacity) for opacity in (BAND_OPACITY, SPAN_OPACITY)
        }
    return found


def filled(colour: str, opacity: float) -> str:
    """Of a surface: "#0a5cad" as "rgba(10,92,173,0.2)"."""
    red, green, blue = _channels(colour)
    return f"rgba({red},{green},{blue},{opacity:g})"


def ink(ground: str) -> str:
    """The colour of a text that is readable on that colour."""
    return max((LIGHT_INK, DARK_INK), key=lambda text: contrast(text, ground))


def contrast(one: str, other: str) -> float:
    """From 1 (the same lightness) to 21 (black on white): WCAG 2, contrast ratio."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    shares = (channel / 255.0 for channel in _channels(colour))
    linear = (share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares)
    return sum(weight * light for weight, light in zip(_LUMINANCE, linear, strict=True))


def _channels(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)

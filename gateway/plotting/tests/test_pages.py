"""What pages with figures have in common."""

from __future__ import annotations

import json
from base64 import b64decode
from gzip import decompress
from pathlib import Path

import numpy as np

from gateway.plotting.figure import Colour, Figure, Line, Panel
from gateway.plotting.pages import Drawings, environment, library, packed
from gateway.plotting.palette import night_colours


def figure(name: str, main: bool = True) -> Figure:
    line = Line("speed", np.arange(3.0), np.array([1.0, np.nan, 3.0]), Colour.MEASURED)
    return Figure(name, f"About {name}", (Panel("m/s", (line,)),), about="It shows it.", main=main)


def test_packed_text_is_unpacked() -> None:
    assert decompress(b64decode(packed("T3 ✓"))).decode() == "T3 ✓"
    assert packed("T3 ✓") == packed("T3 ✓")


def test_every_figure_has_a_place_and_a_drawing() -> None:
    drawings = Drawings.of([figure("one"), figure("two", main=False)])
    assert [(one.number, one.name, one.title, one.main) for one in drawings.places] == [
        (0, "one", "About one", True),
        (1, "two", "About two", False),
    ]
    drawn = json.loads(decompress(b64decode(drawings.packed)))
    assert [one["layout"]["height"] for one in drawn] == [one.height_px for one in drawings.places]
    assert drawn[0]["data"][0]["y"] == [1.0, None, 3.0]
    assert Drawings.of([]).places == []


def test_the_common_pieces_are_found_beside_the_pages_own(tmp_path: Path) -> None:
    (tmp_path / "own.html").write_text(
        "{% from 'figure_places.html' import places_of %}{{ name }}{{ places_of(places) }}"
        "{% include 'figure_style.html' %}{% include 'figure_script.html' %}"
    )
    places = Drawings.of([figure("one")]).places
    text = environment(tmp_path).get_template("own.html").render(name="<i>", places=places)
    assert text.startswith("&lt;i&gt;")
    assert '<figure id="one">' in text
    assert library() in text
    for day, night in night_colours().items():
        assert f'"{day}": "{night}"' in text

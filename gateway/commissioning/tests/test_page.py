"""The page tells all that was learnt and all that is missing, and needs nothing but itself."""

import re
from pathlib import Path

import numpy as np
import pytest

from gateway.commissioning.page import page
from gateway.commissioning.part import Part, Quantity, Setting, told_once
from gateway.commissioning.session import Commissioning
from gateway.commissioning.tests.made_thrusters import dive, samples
from gateway.plotting.figure import Colour, Figure, Line, Panel

LINE = Line("<b>x", np.arange(3.0), np.arange(3.0), Colour.MEASURED)
FIGURE = Figure("thruster-1-curve", "T1 <script>alert(1)</script>", (Panel("rpm", (LINE,)),), over_time=False)
SETTING = Setting("detector.thruster.caution", 1.3, "for 0.1 an hour")


def found(*parts, settings=(SETTING,), text="[vehicle]\n"):
    return Commissioning((dive({1: samples(20.0)}, "<i>first"),), parts, settings, text, None)


@pytest.fixture(scope="module")
def written():
    part = Part("thruster 1", quantities=(Quantity("delay", "0.05 s", "of <9> steps"),), figures=(FIGURE,))
    return page(found(part), "ROV & <co>", Path("/sea/rov.toml"))


def test_what_was_learnt_is_told(written):
    for told in ("All was learnt", "detector.thruster.caution", "1.3", "for 0.1 an hour", "0.05 s", "rov.toml"):
        assert told in written
    assert '<figure id="thruster-1-curve">' in written


def test_what_others_wrote_is_escaped(written):
    assert "ROV &amp; &lt;co&gt;" in written
    assert "of &lt;9&gt; steps" in written
    assert "&lt;i&gt;first" in written
    assert "alert(1)</script>" not in written


def test_nothing_is_loaded_from_elsewhere(written):
    assert not re.search(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", written)


def test_what_is_missing_comes_first():
    told = page(found(Part("speed", missing=("no turns",)), settings=(), text=None), "ROV", Path("rov.toml"))
    assert "Nothing was learnt" in told
    assert told.index("speed: no turns") < told.index("<h2>")


def test_something_missing_is_not_all():
    told = page(found(Part("speed", missing=("no turns",))), "ROV", Path("rov.toml"))
    assert "Something is missing" in told


def test_what_several_miss_is_told_once():
    parts = [Part(f"thruster {one}", missing=("too short", f"only {one}")) for one in (1, 2)]
    assert list(told_once(parts, lambda part: part.missing)) == [
        "thruster 1, thruster 2: too short",
        "thruster 1: only 1",
        "thruster 2: only 2",
    ]

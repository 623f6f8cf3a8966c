"""Bars: which side, how long, where the threshold is."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.watch.bar import bar


@pytest.mark.parametrize(
    ("share", "drawn"),
    [
        (nan, "    ┊   │   ┊    "),
        (0.0, "    ┊   │   ┊    "),
        (0.5, "    ┊   │██ ┊    "),
        (-0.5, "    ┊ ██│   ┊    "),
        (0.55, "    ┊   │██ ┊    "),
        (0.65, "    ┊   │██▌┊    "),
        (-0.65, "    ┊▐██│   ┊    "),
        (1.0, "    ┊   │███╂    "),
        (-1.5, "  ██╂███│   ┊    "),
        (2.0, "    ┊   │███╂████"),
        (-2.1, "◀███╂███│   ┊    "),
        (inf, "    ┊   │███╂███▶"),
    ],
)
def test_it_reaches_from_the_centre_as_far_as_the_share(share, drawn):
    assert bar(share, 17) == drawn


@given(st.floats(-5.0, 5.0), st.sampled_from([9, 13, 17, 25]))
def test_the_other_sign_is_its_mirror_image(share, width):
    mirror = str.maketrans("▌▐▶◀", "▐▌◀▶")
    assert bar(-share, width) == bar(share, width)[::-1].translate(mirror)
    assert len(bar(share, width)) == width


@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_more_is_never_drawn_shorter(a, b):
    low, high = sorted((a, b))
    blanks = [bar(share, 25)[13:].count(" ") for share in (low, high)]
    assert blanks[0] >= blanks[1]


@pytest.mark.parametrize("width", [0, 7, 12])
def test_a_width_without_a_centre_is_refused(width):
    with pytest.raises(ValueError, match=f"width = {width}: want an odd number"):
        bar(0.5, width)

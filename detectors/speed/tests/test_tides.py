"""Tidal constituents against the tables of those who publish them."""

from __future__ import annotations

from math import degrees

import pytest

from detectors.speed.tides import CONSTITUENTS

# Degrees an hour, as NOAA's tide tables print them.
PUBLISHED_SPEEDS = {
    "M2": 28.984104,
    "S2": 30.0,
    "N2": 28.43973,
    "K2": 30.082138,
    "2N2": 27.895355,
    "MU2": 27.968208,
    "NU2": 28.512583,
    "LAMBDA2": 29.455626,
    "T2": 29.958933,
    "K1": 15.041069,
    "O1": 13.943035,
    "P1": 14.958931,
    "Q1": 13.398661,
    "RHO1": 13.471515,
    "J1": 15.585443,
    "OO1": 16.139101,
    "MF": 1.0980331,
    "MM": 0.5443747,
    "SSA": 0.0821373,
    "SA": 0.0410686,
    "MK3": 44.025173,
    "M4": 57.96821,
    "MS4": 58.984104,
    "MN4": 57.423832,
    "S4": 60.0,
    "M6": 86.95232,
}


def test_every_constituent_turns_as_fast_as_the_tables_say():
    speeds = {name: degrees(each.frequency_radps) * 3600 for name, each in CONSTITUENTS.items()}
    assert speeds == pytest.approx(PUBLISHED_SPEEDS, rel=1e-7, abs=1e-6)

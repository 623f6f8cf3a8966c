"""Tidal constituents against the tables of those who publish them."""

from __future__ import annotations

from math import degrees, radians, remainder, tau

import pytest

from detectors.speed.tides import CONSTITUENTS, constituent

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


# Computed with UTide 0.4, at 50 degrees of latitude: unix time, name, f, V + u in degrees.
UTIDE = [
    (1142321400, "M2", 0.9634, 233.77),
    (1142321400, "S2", 1.0022, 225.00),
    (1142321400, "N2", 0.9619, 42.07),
    (1142321400, "K2", 1.3187, 206.88),
    (1142321400, "K1", 1.1128, 193.57),
    (1142321400, "O1", 1.1784, 40.99),
    (1142321400, "P1", 0.9890, 30.77),
    (1142321400, "Q1", 1.1633, 210.64),
    (1142321400, "M4", 0.9282, 107.54),
    (1142321400, "MS4", 0.9655, 98.76),
    (1142321400, "MK3", 1.0722, 67.34),
    (1448042400, "M2", 1.0383, 316.56),
    (1448042400, "S2", 0.9979, 180.00),
    (1448042400, "N2", 1.0343, 335.39),
    (1448042400, "K2", 0.7467, 297.85),
    (1448042400, "K1", 0.8812, 238.98),
    (1448042400, "O1", 0.8002, 77.96),
    (1448042400, "P1", 1.0112, 300.54),
    (1448042400, "Q1", 0.8032, 97.84),
    (1448042400, "M4", 1.0781, 273.12),
    (1448042400, "MS4", 1.0362, 136.55),
    (1448042400, "MK3", 0.9150, 195.54),
    (1717243200, "M2", 0.9648, 129.44),
    (1717243200, "S2", 1.0022, 0.02),
    (1717243200, "N2", 0.9611, 120.88),
    (1717243200, "K2", 1.3104, 137.07),
    (1717243200, "K1", 1.1111, 338.73),
    (1717243200, "O1", 1.1722, 151.68),
    (1717243200, "P1", 0.9884, 19.45),
    (1717243200, "Q1", 1.1699, 144.76),
    (1717243200, "M4", 0.9308, 258.87),
    (1717243200, "MS4", 0.9669, 129.45),
    (1717243200, "MK3", 1.0720, 108.16),
]


@pytest.mark.parametrize(("time_s", "name", "factor", "phase_deg"), UTIDE)
def test_phase_and_nodal_corrections_are_those_of_an_independent_program(time_s, name, factor, phase_deg):
    # it has corrections of the third order, too, which P1 and Q1 show most: 0.012 of f, 1.8 degrees of u
    here = constituent(name)
    f, u = here.nodal(time_s)
    assert f == pytest.approx(factor, abs=0.02)
    off = here.argument_rad(time_s) + u - radians(phase_deg)
    assert degrees(remainder(off, tau)) == pytest.approx(0, abs=2)


@pytest.mark.parametrize("name", CONSTITUENTS)
def test_phase_turns_with_the_frequency(name):
    here, time_s = constituent(name), 1_700_000_000.0
    turned = here.argument_rad(time_s + here.period_s * 1.25) - here.argument_rad(time_s)
    assert remainder(turned - tau / 4, tau) == pytest.approx(0, abs=1e-6)


def test_names_in_small_letters_are_known_and_others_are_refused():
    assert constituent("m2") is CONSTITUENTS["M2"]
    with pytest.raises(ValueError, match=r"tidal constituent 'M9': want one of M2, S2"):
        constituent("M9")

"""`--transmit`: what it names may be sent, and nothing else."""

from __future__ import annotations

import pytest

from drivers.can.frame import CanFrame
from hil_tests.bridge.transmission import SHOWN, TransmitGate, parse_transmission


def frame(identifier, extended=True, error=False):
    return CanFrame(0.0, identifier, b"", extended, error=error)


ESC_STATUS = 0x1404_0A00  # of node 0

CASES = [
    # --transmit, identifier, extended, allowed
    ("all", 0x123, False, True),
    ("ALL", 0x1FFF_FFFF, True, True),
    ("7E0", 0x7E0, False, True),
    ("0x7e0", 0x7E0, False, True),
    ("7E0", 0x7E1, False, False),
    ("7E0", 0x7E0, True, False),  # the same number with 29 bits is another
    ("000007E0", 0x7E0, True, True),
    ("000007E0", 0x7E0, False, False),
    ("7E0-7E2", 0x7DF, False, False),
    ("7E0-7E2", 0x7E0, False, True),
    ("7E0-7E2", 0x7E2, False, True),
    ("7E0-7E2", 0x7E3, False, False),
    ("7E0-7E2", 0x7E1, True, False),
    ("14040A00:1FFFFF00", ESC_STATUS | 0x0B, True, True),
    ("14040A00:1FFFFF00", 0x1404_0B0B, True, False),
    ("700:700", 0x7FF, False, True),
    ("700:700", 0x6FF, False, False),
    ("node:20", ESC_STATUS | 20, True, True),
    ("node:20", ESC_STATUS | 21, True, False),
    ("node:20", 20, False, False),  # DroneCAN has no frames of 11 bits
    ("node:20-27", ESC_STATUS | 27, True, True),
    ("node:20-27", ESC_STATUS | 28, True, False),
    ("node:20-27", ESC_STATUS | 0x80 | 20, True, True),  # a service's; the bit above belongs to something else
    ("7E0, node:20", ESC_STATUS | 20, True, True),
    ("7E0, node:20", 0x7E0, False, True),
    ("7E0, node:20", 0x7E1, False, False),
]


@pytest.mark.parametrize(("text", "identifier", "extended", "allowed"), CASES)
def test_what_is_named_is_allowed_and_nothing_else(text, identifier, extended, allowed):
    transmission = parse_transmission(text)
    assert transmission.allows(frame(identifier, extended)) is allowed
    assert not transmission.allows(frame(0x40, extended=False, error=True))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("", "want identifiers in hex with all their digits"),
        ("7E", "'7E': want identifiers"),
        ("12345", "three: 11 bits, eight: 29 bits"),
        ("xyz", "DroneCAN nodes in decimal: node:20"),
        ("7E0,", "'': want"),
        ("7E0-000007E8", "as many digits"),
        ("7E8-7E0", "the lower identifier stands first"),
        ("800", r"must lie in 000\.\.7FF"),
        ("20000000", r"must lie in 00000000\.\.1FFFFFFF"),
        ("7E0:FFF", r"must lie in 000\.\.7FF"),
        ("node:0", r"1\.\.127"),
        ("node:128", r"1\.\.127"),
        ("node:27-20", "the lower one first"),
        ("node:x", "want"),
        ("all,7E0", "all stands alone"),
        ("7E0-7E8-7EF", "want"),
    ],
)
def test_what_cannot_be_read_is_said_with_what_would_be_right(text, wanted):
    with pytest.raises(ValueError, match=wanted) as told:
        parse_transmission(text)
    assert str(told.value).startswith("--transmit")


def test_what_is_lacking_is_named_once_and_as_candump_shows_it():
    sent = [
        frame(0x7E1, extended=False),
        frame(ESC_STATUS | 21),
        frame(ESC_STATUS | 20),
        frame(0x7E1, extended=False),
    ]
    assert parse_transmission("node:20").lacking(sent) == ("7E1", "14040A15")
    assert parse_transmission("all").lacking(sent) == ()


def test_the_gate_keeps_the_order_and_counts_what_it_keeps_back():
    gate = TransmitGate(parse_transmission("7E0-7E7"))
    sent = [frame(0x7E0 + number, extended=False) for number in range(16)] * 2
    passed = gate.passed(sent)
    assert [one.identifier - 0x7E0 for one in passed] == [*range(8)] * 2
    assert gate.refused == 16 and len(gate.identifiers) == SHOWN
    assert gate.line().startswith("16 frames not sent, for --transmit does not name them: 7E8, 7E9")


def test_a_gate_that_has_kept_nothing_back_has_nothing_to_say():
    gate = TransmitGate(parse_transmission("all"))
    assert gate.passed([frame(1)]) == [frame(1)] and gate.line() == ""

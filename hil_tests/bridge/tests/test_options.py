"""How bridges are named on the command line."""

from __future__ import annotations

import pytest

from hil_tests.bridge.options import parse_buses, parse_endpoints

AUTOPILOT, GATEWAY = "serial:/dev/ttyACM0:115200", "udpout:[::1]:14551"


def test_what_is_right_is_read():
    assert parse_buses("can0:can1") == ("can0", "can1")
    assert parse_endpoints(f"{AUTOPILOT}={GATEWAY}") == (AUTOPILOT, GATEWAY)


@pytest.mark.parametrize("text", ["", "can0", "can0:", ":can1", "can0:can0", "can0:can1:can2"])
def test_two_buses_are_wanted(text):
    with pytest.raises(ValueError, match="want two interfaces, that of the autopilot first, such as can0:can1"):
        parse_buses(text)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (AUTOPILOT, "want two endpoints, that of the autopilot first"),
        (f"{GATEWAY}={GATEWAY}", "want two endpoints"),
        (f"{AUTOPILOT}={GATEWAY}={GATEWAY}", "want two endpoints"),
        (f"{AUTOPILOT}=", "endpoint must be udpin"),
        (f"{AUTOPILOT}=udp:127.0.0.1:14551", "endpoint must be udpin"),
        (f"{AUTOPILOT}=udpout:127.0.0.1:70000", "port must lie in"),
    ],
)
def test_two_endpoints_are_wanted(text, wanted):
    with pytest.raises(ValueError, match=wanted):
        parse_endpoints(text)

"""Which buses are virtual: in doubt, none."""

from __future__ import annotations

import pytest

from drivers.can.tests.conftest import vcan0  # noqa: F401  fixture
from hil_tests.bridge.network_kind import UNKNOWN, bus_of, parse_kind
from hil_tests.bridge.permission import ABSENT

ANSWERS = [
    (b'[{"ifname":"can0","link_type":"can","linkinfo":{"info_kind":"can","info_data":{"bittiming":{}}}}]', "can"),
    (b'[{"ifname":"vcan0","link_type":"can","linkinfo":{"info_kind":"vcan"}}]', "vcan"),
    (b'[{"ifname":"slcan0","link_type":"can"}]', "can"),
    (b'[{"ifname":"eth0","link_type":"ether"}]', "ether"),
    (b'[{"ifname":"can0","linkinfo":{"info_kind":7}}]', None),
    (b'[{"linkinfo":[]}]', None),
    (b"[]", None),
    (b"[1, 2]", None),
    (b"{}", None),
    (b"", None),
    (b"\xff[", None),
]


@pytest.mark.parametrize(("answer", "kind"), ANSWERS)
def test_the_kind_of_an_interface(answer, kind):
    assert parse_kind(answer) == kind


def test_buses_of_python_can_are_real_but_its_virtual_one():
    assert bus_of("virtual", "bench").virtual
    assert not bus_of("pcan", "PCAN_USBBUS1").virtual
    assert not bus_of("udp_multicast", "239.0.0.1").virtual  # others may hear it


def test_an_interface_that_nothing_is_known_of_is_real(monkeypatch):
    monkeypatch.setenv("PATH", "")  # where `ip` is not
    bus = bus_of("socketcan", "lo")
    assert (bus.virtual, bus.kind) == (False, UNKNOWN)


def test_an_interface_that_there_is_none_of_is_not_virtual():
    bus = bus_of("socketcan", "nocan0")
    assert (bus.virtual, bus.kind) == (False, ABSENT)


@pytest.mark.vcan
def test_a_virtual_bus_of_the_kernel_is_known_as_one(vcan0):  # noqa: F811
    bus = bus_of("socketcan", vcan0)
    assert (bus.virtual, bus.kind) == (True, "vcan")

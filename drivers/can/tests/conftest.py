"""A real SocketCAN bus, where the machine has one."""

import os
import shutil
import socket
import subprocess

import pytest

INTERFACE = "vcan0"
OWN_INTERFACE = "vcangw0"


def ip_link(*words):
    """`ip link ...` as root."""
    subprocess.run(["ip", "link", *words], check=True, capture_output=True, text=True)


@pytest.fixture
def vcan0():
    """Name of the machine's virtual CAN bus."""
    if INTERFACE not in [name for _, name in socket.if_nameindex()]:
        pytest.skip(
            f"NO REAL BUS: this machine has no {INTERFACE}; as root: modprobe vcan; "
            f"ip link add dev {INTERFACE} type vcan; ip link set {INTERFACE} up"
        )
    return INTERFACE


@pytest.fixture
def own_vcan(vcan0):
    """Name of a virtual CAN bus, up, that the test may take down, delete and make again."""
    if os.geteuid() != 0 or shutil.which("ip") is None:
        pytest.skip("NO REAL BUS TO TAKE DOWN: needs root and the ip command")
    ip_link("add", "dev", OWN_INTERFACE, "type", "vcan")
    ip_link("set", OWN_INTERFACE, "up")
    yield OWN_INTERFACE
    subprocess.run(["ip", "link", "del", OWN_INTERFACE], check=False, capture_output=True)

"""MAVProxy as the ground station: its log holds our texts, our values, what we ask, and the answers to its user."""

from __future__ import annotations

import hashlib
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.loopback import free_port
from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.ground_station import COMPONENT_ID, SYSTEM_ID, GroundStation, program
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.rig.router import Endpoint, UdpRouter
from hil_tests.tests.live_rig import HOST, live
from hil_tests.tests.scene import configuration, key_file

HOLD = 'thruster_fault = ["hold"]\ndelay_s = 0.5\n'
GATEWAY = 192
PASSPHRASE = "submarine"  # noqa: S105  of this test only
ACKNOWLEDGE, ACCEPT, MUTE = 31010, 31011, 31012

pytestmark = pytest.mark.skipif(not program().exists(), reason="MAVProxy is not installed")


def logged(station: GroundStation, kind: str) -> list[Any]:
    """Messages of the gateway in the ground station's log: it speaks as a component of the vehicle."""
    sender = (1, GATEWAY)
    return [
        one
        for one in station.logged()
        if one.get_type() == kind and (one.get_srcSystem(), one.get_srcComponent()) == sender
    ]


def texts(station: GroundStation) -> list[str]:
    return [one.text for one in logged(station, "STATUSTEXT")]


@pytest.mark.parametrize(("make", "held"), [(ArduSub, Mode.ALT_HOLD), (Px4, MainMode.ALTCTL)], ids=["ardusub", "px4"])
async def test_in_between_it_passes_on_what_is_asked_and_logs_what_is_said(make, held, tmp_path, request):
    port, master = free_port(), free_port()
    config = configuration(tmp_path, HOLD, port=port, channel=request.node.name, rate_hz=50.0)
    with GroundStation(tmp_path, f"udpin:{HOST}:{master}", [f"udpout:{HOST}:{port}"]) as station:
        async with live(config, make(), request.node.name, master) as rig:
            await rig.learnt()
            rig.vehicle.scene.entangle(1)
            await rig.until(lambda: rig.vehicle.said("Hold done for T1"))
            await rig.until(lambda: "Hold done for T1" in texts(station) and logged(station, "NAMED_VALUE_FLOAT"))
    assert rig.vehicle.commander.mode is held
    assert any("T1 entangled" in text for text in texts(station))
    asked = [(one.command, one.param2) for one in logged(station, "COMMAND_LONG") if one.command == 176]
    assert asked == [(176, 2.0)]
    assert logged(station, "HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_CRITICAL
    assert "T1" in {one.name for one in logged(station, "NAMED_VALUE_FLOAT")}


@pytest.mark.parametrize(
    ("make", "passphrase"), [(Px4, None), (ArduSub, PASSPHRASE)], ids=["px4-unsigned", "ardusub-signed"]
)
async def test_its_user_is_answered(make, passphrase, tmp_path, request):
    port = free_port()
    key = hashlib.sha256(passphrase.encode()).digest() if passphrase else None
    signing = key_file(tmp_path, key) if key else ""
    config = configuration(tmp_path, "", mavlink=signing, port=port, channel=request.node.name, rate_hz=50.0)
    vehicle, gateway, ground = Endpoint(), Endpoint((HOST, port)), Endpoint()
    station = GroundStation(tmp_path, f"udpout:{HOST}:{ground.port}", (), GATEWAY, passphrase)
    async with live(config, make(), request.node.name, vehicle.port, key) as rig:
        with station, UdpRouter([vehicle, gateway, ground], rig.clock.now):
            await rig.learnt()
            await rig.until(lambda: bool(logged(station, "HEARTBEAT")))
            rig.vehicle.scene.entangle(1)
            await rig.until(lambda: any("T1 entangled" in text for text in texts(station)))
            for command, parameters in ((ACKNOWLEDGE, "1"), (MUTE, "1 60"), (ACCEPT, "1"), (ACCEPT, "77")):
                before = len(logged(station, "COMMAND_ACK"))
                station.type(f"long {command} {parameters}")
                await rig.until(lambda before=before: len(logged(station, "COMMAND_ACK")) > before)
    answers = [
        (one.command, one.result, one.target_system, one.target_component) for one in logged(station, "COMMAND_ACK")
    ]
    user = (SYSTEM_ID, COMPONENT_ID)
    assert answers == [(ACKNOWLEDGE, 0, *user), (MUTE, 0, *user), (ACCEPT, 0, *user), (ACCEPT, 2, *user)]
    flags = {one.get_header().incompat_flags for one in logged(station, "COMMAND_ACK")}
    assert flags == {mavlink.MAVLINK_IFLAG_SIGNED if key else 0}
    assert rig.vehicle.asked == []


async def test_an_unsigned_ground_station_is_not_obeyed_where_there_is_a_key(tmp_path, request):
    port, key = free_port(), hashlib.sha256(PASSPHRASE.encode()).digest()
    signing = key_file(tmp_path, key)
    config = configuration(tmp_path, "", mavlink=signing, port=port, channel=request.node.name, rate_hz=50.0)
    vehicle, gateway, ground = Endpoint(), Endpoint((HOST, port)), Endpoint()
    station = GroundStation(tmp_path, f"udpout:{HOST}:{ground.port}", (), GATEWAY)
    async with live(config, ArduSub(), request.node.name, vehicle.port, key) as rig:
        with station, UdpRouter([vehicle, gateway, ground], rig.clock.now):
            await rig.learnt()
            await rig.until(lambda: "Detected vehicle" in "".join(station.output))
            station.type(f"long {ACCEPT} 0")
            await rig.until(lambda: any(one.get_type() == "COMMAND_LONG" for one in station.logged()))
            await rig.until(lambda: len(logged(station, "HEARTBEAT")) > 2)
    assert logged(station, "COMMAND_ACK") == []
    assert any("unsigned" in cause for cause in rig.summary.drops["mavlink"])

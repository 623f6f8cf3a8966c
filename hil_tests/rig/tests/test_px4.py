"""PX4's answers as its sources give them, and its ESC messages as the gateway's own decoder reads them."""

from __future__ import annotations

from math import inf

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.command import CommandScale
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.readings import AutopilotHeartbeat, AutopilotReboot, ThrusterReport
from hil_tests.rig.commander import Estimates
from hil_tests.rig.commands import Answer, Result
from hil_tests.rig.esc_messages import ESC_INFO_ID, ESC_STATUS_ID, EscReport
from hil_tests.rig.mavlink_autopilot import MavlinkAutopilot
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.px4 import MainMode, Px4, custom_mode
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Hull, Motion, mix

DEEP, AT_SURFACE = Motion(down_m=8.0), Motion(down_m=0.1)
ESCS = [EscReport(100.0 * n - 250.0, 15.0 + n, 1.0 + n, 300.0 + n, n) for n in range(6)]


def padded(*parameters: float) -> tuple[float, ...]:
    return (*parameters, *[0.0] * (7 - len(parameters)))


@pytest.fixture
def px4():
    px4 = Px4()
    px4.demand(Sticks(), DEEP)
    return px4


@pytest.mark.parametrize(
    ("command", "parameters", "result", "mode", "armed"),
    [
        (176, (1, 2), Result.ACCEPTED, MainMode.ALTCTL, True),
        (176, (1, 3), Result.ACCEPTED, MainMode.POSCTL, True),
        (176, (129, 3), Result.ACCEPTED, MainMode.POSCTL, True),
        (176, (1, 7), Result.ACCEPTED, MainMode.STABILIZED, True),
        (176, (1, 4, 3), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (176, (1, 9), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (176, (0, 2), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (17, (), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (20, (), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (21, (), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (400, (0, 0), Result.TEMPORARILY_REJECTED, MainMode.MANUAL, True),
        (400, (0, 21196), Result.ACCEPTED, MainMode.MANUAL, False),
        (400, (2, 0), Result.UNSUPPORTED, MainMode.MANUAL, True),
        (185, (0,), Result.DENIED, MainMode.MANUAL, True),
        (420, (101, 1), Result.UNSUPPORTED, MainMode.MANUAL, True),
    ],
)
def test_commands_are_answered_as_px4_does(px4, command, parameters, result, mode, armed):
    assert px4.answer(command, padded(*parameters)).result is result
    assert (px4.mode, px4.armed) == (mode, armed)


def test_a_mode_that_needs_what_is_not_known_is_rejected(px4):
    px4.estimates = Estimates(depth=False, position=False)
    assert [px4.answer(176, padded(1, mode)).result for mode in (2, 3, 1)] == [
        Result.TEMPORARILY_REJECTED,
        Result.TEMPORARILY_REJECTED,
        Result.ACCEPTED,
    ]


def test_disarming_without_force_is_for_the_surface(px4):
    assert px4.answer(400, padded(0)).text == "Disarming denied: not landed"
    px4.demand(Sticks(), AT_SURFACE)
    assert px4.answer(400, padded(0)) == Answer(Result.ACCEPTED)
    assert px4.armed is False


def test_termination_is_latched_until_a_restart(px4):
    assert px4.answer(185, padded(1)).result is Result.ACCEPTED
    assert px4.system_status == mavlink.MAV_STATE_FLIGHT_TERMINATION
    assert px4.demand(Sticks(1.0, 1.0, 1.0, 1.0), DEEP) == Sticks()
    assert px4.answer(176, padded(1, 2)).result is Result.TEMPORARILY_REJECTED
    px4.restart()
    assert px4.system_status == mavlink.MAV_STATE_STANDBY
    assert px4.answer(185, padded(1)).result is Result.DENIED


def test_its_failsafe_is_seen_in_the_heartbeat(px4):
    px4.failsafe = True
    assert px4.system_status == mavlink.MAV_STATE_CRITICAL


def test_altitude_and_position_are_held():
    moving = Motion(down_m=6.0, forward_mps=0.8, down_mps=0.3)

    def driven(mode: MainMode, sticks: Sticks) -> Motion:
        px4, hull = Px4(mode), Hull(motion=moving)
        for _ in range(1500):
            hull.step([40.0 * command for command in mix(px4.demand(sticks, hull.motion))], 0.02)
        return hull.motion

    held = driven(MainMode.POSCTL, Sticks())
    assert abs(held.north_m) < 0.4 > abs(held.east_m)
    ahead = driven(MainMode.ALTCTL, Sticks(forward=0.5))
    assert ahead.north_m > 5.0
    assert (held.down_m, ahead.down_m) == pytest.approx((6.0, 6.0), abs=0.4)


class Listener:
    """The gateway's decoder at the other end of the wire."""

    def __init__(self, px4: Px4) -> None:
        scale = CommandScale(1100.0, 1500.0, 1900.0)
        thrusters = [MavlinkThruster(n + 1, n + 1, scale, esc_index=n, signed=True) for n in range(len(ESCS))]
        self.decoder = MavlinkDecoder(thrusters)
        self.datagrams: list[bytes] = []
        self.autopilot = MavlinkAutopilot(self.datagrams.append, px4)

    def readings(self, time_s: float, boot_s: float) -> list:
        self.datagrams.clear()
        self.autopilot.advance(time_s, Telemetry(boot_s, DEEP, (0.5,) * 8, None, ESCS))
        return [one for datagram in self.datagrams for one in self.decoder.decode(datagram, time_s)]


def test_its_heartbeat_and_escs_are_understood(px4):
    listener = Listener(px4)
    px4.answer(176, padded(1, 3))
    readings = listener.readings(1000.0, 5.0)
    [beat] = [one for one in readings if isinstance(one, AutopilotHeartbeat)]
    assert (beat.autopilot, beat.vehicle_type, beat.armed) == (12, 12, True)
    assert beat.custom_mode == custom_mode(3) == 3 << 16
    reports = [one for one in readings if isinstance(one, ThrusterReport)]
    told = {
        one.thruster: (one.speed_rpm, one.voltage_v, one.current_a) for one in reports if one.speed_rpm is not None
    }
    assert told == {n + 1: (esc.speed_rpm, esc.voltage_v, esc.current_a) for n, esc in enumerate(ESCS)}
    info = {one.thruster: (one.temperature_k, one.error_count) for one in reports if one.temperature_k is not None}
    assert info == {n + 1: (pytest.approx(esc.temperature_k), esc.error_count) for n, esc in enumerate(ESCS)}
    assert not listener.decoder.drops


def test_a_restart_is_noticed_and_forgets_intervals(px4):
    listener = Listener(px4)
    ask = mavlink.MAVLink_command_long_message(1, 1, 511, 0, ESC_STATUS_ID, 50_000, 0, 0, 0, 0, 0)
    listener.readings(1000.0, 5.0)
    listener.autopilot.receive(1000.1, ask.pack(mavlink.MAVLink(None, 1, 192)))
    assert listener.autopilot.interval_s(ESC_STATUS_ID) == pytest.approx(0.05)
    assert listener.autopilot.interval_s(ESC_INFO_ID) == 1.0
    listener.readings(1030.0, 35.0)
    listener.autopilot.restart(1030.1, silent_s=3.0)
    assert listener.readings(1032.0, 37.0) == []
    readings = listener.readings(1033.2, 38.2)
    assert any(isinstance(one, AutopilotReboot) for one in readings)
    assert not next(one for one in readings if isinstance(one, AutopilotHeartbeat)).armed
    assert listener.autopilot.interval_s(ESC_STATUS_ID) == 1.0
    assert listener.autopilot.interval_s(36) < inf

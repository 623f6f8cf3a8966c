"""Sensors' faults on a whole link: numbers, signatures, borders of datagrams, and what the gateway reads of it."""

from __future__ import annotations

from itertools import pairwise
from math import inf, pi, radians
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.mavlink.frames import PATIENCE_S, frame_at
from drivers.mavlink.signing import EPOCH_S, Signing, SigningKey
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import BodyVelocity, Inertial, ThrusterCommand, ThrusterReport, WaterPressure
from gateway.config import parse
from gateway.wiring import mavlink_decoder
from hil_tests.scenario.failures import Target
from hil_tests.wires.mavlink_wire import MavlinkWire
from hil_tests.wires.tests import carriers
from hil_tests.wires.tests.packets import START_S, fault, played
from hil_tests.wires.tests.test_mavlink_signals import CONFIG
from hil_tests.wires.way import Towards

KEY = bytes(range(32))
GCS = 255
DVL_OFF = fault(Target.DVL, "off", at_s=2.0, until_s=4.0)
FASTER = fault(Target.DVL, "bias", axis=0, bias_mps=0.5)


@pytest.fixture(scope="module")
def config():
    return parse(CONFIG, Path())


def wire(*faults, **options):
    return MavlinkWire(faults, START_S, **options)


def dvl_at(time_s, confidence=100.0):
    message = carriers.position_delta(time_s, (1.0, 0.2, -0.1))
    message.confidence = confidence
    return message


def mixed(count=60, **options):
    """(time, packet): a DVL's velocity, attitude and heartbeat of one sender, ten times a second."""
    peer = Peer(**options)
    for n in range(count):
        yield 0.1 * n, peer.pack(dvl_at(0.1 * n))
        yield 0.1 * n + 0.01, peer.attitude(boot_ms=1000 + 100 * n)
        yield 0.1 * n + 0.02, peer.heartbeat()


def kinds_in(packets):
    return [message.get_type() for message in messages_in(b"".join(packets))]


def read_by_gateway(config, packets, **options):
    """(readings, decoder) of packets that follow a heartbeat."""
    decoder = mavlink_decoder(config.mavlink, config.thruster, navigation=True, **options)
    decoder.decode(Peer().heartbeat(), START_S)
    return [one for n, packet in enumerate(packets) for one in decoder.decode(packet, START_S + 0.1 * n)], decoder


def velocities_in(packets):
    return [
        tuple(10.0 * delta for delta in message.position_delta)
        for message in messages_in(b"".join(packets))
        if message.get_type() == "VISION_POSITION_DELTA"
    ]


@settings(max_examples=30)
@given(st.lists(st.integers(0, 1000), max_size=15))
def test_before_and_after_a_fault_every_piece_passes_at_once_as_the_same_object(places):
    data = b"".join(packet for _, packet in mixed(5))
    edges = [0, *sorted({place % len(data) for place in places} - {0}), len(data)]
    ours = wire(fault(Target.DVL, "bias", at_s=90.0, bias_mps=1.0), fault(Target.DEPTH, "off", at_s=0.0, until_s=5.0))
    for n, (start, end) in enumerate(pairwise(edges)):
        piece = data[start:end]
        ours.put(START_S + 10.0 + n, piece, Towards.GATEWAY)
        [passed] = ours.due(START_S + 10.0 + n)
        assert passed.item is piece
    assert ours.next_s() == inf


@settings(max_examples=30)
@given(st.lists(st.integers(0, 10_000), max_size=15))
def test_what_comes_out_does_not_depend_on_where_a_stream_is_cut(places):
    data = b"".join(packet for _, packet in mixed(5))
    edges = [0, *sorted({place % len(data) for place in places} - {0}), len(data)]
    whole = played(wire(FASTER), [(0.0, data)])
    cut = played(wire(FASTER), [(0.01 * n, data[start:end]) for n, (start, end) in enumerate(pairwise(edges))])
    assert len(whole) == 1
    assert b"".join(cut) == whole[0]
    assert all(velocity[0] == pytest.approx(1.5) for velocity in velocities_in(cut))


def test_what_no_fault_is_about_stays_the_same_object_at_once():
    ours = wire(FASTER)
    for at_s, packet in mixed(5):
        ours.put(START_S + at_s, packet, Towards.GATEWAY)
        [passed] = ours.due(START_S + at_s)
        assert (passed.item is packet) is ("VISION_POSITION_DELTA" not in kinds_in([packet]))


def test_a_datagram_of_several_messages_leaves_as_one():
    peer = Peer()
    together = peer.heartbeat() + peer.pack(dvl_at(0.0)) + peer.attitude()
    [changed] = played(wire(FASTER), [(0.0, together)])
    assert kinds_in([changed]) == ["HEARTBEAT", "VISION_POSITION_DELTA", "ATTITUDE"]
    assert changed.startswith(together[:17])
    assert velocities_in([changed]) == [pytest.approx((1.5, 0.2, -0.1))]
    [shorter] = played(wire(fault(Target.DVL, "off")), [(0.0, together)])
    assert kinds_in([shorter]) == ["HEARTBEAT", "ATTITUDE"]


def test_a_beginning_whose_rest_does_not_come_goes_on_as_it_is():
    beginning, ours = Peer().pack(dvl_at(0.0))[:20], wire(FASTER)
    ours.put(START_S, beginning, Towards.GATEWAY)
    assert ours.due(START_S + 0.1) == []
    assert ours.next_s() == START_S + PATIENCE_S
    assert [passed.item for passed in ours.due(START_S + PATIENCE_S)] == [beginning]


def test_a_packet_that_was_on_its_way_before_the_onset_is_not_changed_but_remembered():
    peer, ours = Peer(), wire(fault(Target.DVL, "stuck", at_s=1.0))
    early, late = peer.pack(dvl_at(0.0)), peer.pack(carriers.position_delta(0.0, (9.0, 9.0, 9.0)))
    arrived = played(ours, [(0.9, early[:20]), (1.1, early[20:]), (1.2, late)])
    assert arrived[:2] == [early[:20], early[20:]]
    assert velocities_in(arrived[2:]) == [pytest.approx((1.0, 0.2, -0.1))]
    assert ours.counts == {"dvl changed": 1}


def test_a_changed_packet_of_mavlink_1_stays_one():
    packet = Peer().attitude(mavlink1=True)
    [changed] = played(wire(fault(Target.HEADING, "wrong", value_deg=90.0)), [(0.0, packet)])
    assert (changed[0], len(changed)) == (0xFE, len(packet))
    [message] = messages_in(changed)
    assert message.yaw == pytest.approx(pi / 2.0)
    assert (message.roll, message.yawspeed) == (pytest.approx(0.1), pytest.approx(0.6))


def test_zeros_at_the_end_are_cut_off_and_come_back():
    peer = Peer()
    [changed] = played(wire(fault(Target.DVL, "no_lock")), [(0.0, peer.pack(dvl_at(0.0)))])
    frame = frame_at(changed, 0)
    assert changed[frame.payload_end - 1] != 0
    [restored] = played(wire(FASTER), [(0.0, changed)])
    assert velocities_in([restored]) == [pytest.approx((0.5, 0.0, 0.0))]


def test_numbers_go_on_without_a_gap_where_messages_are_withheld():
    arrived = played(wire(DVL_OFF), mixed())
    messages = messages_in(b"".join(arrived))
    assert [message.get_seq() for message in messages] == [n % 256 for n in range(160)]
    assert kinds_in(arrived).count("VISION_POSITION_DELTA") == 40


def test_numbers_of_other_senders_are_left_alone():
    vehicle, dvl = Peer(), Peer(system=GCS, component=0)
    packets = [(0.1 * n, packet) for n in range(20) for packet in (vehicle.heartbeat(), dvl.pack(dvl_at(0.1 * n)))]
    arrived = played(wire(fault(Target.DVL, "slow", interval_s=0.5)), packets)
    by_sender = {1: [], GCS: []}
    for message in messages_in(b"".join(arrived)):
        by_sender[message.get_srcSystem()].append(message.get_seq())
    assert by_sender == {1: list(range(20)), GCS: list(range(4))}


def test_messages_that_no_dialect_knows_keep_their_numbers():
    unknown, peer = b"\xfd\x03\x00\x00\x01\x01\x01\x99\x99\x99abc\x12\x34", Peer()
    packets = [(0.0, peer.pack(dvl_at(0.0))), (0.1, unknown), (0.2, peer.heartbeat())]
    ours = wire(fault(Target.DVL, "off"))
    assert played(ours, packets)[0] == unknown
    assert ours.counts == {"dvl withheld": 1, "unknown message, not numbered anew": 1}


def signed_again(packets):
    """What pymavlink takes of packets that have to be signed."""
    receiver = mavlink.MAVLink(None)
    receiver.robust_parsing = True
    receiver.signing.secret_key = KEY
    receiver.signing.timestamp = 0
    return receiver.parse_buffer(b"".join(packets)) or []


@pytest.mark.parametrize("trouble", [FASTER, DVL_OFF], ids=lambda one: one.failure)
def test_changed_packets_are_signed_anew(trouble):
    arrived = played(wire(trouble, key=KEY), mixed(key=KEY))
    taken = signed_again(arrived)
    assert len(taken) == len(arrived)
    assert "BAD_DATA" not in {message.get_type() for message in taken}
    gate, stamps = Signing(SigningKey(KEY), EPOCH_S), []
    for packet in arrived:
        assert gate.refusal(frame_at(packet, 0), packet, EPOCH_S) == ""
        stamps.append(packet[-12:-6])
    assert set(stamps) <= {packet[-12:-6] for _, packet in mixed(key=KEY)}


def test_without_the_key_signed_packets_are_not_changed():
    ours = wire(FASTER)
    arrived = played(ours, mixed(10, key=KEY))
    assert arrived == [packet for _, packet in mixed(10, key=KEY)]
    assert ours.counts == {"signed, not changed: no key": 10}


def test_without_the_key_what_is_withheld_leaves_a_gap():
    ours = wire(fault(Target.DVL, "off"))
    arrived = played(ours, mixed(10, key=KEY))
    assert [message.get_seq() for message in signed_again(arrived)] == [n for n in range(30) if n % 3]
    assert ours.counts == {"dvl withheld": 10}


def test_bottom_lock_is_lost_and_said_so(config):
    peer, dvl = Peer(), fault(Target.DVL, "no_lock")
    packets = [peer.pack(dvl_at(0.0)), peer.pack(carriers.odometry(0.0, (1.0, 2.0, 3.0)))]
    arrived = played(wire(dvl), [(0.0, packet) for packet in packets])
    delta, odometry = messages_in(b"".join(arrived))
    assert (delta.position_delta, delta.confidence) == ([0.0, 0.0, 0.0], 0.0)
    assert (odometry.vx, odometry.vy, odometry.vz, odometry.quality) == (0.0, 0.0, 0.0, -1)
    readings, decoder = read_by_gateway(config, arrived)
    assert not readings
    assert decoder.drops["DVL without bottom lock"] == 2


def test_a_dvl_frozen_at_zero_is_believed(config):
    arrived = played(wire(fault(Target.DVL, "wrong", value_mps=0.0)), [(0.0, Peer().pack(dvl_at(0.0)))])
    [reading], _ = read_by_gateway(config, arrived)
    assert isinstance(reading, BodyVelocity)
    assert reading.velocity_mps == (0.0, 0.0, 0.0)


def test_a_dvl_is_changed_on_its_way_to_the_autopilot_too():
    packets = [(0.1, Peer(system=GCS, component=0).pack(dvl_at(0.0)))]
    for towards in (Towards.AUTOPILOT, Towards.GATEWAY):
        assert velocities_in(played(wire(FASTER), packets, towards)) == [pytest.approx((1.5, 0.2, -0.1))]


def test_a_velocity_over_ground_is_changed_along_the_axes_of_the_vehicle():
    peer = Peer()
    level_east = mavlink.MAVLink_attitude_message(1000, 0.0, 0.0, pi / 2.0, 0.0, 0.0, 0.0)
    estimate = mavlink.MAVLink_vision_speed_estimate_message(0, 0.0, 1.0, 0.1)
    packets = [(0.0, peer.pack(estimate)), (0.1, peer.pack(level_east)), (0.2, peer.pack(estimate))]
    before, _, after = messages_in(b"".join(played(wire(FASTER), packets)))
    assert (before.x, before.y, before.z) == pytest.approx((0.0, 1.0, 0.1))  # which way is ahead is not known yet
    assert (after.x, after.y, after.z) == pytest.approx((0.0, 1.5, 0.1), abs=1e-6)
    [lost] = messages_in(b"".join(played(wire(fault(Target.DVL, "no_lock")), packets[1:])))
    assert lost.get_type() == "ATTITUDE"


@pytest.mark.parametrize(("estimator", "child_frame"), [(8, 12), (0, 8)])
def test_odometry_that_is_no_dvl_is_left_alone(estimator, child_frame):
    packet = Peer().pack(carriers.odometry(0.0, (1.0, 2.0, 3.0), estimator, child_frame))
    assert played(wire(FASTER), [(0.0, packet)]) == [packet]


def test_all_other_fields_stay_bit_for_bit():
    packet = Peer().pack(carriers.odometry(0.0, (1.0, 2.0, 3.0)))
    [changed] = played(wire(FASTER), [(0.0, packet)])
    start = 10 + 36  # behind the header, the time, the position and the quaternion
    assert changed[:start] == packet[:start]
    assert changed[start : start + 4] != packet[start : start + 4]
    assert changed[start + 4 : -2] == packet[start + 4 : -2]


def test_a_fault_of_the_forces_leaves_the_rates_alone(config):
    packet = Peer().pack(carriers.counts(mavlink.MAVLink_raw_imu_message, 5, (1.0, 2.0, -9.8), (0.1, 0.2, 0.3)))
    arrived = played(wire(fault(Target.ACCELEROMETER, "bias", axis=1, bias_mps2=3.0)), [(0.0, packet)])
    [changed], [true] = read_by_gateway(config, arrived)[0], read_by_gateway(config, [packet])[0]
    assert isinstance(changed, Inertial)
    assert changed.angular_rate_radps == true.angular_rate_radps
    assert changed.specific_force_mps2 == pytest.approx((1.0, 5.0, -9.8), abs=0.01)


def test_a_jump_of_the_position_lasts():
    jump = fault(Target.POSITION, "reset", at_s=1.0, until_s=1.1, north_m=3.0, east_m=-2.0)
    peer = Peer()
    local = mavlink.MAVLink_local_position_ned_message
    packets = [(at_s, peer.pack(local(0, at_s, 1.0, 5.0, 0, 0, 0))) for at_s in (0.0, 1.0, 60.0)]
    messages = messages_in(b"".join(played(wire(jump), packets)))
    assert [(message.x, message.y, message.z) for message in messages] == [
        (0.0, 1.0, 5.0),
        (4.0, -1.0, 5.0),
        (63.0, -1.0, 5.0),
    ]


def test_the_heading_turns_the_whole_circle():
    peer = Peer()
    packets = [(0.0, peer.pack(carriers.attitude(0.0, (179.0,)))), (0.1, peer.pack(carriers.global_position(0.1)))]
    ahead, around = messages_in(b"".join(played(wire(fault(Target.HEADING, "bias", bias_deg=-5.0)), packets)))
    assert ahead.yaw == pytest.approx(radians(174.0))
    assert around.hdg == 35_600
    [over, _] = messages_in(b"".join(played(wire(fault(Target.HEADING, "bias", bias_deg=5.0)), packets)))
    assert over.yaw == pytest.approx(radians(-176.0))


def test_the_depth_goes_by_the_density_that_the_gateway_knows(config):
    fresh = parse(CONFIG + "[navigation]\nwater_density_kgm3 = 998\n", Path())
    packet = Peer().pack(carriers.pressure(mavlink.MAVLink_scaled_pressure2_message)(0.0, (5.0,)))
    for known, density in ((config, 1025.0), (fresh, 998.0)):
        arrived = played(wire(fault(Target.DEPTH, "bias", bias_m=2.0), config=known), [(0.0, packet)])
        [changed], [true] = read_by_gateway(config, arrived)[0], read_by_gateway(config, [packet])[0]
        assert isinstance(changed, WaterPressure)
        assert changed.pressure_pa - true.pressure_pa == pytest.approx(2.0 * density * 9.80665, abs=5.0)


def test_the_altitude_stays_where_a_pressure_is_told():
    peer, trouble = Peer(), fault(Target.DEPTH, "bias", bias_m=2.0)
    altitude = peer.pack(carriers.global_position(0.1))
    pressure = peer.pack(carriers.pressure(mavlink.MAVLink_scaled_pressure2_message)(0.0, (5.0,)))
    assert played(wire(trouble), [(0.0, pressure), (0.1, altitude)])[1] == altitude
    [lower] = messages_in(b"".join(played(wire(trouble), [(0.1, altitude)])))
    assert (lower.alt, lower.relative_alt) == (-7000, -7000)


@pytest.mark.parametrize(("depth", "pressure", "altitude"), [("scaled_pressure", 1, 0), ("global_position", 0, 1)])
def test_the_depth_is_where_the_configuration_says(depth, pressure, altitude):
    config, peer = parse(CONFIG + f'[navigation]\ndepth = "{depth}"\n', Path()), Peer()
    packets = [
        (0.0, peer.pack(carriers.pressure(mavlink.MAVLink_scaled_pressure_message)(0.0, (5.0,)))),
        (0.1, peer.pack(carriers.pressure(mavlink.MAVLink_scaled_pressure2_message)(0.1, (5.0,)))),
        (0.2, peer.pack(carriers.global_position(0.2))),
    ]
    arrived = played(wire(fault(Target.DEPTH, "bias", bias_m=2.0), config=config), packets)
    changed = [after != before for after, (_, before) in zip(arrived, packets, strict=True)]
    assert changed == [pressure, False, altitude]


def test_the_gateway_reads_the_speed_that_the_fault_tells(config):
    """By the number of the thruster, in the message that its configuration names."""
    peer, slower = Peer(), fault(Target.RPM, "scale", thruster=1, factor=0.5)
    messages = carriers.esc_telemetry(0.0, (1000.0,)), carriers.esc_status(0.0, (-1000.0,))
    packets = [(0.0, peer.pack(message)) for message in messages]
    ours = wire(slower, config=config)
    readings, _ = read_by_gateway(config, played(ours, packets))
    assert [(one.thruster, one.speed_rpm) for one in readings if isinstance(one, ThrusterReport)] == [
        (1, 500.0),
        (1, -500.0),
    ]
    assert ours.counts == {"rpm changed": 2}
    for untouched in (wire(slower), wire(fault(Target.RPM, "scale", thruster=3, factor=0.5), config=config)):
        assert played(untouched, packets) == [packet for _, packet in packets]


def test_an_esc_of_which_nothing_comes_is_told_as_autopilots_do(config):
    peer, off = Peer(), fault(Target.RPM, "off", at_s=1.0, thruster=1)
    packets = [(0.1 * n, peer.pack(carriers.esc_telemetry(0.1 * n, (1000.0 + n,)))) for n in range(30)]
    readings, decoder = read_by_gateway(config, played(wire(off, config=config), packets))
    assert [one.speed_rpm for one in readings if isinstance(one, ThrusterReport)] == [1000.0 + n for n in range(10)]
    assert decoder.drops["repeated"] == 20
    status = [(0.1 * n, peer.pack(carriers.esc_status(0.1 * n, (1000.0 + n,)))) for n in range(30)]
    readings, _ = read_by_gateway(config, played(wire(off, config=config), status))
    assert [one.speed_rpm for one in readings][9:] == [1009.0] * 21


def test_the_gateway_reads_the_command_that_the_fault_tells(config):
    peer, stronger = Peer(), fault(Target.COMMAND, "bias", thruster=1, bias_share=0.9)
    packets = [(0.0, peer.pack(carriers.servo_output(0.0, (0.5,), port))) for port in (0, 1)]
    arrived = played(wire(stronger, config=config), packets)
    readings, _ = read_by_gateway(config, arrived)
    assert [one.fraction for one in readings if isinstance(one, ThrusterCommand)] == [1.0]
    assert arrived[1] == packets[1][1]  # channel 9 of the second port is none of ours


def test_what_is_no_number_is_left_alone():
    packet = Peer().pack(carriers.odometry(0.0, (float("nan"), 2.0, 3.0)))
    assert played(wire(FASTER), [(0.0, packet)]) == [packet]


def test_a_key_that_is_none_is_refused():
    with pytest.raises(ValueError, match="a signing key has 32 bytes, got 3"):
        wire(FASTER, key=b"abc")

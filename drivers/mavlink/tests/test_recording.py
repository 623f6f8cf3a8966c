"""The recording of a real BlueROV2, read by us and by pymavlink."""

import math
from collections import Counter
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.command import CommandScale
from drivers.mavlink.decoder import MavlinkDecoder, MavlinkThruster
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    CommandAcknowledgement,
    GlobalPosition,
    Inertial,
    LocalPosition,
    PositionFix,
    WaterPressure,
)

RECORDING = Path(__file__).parents[4] / "shared/data/ardusub_logs/small.tlog"
PWM = CommandScale(1100.0, 1500.0, 1900.0)
CHANNELS = 8


@pytest.fixture(scope="module")
def frames():
    """The frames of the recording, each with its time of reception in seconds."""
    if not RECORDING.exists():
        pytest.skip(f"no recording at {RECORDING}: shared/data must lie beside the project's root")
    data, start, found = RECORDING.read_bytes(), 0, []
    while start + 8 < len(data):
        time_us, start = int.from_bytes(data[start : start + 8], "big"), start + 8
        size = data[start + 1] + (12 if data[start] == 0xFD else 8)
        found.append((time_us / 1e6, data[start : start + size]))
        start += size
    return found


def theirs(frames):
    """What pymavlink reads from the autopilot, in the words of our readings."""
    link, wanted = dialect.MAVLink(None), []
    link.robust_parsing = True
    for time_s, frame in frames:
        for message in link.parse_buffer(frame) or []:
            if (message.get_srcSystem(), message.get_srcComponent()) == (1, 1):
                wanted += expected(time_s, message)
    return wanted


def expected(time_s, message):
    match message.get_type():
        case "HEARTBEAT":
            armed = message.base_mode >= 128
            state = (message.autopilot, message.type, armed, message.custom_mode, message.system_status)
            return [AutopilotHeartbeat(time_s, 1, 1, *state)]
        case "ATTITUDE":
            names = ("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
            return [Attitude(time_s, *[getattr(message, name) for name in names], message.time_boot_ms / 1000)]
        case "LOCAL_POSITION_NED":
            position = (message.x, message.y, message.z)
            return [LocalPosition(time_s, position, (message.vx, message.vy, message.vz))]
        case "GLOBAL_POSITION_INT":
            return [("GlobalPosition", time_s, message.lat, message.lon, message.alt, message.vx)]
        case "COMMAND_ACK" if message.target_system == 0:
            return [CommandAcknowledgement(time_s, 1, 1, message.command, message.result, message.progress)]
        case "SERVO_OUTPUT_RAW":
            return [("ThrusterCommand", time_s, i, getattr(message, f"servo{i}_raw")) for i in range(1, CHANNELS + 1)]
    return []


def in_their_words(reading):
    if isinstance(reading, GlobalPosition):
        degrees = [
            round(angle * 180e7 / 3.141592653589793) for angle in (reading.latitude_rad, reading.longitude_rad)
        ]
        return (
            "GlobalPosition",
            reading.time_s,
            *degrees,
            round(-1000 * reading.depth_m),
            round(100 * reading.velocity_mps[0]),
        )
    if type(reading).__name__ == "ThrusterCommand":
        return ("ThrusterCommand", reading.time_s, reading.thruster, PWM.value(reading.fraction))
    return reading


def test_every_wanted_message_has_the_values_that_pymavlink_reads(frames):
    decoder = MavlinkDecoder([MavlinkThruster(i, i, PWM) for i in range(1, CHANNELS + 1)], autopilot_system=1)
    readings = [reading for time_s, frame in frames for reading in decoder.decode(frame, time_s)]
    ours = [in_their_words(reading) for reading in readings if not isinstance(reading, PositionFix)]
    assert ours == theirs(frames)
    assert len(ours) > 10_000
    print(Counter(type(reading).__name__ for reading in ours), decoder.drops)


def test_fixes_of_its_underwater_gps_and_what_the_autopilot_made_of_them(frames):
    decoder, link = MavlinkDecoder([], autopilot_system=1), dialect.MAVLink(None)
    link.robust_parsing = True
    readings = [reading for time_s, frame in frames for reading in decoder.decode(frame, time_s)]
    ours = Counter((one.source, one.latitude_rad, one.depth_m) for one in readings if isinstance(one, PositionFix))
    messages = [message for _, frame in frames for message in link.parse_buffer(frame) or []]
    sent = [message for message in messages if message.get_type() == "GPS_INPUT" and message.fix_type == 3]
    echoed = {
        message.time_usec: message.lat
        for message in messages
        if message.get_type() == "GPS_RAW_INT" and message.fix_type == 3
    }
    theirs = Counter(("GPS_INPUT 220.0", math.radians(one.lat * 1e-7), None) for one in sent)
    theirs += Counter(("GPS_RAW_INT", math.radians(latitude * 1e-7), 0.0) for latitude in echoed.values())
    assert ours == theirs
    assert len(sent) > 900 and len(echoed) > 400
    assert decoder.drops["no position fix"] > 50


def test_its_inertial_unit_and_its_barometers(frames):
    decoder, link = MavlinkDecoder([], autopilot_system=1, navigation=True), dialect.MAVLink(None)
    link.robust_parsing = True
    readings = [reading for time_s, frame in frames for reading in decoder.decode(frame, time_s)]
    sent = [message for _, frame in frames for message in link.parse_buffer(frame) or []]
    units = [one for one in readings if isinstance(one, Inertial)]
    theirs = [message for message in sent if message.get_type() == "RAW_IMU"]
    assert [one.boot_s for one in units] == [message.time_usec / 1e6 for message in theirs]
    down = [one.specific_force_mps2[2] / 9.80665e-3 for one in units]
    assert down == pytest.approx([message.zacc - 0.5 for message in theirs])
    assert {one.source for one in units} == {"RAW_IMU"}
    # its second unit is a compass only
    assert decoder.drops["IMU absent"] == sum(message.get_type() == "SCALED_IMU2" for message in sent) > 500
    pressures = {2: "SCALED_PRESSURE2", 1: "SCALED_PRESSURE"}
    for instance, name in pressures.items():
        ours = [one.pressure_pa for one in readings if isinstance(one, WaterPressure) and one.instance == instance]
        by_stamp = {message.time_boot_ms: message.press_abs for message in sent if message.get_type() == name}
        assert ours == pytest.approx([100.0 * hectopascals for hectopascals in by_stamp.values()])


def test_the_file_itself_is_a_stream_with_eight_odd_bytes_before_each_frame(frames):
    decoder = MavlinkDecoder([], autopilot_system=1)
    framed = [reading for time_s, frame in frames for reading in decoder.decode(frame, 0.0)]
    raw = MavlinkDecoder([], autopilot_system=1)
    data = RECORDING.read_bytes()
    readings = [
        reading for start in range(0, len(data), 1000) for reading in raw.decode(data[start : start + 1000], 0.0)
    ]
    assert readings == framed

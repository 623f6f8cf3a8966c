"""MAVProxy starts, passes messages on, sends what is typed, and logs; its log is read back."""

from __future__ import annotations

import socket
import time
from struct import pack

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.loopback import free_port
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.autopilot import AutopilotPeer
from hil_tests.rig.ground_station import GroundStation, program, read_tlog
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Motion

HOST = "127.0.0.1"
needs_mavproxy = pytest.mark.skipif(not program().exists(), reason="MAVProxy is not installed")


@needs_mavproxy
def test_it_passes_on_sends_and_logs(tmp_path):
    port, codec, heard = free_port(), mavlink.MAVLink(None, 1, 192), []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as companion:
        companion.bind((HOST, 0))
        companion.setblocking(False)
        output = f"udpout:{HOST}:{companion.getsockname()[1]}"
        with GroundStation(tmp_path, f"udpin:{HOST}:{port}", [output], target_component=42) as station:
            peer, station_address = AutopilotPeer((HOST, port), ArduSub()), None

            def logged() -> set:
                return {(one.get_type(), one.get_srcComponent()) for one in station.logged()}

            wanted = {("STATUSTEXT", 192), ("COMMAND_LONG", 230), ("HEARTBEAT", 1)}
            deadline_s = time.monotonic() + 20.0
            # the log may have the text before the autopilot does: MAVProxy passes it on in a turn of its own
            while not (wanted <= logged() and peer.notes.texts) and time.monotonic() < deadline_s:
                peer.exchange(time.time(), Telemetry(time.monotonic(), Motion(), (0.0,) * 8))
                try:
                    while True:
                        data, address = companion.recvfrom(4096)
                        heard += codec.parse_buffer(data) or []
                        if station_address is None:
                            station_address = address
                            text = mavlink.MAVLink_statustext_message(2, b"T3 entangled?")
                            companion.sendto(text.pack(codec), station_address)
                            station.type("long 31010 3")
                except BlockingIOError:
                    time.sleep(0.05)
            assert wanted <= logged()
            [command] = [one for one in station.logged() if one.get_type() == "COMMAND_LONG"]
        peer.close()
    assert (command.command, command.param1, command.target_system, command.target_component) == (31010, 3.0, 1, 42)
    assert [note.text for note in peer.notes.texts] == ["T3 entangled?"]
    assert "ATTITUDE" in {message.get_type() for message in heard}


def test_a_log_is_read_up_to_where_it_is_cut_short():
    codec = mavlink.MAVLink(None, 1, 192)
    frames = [mavlink.MAVLink_statustext_message(6, f"text {n}".encode()).pack(codec) for n in range(3)]
    data = b"".join(pack(">Q", 1_000_000 * n) + frame for n, frame in enumerate(frames))
    assert [(one.text, one._timestamp) for one in read_tlog(data)] == [
        ("text 0", 0.0),
        ("text 1", 1.0),
        ("text 2", 2.0),
    ]
    assert [one.text for one in read_tlog(data[:-3])] == ["text 0", "text 1"]
    assert [one.text for one in read_tlog(b"junk" + data)] == ["text 0", "text 1", "text 2"]
    assert list(read_tlog(b"")) == []


def test_it_is_started_before_anything_is_typed(tmp_path):
    program_is_there = program().exists()
    with pytest.raises(RuntimeError if program_is_there else FileNotFoundError):
        GroundStation(tmp_path, "udpin:127.0.0.1:0").type("long 31010")

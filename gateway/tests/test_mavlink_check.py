"""What `gateway check` says of the MAVLink link: who is heard, who is let in, and why not."""

import socket
import threading
import time
from contextlib import contextmanager

import pytest

from drivers.mavlink.signing import FUTURE, TOO_OLD, Signing, SigningKey, stamp_of
from drivers.mavlink.tests.peer import Peer
from gateway.checking import mavlink as mavlink_check
from gateway.checking.mavlink import check_mavlink, heard
from gateway.checking.survey import MavlinkSurvey
from gateway.config_sections import Mavlink
from gateway.signing.settings import accepted

NOW_S = 1_795_300_000.0
NOW = stamp_of(NOW_S)
SECRET = bytes(range(1, 33))
UDP = "udpin:127.0.0.1:0"
UNSIGNED_MAVLINK = Mavlink(endpoint=UDP)


def keyed(**keys):
    return Mavlink(endpoint=UDP, signing_key="mavlink.key", **keys)


def beat(system=1, component=1, key=None, stamp=NOW, autopilot=3, vehicle_type=12):
    peer = Peer(system, component, key)
    peer.mav.signing.timestamp = stamp
    return peer.heartbeat(autopilot=autopilot, vehicle_type=vehicle_type) + peer.attitude()


def told(mavlink, *spoken):
    """The line for what was spoken on the link."""
    gate = None
    if mavlink.signing_key is not None:
        gate = Signing(SigningKey(SECRET), NOW_S, accept_unsigned=mavlink.accept_unsigned)
    survey = MavlinkSurvey(gate)
    for data in spoken:
        survey.feed(data, NOW_S)
    return heard("mavlink", mavlink, list(survey.senders.values())).line()


GROUND = beat(255, 190, autopilot=8, vehicle_type=6)


def test_nothing_heard_is_no_fault():
    assert told(UNSIGNED_MAVLINK) == "ok       mavlink: opens; nothing heard in 3 s"
    assert told(UNSIGNED_MAVLINK, bytes(500)) == "ok       mavlink: opens; nothing heard in 3 s"


def test_autopilot_first_then_all_others():
    said = told(UNSIGNED_MAVLINK, GROUND, GROUND, beat(1, 194, autopilot=8, vehicle_type=18), beat())
    assert said == (
        "ok       mavlink: opens; heard in 3 s: ArduSub (system 1), not signed; "
        "ground station (system 255), not signed; component 194 of system 1, not signed"
    )
    assert "PX4 (system 7)" in told(UNSIGNED_MAVLINK, beat(7, autopilot=12))
    many = [beat(1, component, autopilot=8, vehicle_type=18) for component in range(10, 20)]
    assert told(UNSIGNED_MAVLINK, beat(), *many).endswith("; 7 more")


def test_no_autopilot():
    assert told(UNSIGNED_MAVLINK, GROUND).endswith("ground station (system 255), not signed; no autopilot among them")
    attitude_only = Peer().attitude()
    assert told(UNSIGNED_MAVLINK, attitude_only).endswith(
        "component 1 of system 1, not signed; no autopilot among them"
    )


def test_another_kind_of_autopilot_is_told_that_it_gets_advice_only():
    assert "MAV_AUTOPILOT 3, MAV_TYPE 2: it gets advice only" in told(UNSIGNED_MAVLINK, beat(vehicle_type=2))


def test_several_autopilots():
    said = told(UNSIGNED_MAVLINK, beat(2), beat(1))
    assert said == "problem  mavlink: several autopilots (systems 1, 2); set mavlink.system_id"
    named = Mavlink(endpoint=UDP, system_id=2)
    assert told(named, beat(2), beat(1)).startswith("ok ")
    assert told(named, beat(3), beat(1)) == (
        "problem  mavlink: mavlink.system_id is 2, but heard is system 1, 3; name the vehicle's own, or leave it out"
    )


def test_a_signing_vehicle_and_no_key():
    assert "may refuse what we say: set mavlink.signing_key" in told(UNSIGNED_MAVLINK, beat(key=SECRET))


def test_our_key():
    said = told(keyed(), beat(key=SECRET), GROUND)
    assert said.startswith("ok       mavlink: opens; heard in 3 s: ArduSub (system 1), signed with our key; ")
    assert said.endswith("ground station (system 255), refused: unsigned")


@pytest.mark.parametrize(
    ("spoken", "said"),
    [
        ({}, "all of ArduSub (system 1) is refused: unsigned; it does not sign: give it the key"),
        ({"key": SECRET[::-1]}, "refused: wrong key; it signs with another key"),
        (
            {"key": SECRET, "stamp": stamp_of(NOW_S - 86_400.0)},
            f"refused: {TOO_OLD}; its clock is over a minute behind",
        ),
        ({"key": SECRET, "stamp": 2**48 - 3}, f"refused: {FUTURE}; its clock is more than ten years ahead"),
    ],
)
def test_an_autopilot_that_is_refused(spoken, said):
    line = told(keyed(), beat(**spoken))
    assert line.startswith("problem ") and said in line


def test_a_recording_played_again():
    survey = MavlinkSurvey(Signing(SigningKey(SECRET), NOW_S))
    survey.feed(beat(key=SECRET), NOW_S)
    survey.senders.clear()
    survey.feed(beat(key=SECRET), NOW_S)
    line = heard("mavlink", keyed(), list(survey.senders.values())).line()
    assert "played again or late; its stamps do not rise: is a recording played?" in line


def test_unsigned_where_that_is_accepted():
    assert "ArduSub (system 1), not signed" in told(keyed(accept_unsigned=True), beat())


def test_a_neighbour_with_another_key_is_no_rival():
    assert told(keyed(), beat(2, key=SECRET[::-1]), beat(1, key=SECRET)).startswith("ok ")
    assert "several autopilots" in told(keyed(), beat(2, key=SECRET), beat(1, key=SECRET))


def test_trouble_with_single_packets_is_shown():
    assert "signed with our key (but 2 wrong key)" in told(keyed(), beat(key=SECRET), beat(key=SECRET[::-1]))


@pytest.mark.parametrize(
    ("mavlink", "said"),
    [
        (UNSIGNED_MAVLINK, "packets of everybody, signed or not (no mavlink.signing_key); "
                           "commands to us from system 255, unsigned, too"),
        (keyed(operators=[254, 255]), "only packets signed with the key in mavlink.key; "
                                      "commands to us from systems 254, 255, signed only"),
        (keyed(accept_unsigned=True), "packets signed with the key in mavlink.key, and unsigned ones; "
                                      "commands to us from system 255, signed only"),
        (keyed(operators=[]), "only packets signed with the key in mavlink.key; commands to us from nobody"),
    ],
)  # fmt: skip
def test_what_the_link_accepts(mavlink, said):
    assert accepted(mavlink) == said


@contextmanager
def speaking(port, datagram):
    """A peer that says the same over and over, as each link begins to listen in its own time."""
    stop = threading.Event()

    def speak():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            while not stop.wait(0.02):
                link.sendto(datagram(), ("127.0.0.1", port))

    thread = threading.Thread(target=speak)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        return link.getsockname()[1]


def lines(mavlink, folder):
    return [result.line() for result in check_mavlink(mavlink, folder / "vehicle.state")]


def test_on_a_real_socket(tmp_path, monkeypatch):
    monkeypatch.setattr(mavlink_check, "LISTEN_S", 0.3)
    key = tmp_path / "mavlink.key"
    key.write_bytes(SECRET)
    key.chmod(0o600)
    port = free_port()
    mavlink = Mavlink(endpoint=f"udpin:127.0.0.1:{port}", signing_key=key)
    peer = Peer(key=SECRET)
    peer.mav.signing.timestamp = stamp_of(time.time())
    with speaking(port, peer.heartbeat):
        opened, accepts = lines(mavlink, tmp_path)
    assert opened == f"ok       mavlink udpin:127.0.0.1:{port}: opens; heard in 0.3 s: " + (
        "ArduSub (system 1), signed with our key"
    )
    assert accepts.startswith("ok       mavlink accepts: only packets signed")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mavlink.key"]  # nothing is changed


def test_a_key_file_that_others_may_read(tmp_path, monkeypatch):
    monkeypatch.setattr(mavlink_check, "LISTEN_S", 0.05)
    key = tmp_path / "mavlink.key"
    key.write_bytes(SECRET)
    key.chmod(0o644)
    told_of_key, opened, _ = lines(Mavlink(endpoint=UDP, signing_key=key), tmp_path)
    assert told_of_key.startswith(f"problem  mavlink signing key: {key} has mode 0644")
    assert f"chmod 600 {key}" in told_of_key
    assert opened.startswith("ok ")


def test_a_link_that_does_not_open_and_one_that_is_lost(tmp_path, monkeypatch):
    monkeypatch.setattr(mavlink_check, "LISTEN_S", 5.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        endpoint = Mavlink(endpoint=f"tcp:127.0.0.1:{port}")

        def accept_and_close():
            server.accept()[0].close()

        hang_up = threading.Thread(target=accept_and_close)
        hang_up.start()
        lost, _ = lines(endpoint, tmp_path)
        hang_up.join()
    assert lost.startswith(f"problem  mavlink tcp:127.0.0.1:{port}: opens, and is lost: ")
    assert "does not open" in lines(endpoint, tmp_path)[0]

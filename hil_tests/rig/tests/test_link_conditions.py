"""Lines that lose, delay, reorder and double, and a router of them over real sockets."""

from __future__ import annotations

import socket
import time

import pytest

from hil_tests.rig.link_conditions import Line, LinkConditions
from hil_tests.rig.router import HOST, Endpoint, UdpRouter

DATAGRAMS = [n.to_bytes(2, "big") for n in range(2000)]


def sent(line: Line, period_s: float = 0.01) -> list[bytes]:
    """What arrives of 2000 datagrams."""
    arrived = []
    for n, datagram in enumerate(DATAGRAMS):
        line.put(n * period_s, datagram)
        arrived += line.due(n * period_s)
    return arrived + line.due(1e9)


def test_an_ideal_line_passes_all_at_once():
    line = Line()
    line.put(1.0, b"one")
    assert line.due(1.0) == [b"one"]
    assert sent(line) == DATAGRAMS


def test_a_share_is_lost_the_same_for_the_same_seed():
    first, second, other = (sent(Line(LinkConditions(loss=0.2), seed)) for seed in (1, 1, 2))
    assert first == second != other
    assert len(first) == pytest.approx(1600, abs=80)
    assert set(first) < set(DATAGRAMS)


def test_latency_is_kept_and_jitter_bounded():
    line = Line(LinkConditions(latency_s=0.5, jitter_s=0.2))
    for datagram in DATAGRAMS:
        line.put(10.0, datagram)
    assert line.due(10.499) == []
    assert 10.5 <= line.next_s() <= 10.7
    assert 0 < len(line.due(10.6)) < 2000
    line.due(10.7)
    assert line.next_s() == float("inf")
    assert line.counts["passed"] == 2000


def test_what_is_held_back_is_overtaken_and_nothing_is_lost():
    line = Line(LinkConditions(reordering=0.1, held_s=0.05))
    arrived = sent(line)
    assert arrived != DATAGRAMS
    assert sorted(arrived) == DATAGRAMS
    assert line.counts["held back"] == pytest.approx(200, abs=60)


def test_a_share_comes_twice():
    line = Line(LinkConditions(duplication=0.3))
    arrived = sent(line)
    assert set(arrived) == set(DATAGRAMS)
    assert len(arrived) == 2000 + line.counts["duplicated"] == pytest.approx(2600, abs=90)


def test_a_cut_line_passes_only_what_was_under_way():
    line = Line(LinkConditions(latency_s=1.0))
    line.cut(5.0, 6.0)
    for at_s in (4.9, 5.0, 5.9, 6.0):
        line.put(at_s, str(at_s).encode())
    assert line.due(100.0) == [b"4.9", b"6.0"]
    line.cut(0.0)
    line.mend()
    line.put(101.0, b"again")
    assert line.due(103.0) == [b"again"]


@pytest.mark.parametrize(
    "wrong", [{"loss": 1.1}, {"duplication": -0.1}, {"latency_s": -1.0}, {"jitter_s": float("nan")}]
)
def test_impossible_conditions_are_refused(wrong):
    [(name, value)] = wrong.items()
    with pytest.raises(ValueError, match=f"{name} = {value!r}"):
        LinkConditions(**wrong)


class Speaker:
    """A socket with somebody behind it."""

    def __init__(self, port: int = 0) -> None:
        self.link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.link.bind((HOST, port))
        self.link.settimeout(5.0)

    def hear(self) -> bytes:
        return self.link.recvfrom(2048)[0]

    def heard(self) -> list[bytes]:
        """What is there, without waiting."""
        self.link.setblocking(False)
        heard = []
        try:
            while True:
                heard.append(self.link.recvfrom(2048)[0])
        except BlockingIOError:
            self.link.settimeout(5.0)
            return heard


@pytest.fixture
def speakers():
    speakers = [Speaker() for _ in range(3)]
    yield speakers
    for one in speakers:
        one.link.close()


def test_a_router_passes_everything_to_all_others(speakers):
    vehicle, gateway, ground = speakers
    endpoints = [Endpoint(), Endpoint(gateway.link.getsockname()), Endpoint(ground.link.getsockname())]
    with UdpRouter(endpoints, time.monotonic):
        vehicle.link.sendto(b"telemetry", (HOST, endpoints[0].port))
        assert (gateway.hear(), ground.hear()) == (b"telemetry", b"telemetry")
        gateway.link.sendto(b"text", (HOST, endpoints[1].port))
        assert (vehicle.hear(), ground.hear()) == (b"text", b"text")
    assert all(one.heard() == [] for one in speakers)


def test_a_circle_brings_back_what_one_says(speakers):
    vehicle, gateway, _ = speakers
    endpoints = [Endpoint(), Endpoint(gateway.link.getsockname())]
    with UdpRouter(endpoints, time.monotonic, echo=True):
        vehicle.link.sendto(b"hello", (HOST, endpoints[0].port))
        assert (gateway.hear(), vehicle.hear()) == (b"hello", b"hello")
        gateway.link.sendto(b"text", (HOST, endpoints[1].port))
        assert (gateway.hear(), vehicle.hear()) == (b"text", b"text")


def test_a_cut_is_for_both_ways_and_mended(speakers):
    vehicle, gateway, _ = speakers
    endpoints = [Endpoint(), Endpoint(gateway.link.getsockname())]
    with UdpRouter(endpoints, time.monotonic):
        vehicle.link.sendto(b"here", (HOST, endpoints[0].port))
        assert gateway.hear() == b"here"
        endpoints[0].cut(0.0)
        vehicle.link.sendto(b"in vain", (HOST, endpoints[0].port))
        deadline_s = time.monotonic() + 5.0
        while not endpoints[0].inward.counts["cut"] and time.monotonic() < deadline_s:
            time.sleep(0.005)
        endpoints[0].mend()
        vehicle.link.sendto(b"again", (HOST, endpoints[0].port))
        assert gateway.hear() == b"again"


def test_an_endpoint_without_anybody_there_is_no_error(speakers):
    vehicle, gateway, gone = speakers
    gone.link.close()
    endpoints = [Endpoint(), Endpoint(gateway.link.getsockname()), Endpoint((HOST, 9))]
    with UdpRouter(endpoints, time.monotonic):
        for n in range(5):
            vehicle.link.sendto(b"%d" % n, (HOST, endpoints[0].port))
            assert gateway.hear() == b"%d" % n

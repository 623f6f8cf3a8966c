"""Bus load: against the published worst and best cases, and by what an interface counts."""

import asyncio
import json
import os
import stat

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.load import BitRates, BusLoadMeter, Traffic, byte_s, overhead_s
from drivers.can.network_interface import Controller, bit_rates, parse_controller, traffic

MBIT = BitRates(1_000_000)


def frame_s(frame: CanFrame, rates: BitRates = MBIT) -> float:
    return overhead_s(frame, rates) + len(frame.data) * byte_s(frame, rates)


def bounds_s(data_bytes: int, extended: bool) -> tuple[float, float]:
    """Davis et al., without stuff bits and with all that there can be, at 1 Mbit/s."""
    stuffable = (54 if extended else 34) + 8 * data_bytes
    return (stuffable + 13) * 1e-6, (stuffable + 13 + (stuffable - 1) // 4) * 1e-6


@given(st.integers(0, 8), st.booleans())
def test_a_classic_frame_takes_between_the_least_and_the_most_of_the_analysis(data_bytes, extended):
    least_s, most_s = bounds_s(data_bytes, extended)
    assert least_s < frame_s(CanFrame(0.0, 1, bytes(data_bytes), extended)) < most_s


def test_a_full_frame_at_one_megabit_is_the_well_known_eighth_of_a_millisecond():
    assert frame_s(CanFrame(0.0, 1, bytes(8))) == pytest.approx(131e-6, rel=0.1)
    assert frame_s(CanFrame(0.0, 1, bytes(8), extended=False)) == pytest.approx(111e-6, rel=0.1)


@given(st.sampled_from([0, 8, 16, 20, 64]), st.booleans())
def test_data_of_an_fd_frame_go_at_their_own_rate(data_bytes, extended):
    frame = CanFrame(0.0, 1, bytes(data_bytes), extended, fd=True)
    slow, fast = frame_s(frame), frame_s(frame, BitRates(1_000_000, 8_000_000))
    nominal_s = fast - (slow - fast) / 7.0
    arbitration_bits = 36 if extended else 17
    assert nominal_s == pytest.approx((arbitration_bits * 1.1 + 12) * 1e-6)
    assert slow - nominal_s > (data_bytes * 8 + 5 + 27) * 1e-6


def test_what_was_read_is_all_that_is_known_without_an_interface():
    meter, frames = BusLoadMeter(MBIT), [CanFrame(0.0, 1, bytes(n % 9), extended=bool(n % 2)) for n in range(900)]
    assert meter.share(10.0) is None
    meter.read(FrameBlock.of(frames[:400]))
    meter.read(FrameBlock.of(frames[400:]))
    assert meter.share(10.5) == pytest.approx(sum(map(frame_s, frames)) / 0.5)
    assert meter.share(11.0) == 0.0


def test_what_is_not_read_is_counted_by_the_interface_and_taken_for_the_same_kind():
    meter, frame = BusLoadMeter(MBIT), CanFrame(0.0, 1, bytes(4), extended=False)
    meter.share(10.0, Traffic(1000, 8000))
    meter.read(FrameBlock.of([frame] * 10))
    assert meter.share(11.0, Traffic(3000, 16_000)) == pytest.approx(2000 * frame_s(frame))


def test_with_nothing_read_frames_are_taken_for_classic_ones_with_long_identifiers():
    meter = BusLoadMeter(BitRates(500_000))
    meter.share(0.0, Traffic(0, 0))
    full = 2.0 * frame_s(CanFrame(0.0, 1, bytes(8)))
    assert meter.share(1.0, Traffic(2500, 20_000)) == pytest.approx(2500 * full)


def test_an_interface_that_counts_anew_says_nothing_and_goes_on():
    meter = BusLoadMeter(MBIT)
    meter.share(0.0, Traffic(1000, 8000))
    assert meter.share(1.0, Traffic(10, 80)) is None
    assert meter.share(1.0, Traffic(20, 160)) is None  # no time between
    assert meter.share(2.0, Traffic(30, 240)) > 0.0


@pytest.mark.parametrize("rates", [(0, None), (-1, None), (500_000, 0)])
def test_bit_rates_are_above_nothing(rates):
    with pytest.raises(ValueError, match="above 0 bit/s"):
        BitRates(*rates)


# What Linux says


def link(**data: object) -> bytes:
    return json.dumps([{"ifname": "can0", "linkinfo": {"info_kind": "can", "info_data": data}}]).encode()


@pytest.mark.parametrize(
    ("answer", "rates"),
    [
        (link(bittiming={"bitrate": 500_000}), BitRates(500_000)),
        (
            link(bittiming={"bitrate": 1_000_000}, data_bittiming={"bitrate": 8_000_000}),
            BitRates(1_000_000, 8_000_000),
        ),
        (link(bittiming_bitrate=250_000, data_bittiming_bitrate=2_000_000), BitRates(250_000, 2_000_000)),
        (link(state="STOPPED"), None),
        (link(bittiming_bitrate=0), None),
        (link(bittiming={}), None),
        (b'[{"ifname": "vcan0", "linkinfo": {"info_kind": "vcan"}}]', None),
        (b'[{"ifname": "eth0"}]', None),
        (b"[]", None),
        (b"{}", None),
        (b"null", None),
        (b"", None),
        (b"\xff", None),
        (b'[{"linkinfo": {"info_data": []}}]', None),
    ],
)
def test_bit_rates_in_what_ip_says(answer, rates):
    found = parse_controller(answer)
    assert (None if found is None else found.rates) == rates


@pytest.mark.parametrize(
    ("answer", "wanted"),
    [
        (link(state="ERROR-ACTIVE", restart_ms=100), Controller(None, False, 0.1)),
        (link(ctrlmode=["BERR-REPORTING", "LISTEN-ONLY"], restart_ms=0), Controller(None, True, 0.0)),
        (link(ctrlmode=["BERR-REPORTING"]), Controller(None, False, 0.0)),
        (link(ctrlmode="LISTEN-ONLY", restart_ms="soon"), Controller(None, False, 0.0)),
    ],
)
def test_how_a_controller_is_set_up(answer, wanted):
    assert parse_controller(answer) == wanted


@given(
    st.recursive(
        st.none() | st.integers() | st.text(max_size=3),
        lambda inner: (
            st.dictionaries(
                st.sampled_from(
                    ["bittiming", "bitrate", "data_bittiming", "ctrlmode", "restart_ms", "bittiming_bitrate"]
                ),
                inner,
            )
            | st.lists(inner, max_size=2)
        ),
        max_leaves=6,
    )
)
def test_no_settings_of_a_controller_are_an_exception(data):
    answer = json.dumps([{"linkinfo": {"info_kind": "can", "info_data": data}}]).encode()
    assert (parse_controller(answer) is None) == (not isinstance(data, dict))


@given(st.binary(max_size=40))
def test_whatever_ip_says_is_no_exception(answer):
    assert parse_controller(answer) is None


async def test_an_interface_without_bit_rate_or_without_being_has_none():
    assert await bit_rates("lo") is None
    assert await bit_rates("nosuchcan9") is None


@pytest.fixture
def own_ip(tmp_path, monkeypatch):
    """An `ip` that a test writes, first in the path."""

    def write(script: str) -> None:
        path = tmp_path / "ip"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    return write


async def test_ip_is_asked_for_this_interface(own_ip):
    answer = link(bittiming={"bitrate": 125_000}).decode()
    own_ip(f"""[ "$*" = "-details -json link show dev can7" ] && echo '{answer}'""")
    assert await bit_rates("can7") == BitRates(125_000)


async def test_an_ip_that_hangs_is_given_up(own_ip, monkeypatch):
    monkeypatch.setattr("drivers.can.network_interface.ANSWER_S", 0.05)
    own_ip("exec sleep 60")
    async with asyncio.timeout(5.0):
        assert await bit_rates("can7") is None


async def test_a_machine_without_ip_knows_no_bit_rate(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert await bit_rates("can7") is None


def test_traffic_is_both_ways_as_the_interface_counts_it(tmp_path):
    counts = {"rx_packets": 100, "tx_packets": 7, "rx_bytes": 800, "tx_bytes": 50}
    folder = tmp_path / "can0" / "statistics"
    folder.mkdir(parents=True)
    for name, count in counts.items():
        (folder / name).write_text(f"{count}\n")
    assert traffic("can0", tmp_path) == Traffic(107, 850)
    (folder / "tx_bytes").write_text("\n")
    assert traffic("can0", tmp_path) is None
    assert traffic("can1", tmp_path) is None

"""The benchmark of a whole dive: the traffic that it says, judged whole, and healthy."""

from __future__ import annotations

import json

from click.testing import CliRunner
from pymavlink import mavutil

from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport
from hil_tests.bench import bench
from hil_tests.bench.dive_log import PERIOD_S, RATE_HZ, START_S, THRUSTERS, write_candump, write_tlog


def test_a_minute_is_replayed_and_nothing_is_found():
    result = CliRunner().invoke(
        bench, ["replay", "--minutes", "1", "--jobs", "2", "--json", "-"], catch_exceptions=False
    )
    assert result.exit_code == 0
    figures = json.loads(result.stdout)["replay"]
    assert figures["frames"] == 60 * RATE_HZ * 3 * (1 + THRUSTERS)
    assert figures["messages"] == 60 * 100
    assert 59.0 < figures["dive_s"] < 60.1
    assert figures["times_real_time"] == figures["dive_s"] / figures["wall_s"] > 0.0
    assert figures["faults"] == 0


def test_the_bus_goes_on_where_it_is_repeated(tmp_path):
    frames = write_candump(tmp_path / "dive.log", PERIOD_S + 1)
    damage = DamageReport()
    blocks = [block for _, block in open_can_log(tmp_path / "dive.log", damage)]
    assert damage.records == frames == sum(map(len, blocks))
    assert damage.lines() == []
    times_s = [time_s for block in blocks for time_s in block.time_s.tolist()]
    assert times_s == sorted(times_s)
    assert times_s[-1] - START_S > PERIOD_S + 0.9


def test_pymavlink_reads_the_telemetry(tmp_path):
    messages = write_tlog(tmp_path / "dive.tlog", 2)
    log = mavutil.mavlink_connection(str(tmp_path / "dive.tlog"))
    read = list(iter(log.recv_msg, None))
    assert len(read) == messages == 200
    assert not [message for message in read if message.get_type() == "BAD_DATA"]
    assert {"HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED"} <= {message.get_type() for message in read}
    log.close()

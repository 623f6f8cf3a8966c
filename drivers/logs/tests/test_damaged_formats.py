"""Logs that describe themselves wrongly: fields lost, of other types, or holding what they cannot."""

from __future__ import annotations

import struct

import pytest

from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import read_dataflash
from drivers.logs.tests.dataflash_writer import description, layout, record
from drivers.logs.tests.ulog_writer import TOPICS, data, definitions, flags
from drivers.logs.ulog import read_ulog, ulog_clock
from drivers.readings import Attitude, AutopilotHeartbeat, BodyVelocity


def dataflash(tmp_path, *records):
    path = tmp_path / "dive.BIN"
    path.write_bytes(b"".join(records))
    return path


def ulog(tmp_path, *messages, head=None):
    path = tmp_path / "dive.ulg"
    path.write_bytes((definitions() if head is None else head) + b"".join(messages))
    return path


def retyped(name, number, kinds, names, *values):
    """A description and a record of a type whose fields are other than usual."""
    head = b"\xa3\x95" + bytes([number])
    described = record("FMT", number, layout(kinds).size, name, kinds, names)
    return described + layout(kinds).pack(head, *values)


def readings_of(batches):
    return [one for batch in batches for one in batch]


@pytest.mark.parametrize(
    ("name", "number", "kinds", "names"),
    [("PARM", 64, "QQf", "TimeUS,Name,Value"), ("MSG", 91, "QQ", "TimeUS,Message")],
)
def test_a_name_that_is_a_number_is_none(tmp_path, name, number, kinds, names):
    damaged = retyped(name, number, kinds, names, *range(len(kinds)))
    good = description("RATE"), description("ATT"), record("RATE", 1000), record("ATT", 1000, 0, 5)
    path = dataflash(tmp_path, description("FMT"), damaged, *good)
    readings = readings_of(read_dataflash(path, [], DamageReport()))
    assert [type(one) for one in readings] == [Attitude]


def test_a_mode_that_is_no_number_is_no_warning(tmp_path):
    mode = retyped("MODE", 125, "Qf", "TimeUS,Mode", 1000, float("nan"))
    arm = description("ARM") + record("ARM", 2000, 1)
    readings = readings_of(read_dataflash(dataflash(tmp_path, description("FMT"), mode, arm), [], DamageReport()))
    assert {type(one) for one in readings} <= {AutopilotHeartbeat}


def test_odometry_without_its_velocity_is_none(tmp_path):
    head = definitions().replace(b"float[3] velocity;", b"float[3] velovity;")
    path = ulog(tmp_path, data(9, 1_000_000, 3, 0.1, 0.2, 0.3), head=head)
    assert readings_of(read_ulog(path, [], DamageReport(), navigation=True)) == []
    whole = ulog(tmp_path, data(9, 1_000_000, 3, 0.1, 0.2, 0.3))
    assert [type(one) for one in readings_of(read_ulog(whole, [], DamageReport(), navigation=True))] == [BodyVelocity]


def test_a_system_id_that_is_no_number_is_not_believed(tmp_path):
    name, _, fields, _ = TOPICS[10]
    damaged = fields.replace("uint8_t system_type;uint8_t system_id;", "uint8_t system_type;float system_id;")
    assert damaged != fields
    described = f"{name}:{damaged}".encode()
    head = definitions(10) + struct.pack("<HB", len(described), ord("F")) + described
    head += struct.pack("<HBBH", 3 + len(name), ord("A"), 0, 10) + name.encode()
    body = struct.pack("<HQBB?Bf", 10, 1_000_000, 2, 1, False, 12, float("nan"))
    path = ulog(tmp_path, struct.pack("<HB", len(body), ord("D")) + body, head=head)
    beats = readings_of(read_ulog(path, [], DamageReport()))
    assert {beat.system_id for beat in beats} == {1}


def test_a_log_that_nobody_knows_to_read_is_named(tmp_path):
    path = ulog(tmp_path, head=definitions().replace(flags(), flags(unknown=2)))
    for read in (lambda: list(read_ulog(path, [], DamageReport())), lambda: ulog_clock(path)):
        with pytest.raises(ValueError, match=r"dive\.ulg: .*incompatible flags 02"):
            read()


def test_another_version_is_not_talked_of(tmp_path, capsys):
    head = definitions()
    path = ulog(tmp_path, data(4, 1_000_000, 1.0), head=head[:7] + b"\x09" + head[8:])
    list(read_ulog(path, [], DamageReport()))
    assert capsys.readouterr().out == ""

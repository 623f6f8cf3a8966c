"""ESCs that speak a vendor's messages: what they obey, and what they count and seal."""

from __future__ import annotations

from dataclasses import replace
from struct import unpack_from

import pytest

from drivers.can.frame import CanFrame
from hil_tests.profiles.tests.loopback import profile
from hil_tests.rig.dbc_nodes import CHECKSUMS, Database, DbcCommander, DbcEscs
from hil_tests.rig.esc_messages import EscReport

VEHICLES = ("paper_hov", "paper_saucer_auv", "paper_portable_auv")
COMMANDS = (0.5, -0.25, 0.75, 0.0)


def nodes(vehicle="paper_hov"):
    what = profile(vehicle)
    database = Database(what.database, what.bus.checksum)
    return DbcCommander(database, what.thrusters), DbcEscs(database, what.thrusters, hold_s=0.5), len(what.thrusters)


def on_bus(unsent, time_s=1.0) -> list[CanFrame]:
    return [CanFrame(time_s, one.identifier, one.data, one.extended) for one in unsent]


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_each_esc_obeys_its_own_command(vehicle):
    commander, escs, count = nodes(vehicle)
    assert escs.commands(1.0) == [0.0] * count
    escs.take(1.0, on_bus(commander.publish(1.0, COMMANDS[:count])))
    assert escs.commands(1.4) == pytest.approx(COMMANDS[:count], abs=1e-3)
    assert escs.commands(1.6) == [0.0] * count
    assert escs.dropped == 0


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("bit", [0, 9, 17, 30])
def test_a_command_with_a_bit_wrong_is_not_obeyed(vehicle, bit):
    commander, escs, _ = nodes(vehicle)
    [frame, *_] = on_bus(commander.publish(1.0, COMMANDS[: nodes(vehicle)[2]]))
    data = bytearray(frame.data)
    data[bit // 8] ^= 1 << bit % 8
    escs.take(1.0, [replace(frame, data=bytes(data)), replace(frame, data=frame.data[:2])])
    assert escs.commands(1.0)[0] == 0.0
    assert escs.dropped == 2


def test_counters_go_round_and_begin_anew_after_a_restart():
    commander, escs, _ = nodes()
    counts = [commander.publish(0.1 * number, COMMANDS)[0].data[2] for number in range(18)]
    assert counts == [*range(16), 0, 1]
    commander.restart()
    assert commander.publish(2.0, COMMANDS)[0].data[2] == 0
    reports = [escs.report(1.0, 1, EscReport(100.0, 110.0, 5.0))[0].data[6] for _ in range(3)]
    escs.restart(0)  # another one
    reports.append(escs.report(1.0, 1, EscReport(100.0, 110.0, 5.0))[0].data[6])
    escs.restart(1)
    reports.append(escs.report(1.0, 1, EscReport(100.0, 110.0, 5.0))[0].data[6])
    assert reports == [0, 1, 2, 3, 0]


def test_checksums_are_those_of_their_standards():
    assert CHECKSUMS["crc8_sae_j1850"](b"123456789") == 0x4B  # catalogue of parametrised CRC algorithms
    assert CHECKSUMS["sum8"](bytes([200, 100])) == 44
    assert CHECKSUMS["xor8"](bytes([0xF0, 0x3C])) == 0xCC


def test_values_stay_within_what_the_database_says():
    _, escs, _ = nodes()
    [report] = escs.report(1.0, 0, EscReport(1e6, -5.0, 1e3))
    speed, voltage, current = unpack_from("<hHh", report.data)
    assert (0.1 * speed, 0.01 * voltage, 0.01 * current) == pytest.approx((2000.0, 0.0, 300.0))


def test_what_a_database_has_not_is_said():
    what = profile("paper_hov")
    database = Database(what.database, "xor8")
    for signal, words in (("Nothing.Here", "Nothing: paper_hov.dbc has no such message"),
                          ("Command1.Here", "Command1.Here: paper_hov.dbc has no such signal")):  # fmt: skip
        with pytest.raises(ValueError, match=words):
            database.message([signal])
    with pytest.raises(ValueError, match="want signals of one message"):
        database.message(["Command1.Voltage", "Command2.Voltage"])

"""A thruster that is another one than the state of earlier runs knows is told."""

import pytest

from gateway import state
from gateway.commissioning.earlier import compared, earlier_curves
from gateway.commissioning.state_file import taught
from gateway.commissioning.tests.made_thrusters import config, dive, samples
from gateway.commissioning.thruster import commission_thruster


def learnt(settings, seed, gain=1.0):
    return [commission_thruster(settings.thruster[0], settings, [dive({1: samples(150.0, seed, gain=gain)})], False)]


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    return config(tmp_path_factory.mktemp("config"))


@pytest.fixture(scope="module")
def known(settings, tmp_path_factory):
    path = tmp_path_factory.mktemp("state") / "vehicle.state"
    state.save(path, taught(settings, learnt(settings, 1)).state)
    return path


def test_the_same_thruster_is_nothing_to_remark(settings, known):
    assert compared(learnt(settings, 5), known)[0].part.remarks == ()


def test_another_thruster_is_remarked(settings, known):
    (remark,) = compared(learnt(settings, 5, gain=0.7), known)[0].part.remarks
    assert remark.startswith("it is 30% slower at the same command than the state of earlier runs knows it")


@pytest.mark.parametrize("data", [None, b"", b"no state of ours"])
def test_without_a_state_that_can_be_used_there_is_nothing_to_compare(settings, tmp_path, data):
    path = tmp_path / "vehicle.state"
    if data is not None:
        path.write_bytes(data)
    assert earlier_curves(path) == {}
    found = learnt(settings, 5)
    assert compared(found, path) == found

"""The buttons for QGroundControl: in its format, and each of them a command that is taken."""

import json
from importlib.resources import files

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.encoder import COMPANION_COMPONENT
from drivers.mavlink.tests.peer import Peer
from drivers.readings import OperatorAct
from gateway.operator import subject_of

FILE = json.loads(files("gateway").joinpath("examples/qgc_actions.json").read_text())
# All that QGroundControl knows; it refuses a file with others.
KEYS = {"label", "description", "mavCmd", "compId", *(f"param{n}" for n in range(1, 8))}


def test_the_file_is_of_the_kind_that_qgroundcontrol_loads():
    assert (FILE["version"], FILE["fileType"]) == (1, "MavlinkActions")
    assert set(FILE) == {"version", "fileType", "actions"}
    labels = [action["label"] for action in FILE["actions"]]
    assert len(labels) == len(set(labels))


@pytest.mark.parametrize("action", FILE["actions"], ids=lambda action: action["label"])
def test_each_button_is_taken(action):
    assert {"label", "description", "mavCmd"} <= set(action) <= KEYS
    assert action["compId"] == COMPANION_COMPONENT
    parameters = [action.get(f"param{n}", 0.0) for n in range(1, 8)]
    command = dialect.MAVLink_command_long_message(1, action["compId"], action["mavCmd"], 0, *parameters)
    (request,) = MavlinkDecoder([], autopilot_system=1).decode(Peer(255, 190).pack(command), 0.0)
    assert subject_of(request.code) is not None
    assert request.duration_s == (600.0 if request.act is OperatorAct.MUTE else 0.0)


def test_all_three_acts_have_a_button():
    assert {action["mavCmd"] for action in FILE["actions"]} == {int(act) for act in OperatorAct}

"""All targets, by their names."""

from __future__ import annotations

from hil_tests.fuzz.autopilot_logs import autopilot_log_targets
from hil_tests.fuzz.can_frames import can_frame_targets
from hil_tests.fuzz.can_logs import can_log_targets
from hil_tests.fuzz.mavlink_streams import mavlink_targets
from hil_tests.fuzz.recordings import recording_targets
from hil_tests.fuzz.replays import replay_target
from hil_tests.fuzz.target import Target
from hil_tests.fuzz.texts import text_targets
from hil_tests.fuzz.vendor import database_target

TARGETS: dict[str, Target] = {
    one.name: one
    for one in (
        *can_frame_targets(),
        database_target(),
        *mavlink_targets(),
        *can_log_targets(),
        *autopilot_log_targets(),
        *recording_targets(),
        *text_targets(),
        replay_target(),
    )
}

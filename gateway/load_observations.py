"""What the loads of buses and of this machine are in the supervisor's terms: judged by a limit, and no more."""

from __future__ import annotations

import math

from detectors.verdict import Level
from drivers.readings import BusLoad, FrameLoss, Lateness
from gateway.observation import Observation

# who says so, for the supervisor's policies
LINK, GATEWAY = "link", "gateway"
# The pilot is to hear of a fault within a second: so far behind, he does not
BEHIND_MAX_S = 0.5


def bus_load_observation(reading: BusLoad, share_max: float) -> Observation:
    """Whether a bus carries more than it should: from there on, frames of a low priority come late or not at all.

    Args:
        reading: the load.
        share_max: of the bit rate, above which it is told.
    """
    over = reading.share > share_max
    return Observation(
        time_s=reading.time_s,
        detector=LINK,
        subject=f"link {reading.link} load",
        label=f"{reading.link} load",
        level=Level.SUSPECT if over else Level.NORMAL,
        score=reading.share / share_max,
        trouble=f"{reading.share:.0%}, limit {share_max:.0%}",
        details=() if over else (f"{reading.share:.0%}",),
    )


def frame_loss_observation(reading: FrameLoss) -> Observation:
    """Whether frames of a bus are lost in this machine: what they would have said is not known."""
    lost = f"lost {reading.frames} frames: machine too slow"
    return Observation(
        time_s=reading.time_s,
        detector=LINK,
        subject=f"link {reading.link} frames",
        label=reading.link,
        level=Level.SUSPECT if reading.frames or reading.overruns else Level.NORMAL,
        score=math.nan,
        trouble=lost if reading.frames else f"controller lost frames, {reading.overruns} times",
        over="no frames lost any more",
    )


def lateness_observation(reading: Lateness) -> Observation:
    """Whether this program keeps up: all that it says of others is as old as it is late."""
    return Observation(
        time_s=reading.time_s,
        detector=GATEWAY,
        subject="gateway",
        label="Gateway",
        level=Level.SUSPECT if reading.lost or reading.behind_s > BEHIND_MAX_S else Level.NORMAL,
        score=reading.behind_s / BEHIND_MAX_S,
        trouble=_late(reading),
    )


def _late(reading: Lateness) -> str:
    if reading.lost:
        return f"lost {reading.lost} readings: machine too busy"
    return f"{reading.behind_s:.1f} s behind: machine too busy"

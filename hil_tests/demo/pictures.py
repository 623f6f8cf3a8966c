"""The plots of a demonstration, one for each act."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gateway.config import Config
from hil_tests.demo.navigation_plot import NavigationStory, draw_navigation
from hil_tests.demo.plan import ENTANGLED, Plan
from hil_tests.demo.plot import draw
from hil_tests.demo.record import DVL, SPEED, Recording
from hil_tests.demo.speed_plot import SpeedStory, draw_speed
from hil_tests.demo.summary import Summary
from hil_tests.demo.tracks import Track, track
from hil_tests.demo.trusting import trusting_states
from hil_tests.rig.embedded import Moment

FILES = ("demo.png", "speed.png", "navigation.png")


def estimated_tracks(
    config: Config, recording: Recording, moments: Sequence[Moment], drift_s: float
) -> tuple[Track, Track]:
    """Where the gateway took the vehicle to be, and where it would have, had it trusted the DVL.

    Args:
        config: of the gateway.
        recording: of the demonstration.
        moments: the truth.
        drift_s: when the DVL begins to drift, on the clock of the recording: if it does, both go through the true
            place then, for what they differ in from there on is the drift's.
    """
    trusting = trusting_states(config, (one.sample for one in recording.navigation))
    tracks = track(one.verdict.state for one in recording.navigation), track(trusting)
    if moments and drift_s <= moments[-1].time_s and all(len(one.time_s) for one in tracks):
        return tracks[0].anchored(moments, drift_s), tracks[1].anchored(moments, drift_s)
    return tracks


def draw_pictures(
    folder: Path,
    script: Plan,
    summary: Summary,
    recording: Recording,
    moments: Sequence[Moment],
    tracks: tuple[Track, Track],
    start_s: float,
) -> None:
    """Write them all as PNG into a folder that exists.

    Args:
        folder: where.
        script: what happened when.
        summary: what came of it.
        recording: what the gateway saw and said.
        moments: the truth.
        tracks: see `estimated_tracks`.
        start_s: what is zero on the time axes.
    """
    found = {one.trouble.subject: one for one in summary.found}
    weeds, net, drift = (found.get(subject) for subject in (f"thruster {ENTANGLED}", SPEED, DVL))
    lasted_s = summary.lasted_s
    if weeds is not None:
        history = recording.judged.get(ENTANGLED, [])
        draw(folder / FILES[0], history, weeds, start_s=start_s, lasted_s=lasted_s, freed_s=script.freed_s)
    speed = SpeedStory(moments, recording.speed, net, start_s, lasted_s, script.current_s, script.net_freed_s)
    draw_speed(folder / FILES[1], speed)
    draw_navigation(
        folder / FILES[2], NavigationStory(moments, recording.navigation, drift, start_s, lasted_s, *tracks)
    )

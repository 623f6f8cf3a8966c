"""Whether there is a place for recordings, and room for them."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from gateway.checking.result import CheckResult
from gateway.config_sections import Recording
from gateway.recording.folder import MB, recordings

SUBJECT = "recording"
# the smallest budget that there is
LEAST_MB = 2.0


def check_recording(recording: Recording) -> CheckResult:
    """Looks at the folder and its disk; nothing is written."""
    folder = recording.folder
    if not recording.enabled:
        return CheckResult(SUBJECT, True, "nothing is recorded (recording.enabled = false)")
    place = folder if folder.exists() else folder.parent
    if place.exists() and not place.is_dir():
        return CheckResult(SUBJECT, False, f"{place} is no folder", "move it away, or set recording.folder")
    if not place.is_dir():
        return CheckResult(SUBJECT, False, f"no folder {place}", f"mkdir -p {folder.parent}, or set recording.folder")
    try:
        if not os.access(place, os.R_OK | os.W_OK | os.X_OK):
            raise PermissionError(f"{place} cannot be written")
        return _room(recording, place)
    except OSError as error:
        return CheckResult(SUBJECT, False, str(error), "give this user the right to, or set recording.folder")


def _room(recording: Recording, place: Path) -> CheckResult:
    """Whether the budget fits on the disk: beyond it the oldest are deleted, and on a full disk it pauses."""
    taken_mb = sum(one.size for one in recordings(place)) / MB
    free_mb = shutil.disk_usage(place).free / MB
    more_mb = free_mb - recording.keep_free_mb
    seen = f"{recording.folder} has {taken_mb:.0f} MB of recordings, its disk {free_mb:.0f} MB free"
    if taken_mb + more_mb < LEAST_MB:
        remedy = "make room, or set recording.folder or recording.keep_free_mb: until then nothing is recorded"
        return CheckResult(SUBJECT, False, f"{seen}, of which {recording.keep_free_mb:.0f} MB stay free", remedy)
    if taken_mb + more_mb < recording.budget_mb:
        advice = f"set recording.budget_mb below {taken_mb + more_mb:.0f} to have the oldest deleted in time"
        return CheckResult(SUBJECT, True, f"{seen}; it pauses after {more_mb:.0f} MB more: {advice}")
    return CheckResult(SUBJECT, True, f"{seen}; the oldest are deleted beyond {recording.budget_mb:.0f} MB")

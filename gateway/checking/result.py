"""What one check of `gateway check` found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CheckResult:
    """What a check found.

    Attributes:
        subject: what was looked at.
        ok: True if the gateway can work with it.
        detail: what was seen.
        remedy: what to do where it is not ok.
    """

    subject: str
    ok: bool
    detail: str
    remedy: str = ""

    def line(self) -> str:
        """For the terminal."""
        if self.ok:
            return f"ok       {self.subject}: {self.detail}"
        return f"problem  {self.subject}: {self.detail}; {self.remedy}"

"""The paper's basis of the flow: Gaussian radial times tidal functions (paper 002, equation 6)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FlowBasis:
    """N functions of place and time; helper A completes this."""

    centres_m: tuple[tuple[float, ...], ...]
    widths_m: tuple[float, ...]

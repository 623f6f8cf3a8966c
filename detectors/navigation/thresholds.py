"""The likelihood ratio at which a fault counts as found, by the rate of false alarms that is wanted; and below it."""

from __future__ import annotations

from math import log

# Ratios that healthy dives exceed so many times an hour follow an exponential law in their tail: see
# `hil_tests.navigation_thresholds`, which measures these two numbers.
ONCE_AN_HOUR = 22.0
PER_E_FOLD = 3.0
# As shares of it: a sensor is suspected, and sooner while on probation.
SUSPECT_SHARE, PROBATION_SHARE = 0.7, 0.5


def ratio_threshold(false_alarms_per_hour: float) -> float:
    """Twice the logarithm of the likelihood ratio that a healthy vehicle exceeds that often."""
    return max(ONCE_AN_HOUR - PER_E_FOLD * log(false_alarms_per_hour), 10.0)

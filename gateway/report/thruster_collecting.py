"""The course of a thruster, collected while it is judged."""

from __future__ import annotations

import numpy as np

from detectors.thruster import CommissionedCurve, LearntCurve
from gateway.channel import ThrusterJudgement
from gateway.config_sections import Thruster
from gateway.report.dive import Curve, ThrusterCourse
from gateway.report.thinning import FloatArray, Thinning
from gateway.thruster_channel import JudgedColumns, ThrusterCurves

VALUES = ("command", "speed_rpm", "predicted_rpm", "residual_rpm", "threshold_rpm", "score", "level")
PEAKS = ("command", "speed_rpm", "residual_rpm", "score", "level")
# Thrusters report ten times a second, or oftener
GAP_S = 1.0


class ThrusterCollecting:
    """Takes judgements of one thruster, in order.

    Args:
        thruster: which.
    """

    def __init__(self, thruster: Thruster) -> None:
        self._thruster = thruster
        self._thinning = Thinning(VALUES, PEAKS, GAP_S)
        self._refits: list[FloatArray] = []

    def take_columns(self, judged: JudgedColumns) -> None:
        """Many at once."""
        samples, said = judged.samples, judged.verdicts.whole
        self._thinning.extend(
            samples.time_s,
            samples.command,
            samples.speed_rpm,
            said.predicted_rpm,
            said.residual_rpm,
            said.threshold_rpm,
            said.score,
            said.level.astype(np.float64),
        )
        if said.refitted.any():
            self._refits.append(samples.time_s[said.refitted])

    def take(self, judged: ThrusterJudgement) -> None:
        """One alone."""
        sample, said = judged.sample, judged.verdict
        self._thinning.append(
            sample.time_s,
            sample.command,
            sample.speed_rpm,
            said.predicted_rpm,
            said.residual_rpm,
            said.threshold_rpm,
            said.score,
            float(said.level),
        )
        if said.refitted:
            self._refits.append(np.array([sample.time_s]))

    def course(self, begin_s: float, curves: ThrusterCurves) -> ThrusterCourse:
        """All of it; times since `begin_s`."""
        time_s, values = self._thinning.columns()
        thruster = self._thruster
        return ThrusterCourse(
            number=thruster.number,
            name=thruster.name or f"thruster {thruster.number}",
            time_s=time_s - begin_s,
            **{name: values[name] for name in VALUES if name != "level"},
            level=np.nan_to_num(values["level"]).astype(np.int64),
            refit_s=np.concatenate([np.empty(0), *self._refits]) - begin_s,
            curve=None if curves.learnt is None else learnt_curve(curves.learnt),
            commissioned=None if curves.commissioned is None else commissioned_curve(curves.commissioned),
        )


def learnt_curve(learnt: LearntCurve) -> Curve:
    """As the report shows it; an error that is infinite is not known."""
    error_rpm = np.where(np.isfinite(learnt.deviation_rpm), learnt.deviation_rpm, np.nan)
    return Curve(learnt.command, learnt.speed_rpm, error_rpm)


def commissioned_curve(commissioned: CommissionedCurve) -> Curve:
    """Likewise; its error was not kept."""
    command = np.array(commissioned.command)
    return Curve(command, np.array(commissioned.speed_rpm), np.full(len(command), np.nan))

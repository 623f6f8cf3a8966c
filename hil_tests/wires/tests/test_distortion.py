"""What faults make of values: every failure of the table, its ramp, its axis and its end."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from hil_tests.scenario.failures import SENSORS, Target, kinds_of
from hil_tests.scenario.fault import Fault, Subject
from hil_tests.wires.distortion import Distortion, Vector

ONSET_S = 1.0
STEP_S = 0.1


def fault(
    failure: str,
    target: Target = Target.DVL,
    *,
    axis: int | None = None,
    ramp_s: float = 0.0,
    until_s: float = inf,
    **values: float,
) -> Fault:
    """A fault from 1 s on."""
    return Fault(
        subject=Subject(target, target.value),
        failure=failure,
        at_s=ONSET_S,
        until_s=until_s,
        ramp_s=ramp_s,
        values=values,
        axis=axis,
    )


def said(*faults: Fault, samples: int = 41, seed: int = 0) -> list[Vector | None]:
    """Of a value that counts samples, one each 0.1 s: (0, 0), (1, -1), (2, -2) ..."""
    distortion = Distortion(faults, seed)
    return [distortion.value(round(STEP_S * n, 9), (float(n), -float(n))) for n in range(samples)]


def test_before_the_onset_and_after_the_end_it_is_the_very_object() -> None:
    distortion = Distortion([fault("bias", bias_mps=1.0, until_s=2.0)])
    vector = (1.0, 2.0)
    assert distortion.value(0.99, vector) is vector
    assert distortion.value(1.0, vector) == (2.0, 3.0)
    assert distortion.value(2.0, vector) is vector


@pytest.mark.parametrize(
    ("one", "at_15", "at_30"),
    [
        (fault("off"), None, None),
        (fault("stuck"), (9.0, -9.0), (9.0, -9.0)),
        (fault("wrong", value_mps=7.0), (7.0, 7.0), (7.0, 7.0)),
        (fault("wrong", value_mps=7.0, ramp_s=1.0), (11.0, -4.0), (7.0, 7.0)),
        (fault("delayed", delay_s=1.0), (10.0, -10.0), (20.0, -20.0)),
        (fault("intermittent", period_s=1.0), None, (30.0, -30.0)),
        (fault("scale", factor=3.0), (45.0, -45.0), (90.0, -90.0)),
        (fault("scale", factor=3.0, ramp_s=1.0), (30.0, -30.0), (90.0, -90.0)),
        (fault("dropped_pulses", Target.RPM, share=0.5), (7.5, -7.5), (15.0, -15.0)),
        (fault("reverse"), (-15.0, 15.0), (-30.0, 30.0)),
        (fault("bias", bias_mps=2.0, ramp_s=1.0), (16.0, -14.0), (32.0, -28.0)),
        (fault("drift", drift_mps2=2.0), (16.0, -14.0), (34.0, -26.0)),
        (fault("drift", drift_mps2=2.0, ramp_s=1.0), (15.25, -14.75), (33.0, -27.0)),
        (fault("no_lock"), (0.0, 0.0), (0.0, 0.0)),
        (fault("reset", Target.POSITION, north_m=5.0, east_m=-1.0), (20.0, -16.0), (35.0, -31.0)),
        (fault("bias", bias_mps=2.0, axis=1), (15.0, -13.0), (30.0, -28.0)),
        (fault("stuck", axis=0), (9.0, -15.0), (9.0, -30.0)),
    ],
    ids=lambda value: f"{value.failure} {dict(value.values)} {value.ramp_s}" if isinstance(value, Fault) else "",
)
def test_values(one: Fault, at_15: Vector | None, at_30: Vector | None) -> None:
    values = said(one)
    assert values[9] == (9.0, -9.0)
    for value, wanted in ((values[15], at_15), (values[30], at_30)):
        assert (value is None) == (wanted is None)
        assert value is None or value == pytest.approx(wanted)


def test_slow_lets_one_an_interval_pass_at_its_right_rate() -> None:
    passed = [n for n, value in enumerate(said(fault("slow", interval_s=0.5))) if value is not None]
    assert passed == [*range(11), 15, 20, 25, 30, 35, 40]


def test_a_delay_that_grows_never_runs_back_in_time() -> None:
    values = [value[0] for value in said(fault("delayed", delay_s=1.0, ramp_s=0.5)) if value is not None]
    assert values == sorted(values)
    assert values[40] == pytest.approx(30.0)
    assert len(set(values[11:20])) <= 2  # a second's delay within half of one: it stands still


def test_what_is_stuck_from_the_first_sample_repeats_that_one() -> None:
    distortion = Distortion([fault("stuck")])
    assert [distortion.value(2.0 + n, (float(n),)) for n in range(3)] == [(0.0,)] * 3


@pytest.mark.parametrize("one", [fault("noise", noise_mps=2.0), fault("garbage", spread_mps=2.0)])
def test_chance_has_its_size_and_comes_again_with_the_seed(one: Fault) -> None:
    errors = [
        value[0] - (n if one.failure == "noise" else 0.0)
        for n, value in enumerate(said(one, samples=2000))
        if n >= 10 and value is not None
    ]
    assert np.std(errors) == pytest.approx(2.0, rel=0.1)
    assert abs(np.mean(errors)) < 0.2
    assert said(one) == said(one)
    assert said(one)[20] != said(one, seed=1)[20]


def test_faults_lie_one_upon_the_other_in_their_order() -> None:
    first, second = fault("bias", bias_mps=1.0), fault("scale", factor=2.0)
    assert said(first, second)[20] == (42.0, -38.0)
    assert said(second, first)[20] == (41.0, -39.0)
    assert said(fault("off"), second)[20] is None


def test_every_failure_of_a_value_in_the_table_is_known() -> None:
    for target in (*sorted(SENSORS), Target.RPM, Target.COMMAND):
        for failure, row in kinds_of(target).items():
            values = {one.name: 1.0 if one.default is None else one.default for one in row.quantities}
            assert len(said(fault(failure, target, **values))) == 41


def test_a_failure_of_frames_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"failure 'loss' of bus changes no value: want one of bias, "):
        Distortion([fault("loss", Target.BUS, share=0.5)])

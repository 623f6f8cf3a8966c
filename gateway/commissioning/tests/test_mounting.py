"""What several dives know of one constant, together."""

import numpy as np
import pytest

from gateway.commissioning.mounting import pooled


def test_the_surer_dive_counts_for_more():
    known = pooled(np.array([1.0, 1.2]), np.array([0.1, 0.3]), limit=1.0)
    assert known.value == pytest.approx((1.0 / 0.01 + 1.2 / 0.09) / (1.0 / 0.01 + 1.0 / 0.09))
    assert known.error == pytest.approx((1.0 / 0.01 + 1.0 / 0.09) ** -0.5)
    assert known.spread == 0.0


def test_dives_that_differ_more_than_their_errors_say_so():
    rng = np.random.default_rng(1)
    errors = np.full(400, 0.1)
    known = pooled(2.0 + 0.5 * rng.normal(size=400) + errors * rng.normal(size=400), errors, limit=1.0)
    assert known.spread == pytest.approx(0.5, rel=0.1)
    assert known.value == pytest.approx(2.0, abs=3.0 * known.error)
    assert known.error == pytest.approx((0.25 + 0.01) ** 0.5 / 20.0, rel=0.1)


@pytest.mark.parametrize(("error", "enough"), [(0.19, True), (0.21, False)])
def test_what_is_not_known_well_enough_is_not_used(error, enough):
    assert pooled(np.array([0.5]), np.array([error]), limit=0.2).enough is enough

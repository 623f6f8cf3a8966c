import pickle

import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.lstm import INPUTS, Model, Predictor
from detectors.navigation.published import (
    BIAS_MEDIANS,
    LEARNING_SAMPLES,
    AmplifiedCusum,
    ChiSquare,
    LearntPredictor,
    Residual,
    Residuals,
    published_methods,
)
from detectors.navigation.sample import Sensor
from detectors.navigation.tests.innovations import (
    NOISE_M,
    NOISE_MPS,
    depth_innovation,
    dvl_innovation,
    fix_innovation,
)

CONFIG = NavigationConfig(cusum_bias_mps=0.05)
COVARIANCE = np.diag([0.01, 0.02, 0.03, 0.04])


def residual(*values, features=None):
    return Residual(np.array(values, dtype=float), COVARIANCE, features)


def shares(method, rows):
    return np.array([method.judge(residual(*row)).share for row in rows])


def test_a_residual_is_the_newest_of_both_sensors():
    residuals = Residuals()
    assert residuals.take(depth_innovation(1.0, 0.3)) is None
    assert residuals.take(fix_innovation(1.2)) is None
    first = residuals.take(dvl_innovation(1.5, (0.1, 0.2, 0.3)))
    np.testing.assert_allclose(first.values, (0.1, 0.2, 0.3, 0.3))
    np.testing.assert_allclose(first.covariance, np.diag([NOISE_MPS**2] * 3 + [NOISE_M**2]))
    residuals.take(depth_innovation(2.0, -0.1))
    assert residuals.take(dvl_innovation(2.5, 0.0)).values[3] == -0.1


def test_without_a_depth_sensor_only_the_dvl_counts():
    alone = Residuals().take(dvl_innovation(1.0, (0.02, -0.04, 0.0)))
    assert ChiSquare(CONFIG).judge(alone).share * CONFIG.chi_square_threshold == pytest.approx(5.0)


def test_chi_square_is_the_textbook_s():
    score = ChiSquare(CONFIG).judge(residual(0.3, -0.1, 0.2, 0.5))
    assert score.share == pytest.approx((0.09 / 0.01 + 0.01 / 0.02 + 0.04 / 0.03 + 0.25 / 0.04) / 18.0)
    assert score.sensor is Sensor.DVL
    assert ChiSquare(CONFIG).judge(residual(0.1, 0.1, 0.1, 0.5)).sensor is Sensor.DEPTH


def test_chi_square_of_correlated_residuals_does_not_depend_on_the_axes():
    rng = np.random.default_rng(0)
    root, turn, values = rng.normal(size=(4, 4)), np.linalg.qr(rng.normal(size=(4, 4)))[0], rng.normal(size=4)
    covariance = root @ root.T
    plain = ChiSquare(CONFIG).judge(Residual(values, covariance, None))
    turned = ChiSquare(CONFIG).judge(Residual(turn @ values, turn @ covariance @ turn.T, None))
    assert turned.share == pytest.approx(plain.share)


def read_literally(sizes, bias, gain, threshold):
    """Our reading of equations 12 to 15, one number after the other."""
    statistic, count, said = 0.0, 1, []
    for size in sizes:
        excess = size - bias
        if excess <= 0.0:
            statistic, count = excess, 1
        else:
            statistic = max(0.0, statistic) + gain * count * excess
            count += 1
        said.append(statistic / threshold)
    return said


def test_amplified_cusum_equals_the_reading_one_number_after_the_other():
    rows = 0.06 * np.random.default_rng(1).normal(size=(500, 4))
    rows[200:260, 1] += np.linspace(0.0, 0.3, 60)
    literally = [read_literally(np.abs(column), 0.05, 0.3, 0.2) for column in rows.T]
    np.testing.assert_allclose(shares(AmplifiedCusum(CONFIG), rows), np.max(literally, axis=0), rtol=1e-12)


def test_amplified_cusum_grows_faster_the_longer_it_lasts():
    said = shares(AmplifiedCusum(CONFIG), [(0.1, 0.0, 0.0, 0.0)] * 20)
    growth = np.diff(said)
    np.testing.assert_allclose(np.diff(growth), 0.3 * 0.05 / 0.2)


def test_amplified_cusum_blames_the_sensor_that_it_grew_on():
    method = AmplifiedCusum(CONFIG)
    assert method.judge(residual(0.0, 0.0, 0.0, -0.4)).sensor is Sensor.DEPTH
    assert method.judge(residual(0.0, 4.0, 0.0, 0.0)).sensor is Sensor.DVL


def test_the_healthy_beginning_teaches_what_is_usual():
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(LEARNING_SAMPLES, 4)) * (0.01, 0.02, 0.03, 0.1)
    learning = AmplifiedCusum(NavigationConfig())
    assert not shares(learning, rows).any()
    known = BIAS_MEDIANS * np.median(np.abs(rows), axis=0)
    for number, size in enumerate(known):
        row = np.zeros(4)
        row[number] = 0.999 * size
        assert learning.judge(residual(*row)).share <= 0.0
        row[number] = 1.001 * size
        assert learning.judge(residual(*row)).share > 0.0


def tiny_model(**changes):
    """One that always predicts the same: innovation 0.1, 0.2, 0.3, 0.4 and variance 0.01."""
    zeros = {
        "gate_weights": (4, INPUTS + 1),
        "gate_bias": (4,),
        "dense_weights": (1, 1),
        "dense_bias": (1,),
        "output_weights": (8, 1),
    }
    arrays = {name: np.zeros(shape, np.float32) for name, shape in zeros.items()}
    bias = np.array([0.1, 0.2, 0.3, 0.4, *[np.log(0.01)] * 4], np.float32)
    scaling = {"input_mean": np.zeros(INPUTS, np.float32), "input_scale": np.ones(INPUTS, np.float32)}
    scaled = {"output_mean": np.zeros(8, np.float32), "output_scale": np.ones(8, np.float32)}
    return Model(**arrays | scaling | scaled | {"output_bias": bias} | changes, interval_s=1.0)


def test_the_learnt_predictor_judges_what_it_did_not_foretell():
    method = LearntPredictor(CONFIG, Predictor(tiny_model()))
    seen = np.zeros(INPUTS)
    assert method.judge(residual(0.1, 0.2, 0.3, 0.4, features=seen)).share == pytest.approx(0.0, abs=1e-9)
    score = method.judge(residual(0.3, 0.2, 0.3, 0.4, features=seen))
    assert score.share == pytest.approx(0.04 / (0.01 + 0.01) / 10.0, rel=1e-5)
    assert score.sensor is Sensor.DVL
    assert method.judge(residual(0.1, 0.2, 0.3, 1.4, features=seen)).sensor is Sensor.DEPTH


def test_without_inertial_samples_nothing_is_foretold():
    assert LearntPredictor(CONFIG, Predictor(tiny_model())).judge(residual(9.0, 9.0, 9.0, 9.0)).share == 0.0


def test_the_model_is_read_only_where_it_is_wanted(tmp_path):
    gone = tmp_path / "gone.npz"
    assert set(published_methods(NavigationConfig(lstm_model=gone))) == {"chi_square", "cusum"}
    with pytest.raises(ValueError, match=r"gone\.npz"):
        published_methods(NavigationConfig(lstm_model=gone, method="lstm"))
    path = tmp_path / "model.npz"
    tiny_model().save(path)
    for wish in ({"method": "lstm"}, {"compare": True}):
        methods = published_methods(NavigationConfig(lstm_model=path, **wish))
        assert set(methods) == {"chi_square", "cusum", "lstm"}
        foretold = methods["lstm"].judge(residual(0.1, 0.2, 0.3, 0.4, features=np.zeros(INPUTS)))
        assert foretold.share == pytest.approx(0.0, abs=1e-9)


def test_pickled_they_go_on_bit_for_bit():
    rows = 0.1 * np.random.default_rng(3).normal(size=(200, 4))
    for method in (ChiSquare(CONFIG), AmplifiedCusum(CONFIG), AmplifiedCusum(NavigationConfig())):
        shares(method, rows[:50])
        copy = pickle.loads(pickle.dumps(method))  # noqa: S301
        np.testing.assert_array_equal(shares(copy, rows[50:]), shares(method, rows[50:]))

import pickle
from math import exp, tanh

import numpy as np
import pytest

from detectors.navigation.lstm import FARTHEST, INPUTS, Model, ModelError, Predictor, lstm_statistic, read_model


def small_model(hidden=3, seed=0, **changes):
    rng = np.random.default_rng(seed)

    def draw(*shape):
        return rng.normal(size=shape).astype(np.float32)

    arrays = {
        "gate_weights": draw(4 * hidden, INPUTS + hidden),
        "gate_bias": 0.3 * draw(4 * hidden),
        "dense_weights": draw(hidden, hidden),
        "dense_bias": draw(hidden),
        "output_weights": draw(8, hidden),
        "output_bias": draw(8),
        "input_mean": draw(INPUTS),
        "input_scale": np.exp(draw(INPUTS)),
        "output_mean": draw(8),
        "output_scale": 0.1 * np.exp(draw(8)),
    }
    return Model(**arrays | changes, interval_s=1.0, provenance={"seed": seed})


def motion(count, seed=1):
    return np.random.default_rng(seed).normal(size=(count, INPUTS))


def walk(predictor, rows):
    return np.array([np.concatenate(predictor.step(row)) for row in rows])


def by_the_textbook(model, rows):
    """The same network with a loop for every sum (paper 003, figure 4), in double precision."""

    def dot(left, right):
        return sum(float(a) * float(b) for a, b in zip(left, right, strict=True))

    def sigmoid(x):
        return 1.0 / (1.0 + exp(-x))

    count = model.hidden
    hidden, cell, said = [0.0] * count, [0.0] * count, []
    for row in rows:
        scaled = (row - model.input_mean) / model.input_scale
        inputs = [min(max(float(x), -FARTHEST), FARTHEST) for x in scaled] + hidden
        gate = [dot(w, inputs) + float(b) for w, b in zip(model.gate_weights, model.gate_bias, strict=True)]
        for unit in range(count):
            let_in, keep, new, let_out = (gate[part * count + unit] for part in range(4))
            cell[unit] = sigmoid(keep) * cell[unit] + sigmoid(let_in) * tanh(new)
            hidden[unit] = sigmoid(let_out) * tanh(cell[unit])
        dense = [dot(w, hidden) + float(b) for w, b in zip(model.dense_weights, model.dense_bias, strict=True)]
        dense = [x if x > 0.0 else 0.01 * x for x in dense]
        output = [dot(w, dense) + float(b) for w, b in zip(model.output_weights, model.output_bias, strict=True)]
        output = np.array(output) * model.output_scale + model.output_mean
        said.append([*output[:4], *np.exp(output[4:])])
    return np.array(said)


def test_equals_the_textbook():
    model, rows = small_model(), 3.0 * motion(40)
    np.testing.assert_allclose(walk(Predictor(model), rows), by_the_textbook(model, rows), rtol=1e-4, atol=1e-5)


def test_equals_pytorch():
    """What PyTorch 2.13.0 says at the first and the fifth step, with the weights of `small_model` in it.

    gateway/tests/test_training.py compares with PyTorch itself, where it is installed.
    """
    said = walk(Predictor(small_model()), motion(5))
    first = [-0.71027, -0.48503, -2.60885, -0.67079, 1.03485, 2.23682, 0.51181, 0.75448]
    fifth = [-0.71247, -0.44974, -3.18840, -0.63990, 1.01923, 2.15577, 0.51035, 0.72937]
    np.testing.assert_allclose(said[[0, 4]], [first, fifth], rtol=0, atol=6e-6)


def test_predicts_from_what_went_before():
    model, rows = small_model(), motion(20)
    changed = rows.copy()
    changed[0] += 1.0
    assert (walk(Predictor(model), rows)[5] != walk(Predictor(model), changed)[5]).all()


def test_reset_forgets():
    predictor, rows = Predictor(small_model()), motion(20)
    first = walk(predictor, rows)
    predictor.reset()
    np.testing.assert_array_equal(walk(predictor, rows), first)


def test_pickled_it_goes_on_bit_for_bit():
    predictor, rows = Predictor(small_model(hidden=33)), motion(40)
    walk(predictor, rows[:20])
    copy = pickle.loads(pickle.dumps(predictor))  # noqa: S301
    np.testing.assert_array_equal(walk(copy, rows[20:]), walk(predictor, rows[20:]))


def test_what_is_far_from_all_that_was_seen_does_not_count_more_the_farther_it_is():
    model = small_model()
    far = model.input_mean + 10.0 * FARTHEST * model.input_scale
    farther = model.input_mean + 1e6 * FARTHEST * model.input_scale
    np.testing.assert_array_equal(walk(Predictor(model), [far]), walk(Predictor(model), [farther]))


def test_a_file_gives_the_same_model(tmp_path):
    model = small_model()
    model.save(tmp_path / "model.npz")
    read = read_model(tmp_path / "model.npz")
    assert read.provenance == {"seed": 0}
    assert read.interval_s == 1.0
    np.testing.assert_array_equal(walk(Predictor(read), motion(9)), walk(Predictor(model), motion(9)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gate_weights": np.zeros((12, 14), np.float32)}, r"gate_weights: shape \(12, 14\): want \(12, 15\)"),
        ({"output_bias": np.full(8, np.nan, np.float32)}, "output_bias: .* all finite"),
        ({"input_scale": np.zeros(12, np.float32)}, "input_scale, .*: want all above 0"),
    ],
)
def test_a_model_that_does_not_fit_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        small_model(**changes)


def rewritten(folder, **changes):
    path = folder / "model.npz"
    small_model().save(path)
    with np.load(path) as archive:
        arrays = dict(archive) | changes
    np.savez(path, **{name: values for name, values in arrays.items() if values is not None})
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 2}, "format 2, but this version reads 1: train it anew"),
        ({"dense_bias": None}, "no array .*dense_bias.*: want a model"),
        ({"gate_bias": np.zeros(8)}, "gate_weights: shape .*: want"),
        ({"provenance": "{"}, ".*want a model made by"),
    ],
)
def test_a_file_that_is_no_model_is_refused_by_its_name(tmp_path, changes, message):
    with pytest.raises(ModelError, match=rf"model\.npz: {message}"):
        read_model(rewritten(tmp_path, **changes))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut off", b"text"])
def test_a_file_of_another_kind_is_refused(tmp_path, content):
    path = tmp_path / "model.npz"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"model\.npz: .*want a model"):
        read_model(path)
    with pytest.raises(ModelError, match=r"gone\.npz.*want a model"):
        read_model(tmp_path / "gone.npz")


def test_statistic_is_that_of_the_paper():
    d = np.array([0.3, -0.1, 0.2, 0.5])
    one, other = np.diag([0.01, 0.02, 0.03, 0.04]), np.diag([0.02, 0.02, 0.02, 0.06])
    assert lstm_statistic(d, one, other) == pytest.approx(0.09 / 0.03 + 0.01 / 0.04 + 0.04 / 0.05 + 0.25 / 0.1)


def test_statistic_of_correlated_innovations_does_not_depend_on_the_axes():
    rng = np.random.default_rng(2)
    root, turn = rng.normal(size=(4, 4)), np.linalg.qr(rng.normal(size=(4, 4)))[0]
    d, v, w = rng.normal(size=4), root @ root.T, np.diag(rng.uniform(0.1, 1.0, 4))
    turned = lstm_statistic(turn @ d, turn @ v @ turn.T, turn @ w @ turn.T)
    assert turned == pytest.approx(lstm_statistic(d, v, w))
    assert turned >= 0.0

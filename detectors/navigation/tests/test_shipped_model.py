"""The model that comes along, trained on AUV Snapir: see models/README.md."""

import tomllib
from fnmatch import fnmatch
from pathlib import Path

import numpy as np

from detectors.navigation.lstm import SHIPPED, Predictor, read_model

PYPROJECT = Path(__file__).parents[3] / "pyproject.toml"


def test_tells_how_it_was_made():
    about = read_model().provenance
    assert about["recordings"] == [f"trajectory_{number:02}" for number in range(1, 12)]
    assert set(about["sha256"]) == {f"{name}.npz" for name in about["recordings"]}
    assert about["samples"] > 11 * 390
    assert about["seed"] == 0
    assert about["hyperparameters"].keys() == {"learning_rate", "hidden", "epochs"}
    assert about["hyperparameters"]["hidden"] == read_model().hidden
    assert about["validated_with"] == about["recordings"]
    assert about["figures"].keys() == {"fitness", "predicted", "zero", "mean"}
    assert all(about[name] for name in ("made", "torch", "numpy"))


def test_its_readme_tells_the_same():
    about, text = read_model().provenance, (SHIPPED.parent / "README.md").read_text(encoding="utf-8")
    for part in (
        about["made"][:10],
        about["torch"].partition("+")[0],
        f"{about['hyperparameters']['hidden']} hidden",
    ):
        assert part in text


def test_goes_along_into_the_wheel():
    with PYPROJECT.open("rb") as file:
        patterns = tomllib.load(file)["tool"]["setuptools"]["package-data"]["detectors.navigation"]
    inside = SHIPPED.relative_to(SHIPPED.parents[1]).as_posix()
    assert any(fnmatch(inside, pattern) for pattern in patterns)


def test_predicts_little_and_the_same_for_hours_of_driving_straight_on():
    predictor, model = Predictor.load(), read_model()
    cruising = np.array([1.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -9.79, 0.0, 0.0, 1.0])
    said = [predictor.step(cruising) for _ in range(4000)]
    innovations, variances = (np.array(column) for column in zip(*said[400:], strict=True))
    np.testing.assert_allclose(innovations, innovations[0] * np.ones((len(innovations), 1)), atol=2e-3)
    assert (np.abs(innovations) < 2.0 * model.output_scale[:4]).all()
    assert ((variances > 1e-6) & (variances < 1.0)).all()

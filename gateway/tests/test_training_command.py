"""`gateway train navigation`, from recordings to a model that the detector reads."""

import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from detectors.navigation.lstm import INPUTS, Predictor
from gateway.cli import main
from gateway.navigation_data import NavigationData, read_navigation_data
from gateway.training.innovations import innovations

SNAPIR = Path(__file__).parents[3] / "shared/data/snapir"
GRAVITY_MPS2 = 9.80
QUICK = ("--hidden", "4", "--learning-rate", "0.01", "--epochs", "3")


def at_rest(seed, seconds=40.0, reference=True):
    """A vehicle that hovers at 7 m, heading east, pitched up by 0.1 rad, as sensors with some noise see it."""
    rng = np.random.default_rng(seed)
    imu_s, dvl_s = np.arange(0.0, seconds, 0.05), np.arange(0.0, seconds, 1.0)
    force = np.array([GRAVITY_MPS2 * np.sin(0.1), 0.0, -GRAVITY_MPS2 * np.cos(0.1)])
    sensed = np.column_stack((np.tile(force, (len(imu_s), 1)), np.zeros((len(imu_s), 3))))
    imu = np.column_stack((imu_s, sensed + 1e-3 * rng.normal(size=sensed.shape)))
    dvl = np.column_stack((dvl_s, 0.01 * rng.normal(size=(len(dvl_s), 3))))
    depth = np.column_stack((dvl_s + 0.25, 7.0 + 0.02 * rng.normal(size=len(dvl_s))))
    began = np.array([[0.0, 0.57, 0.61, -7.0, 0.0, 0.0, 0.0, 0.0, 0.1, np.pi / 2]])
    return NavigationData(f"dive {seed}", imu, dvl, depth, began if reference else None)


@pytest.fixture
def recordings(tmp_path):
    paths = []
    for seed in range(2):
        dive = at_rest(seed)
        paths.append(tmp_path / f"dive_{seed}.npz")
        np.savez(paths[-1], imu=dive.imu, dvl=dive.dvl, depth=dive.depth, reference=dive.reference)
    return [str(path) for path in paths]


@pytest.mark.parametrize("reference", [True, False], ids=["from its reference", "aligned by itself"])
def test_innovations_of_a_healthy_dive(reference):
    record = innovations(at_rest(3, reference=reference))
    assert len(record.time_s) > 20
    assert (np.diff(record.time_s) > 0).all()
    later = record.time_s > 20.0
    assert np.abs(record.innovation[later]).max() < 0.3
    assert (record.innovation[later] ** 2 / record.variance[later]).mean() < 2.0
    means = record.features[later].mean(axis=0)
    np.testing.assert_allclose(means[:6], 0.0, atol=0.02)
    np.testing.assert_allclose(means[6:], [0.98, 0.0, -9.75, -0.0998, 0.0, 0.995], atol=0.06)


def test_innovations_of_a_recorded_dive_are_as_large_as_the_filter_says():
    path = SNAPIR / "trajectory_03.npz"
    if not path.exists():
        pytest.skip(f"no recording at {path}: shared/data must lie beside the project's root")
    record = innovations(read_navigation_data(path))
    assert len(record.time_s) > 390
    assert ((record.innovation**2 / record.variance).mean(axis=0) < 2.0).all()
    assert np.abs(record.features[:, 9:] - (0.0, 0.0, 1.0)).max() < 0.5


def test_a_dive_that_is_too_short_is_named():
    with pytest.raises(ValueError, match=r"dive 0: no reference, and cannot be aligned .*levelling.*: want a longer"):
        innovations(at_rest(0, seconds=4.0, reference=False))


def trained(*arguments, command="navigation"):
    pytest.importorskip("torch", reason='training needs PyTorch: pip install ".[train]"', exc_type=ImportError)
    return called(*arguments, command=command)


def called(*arguments, command="navigation"):
    result = CliRunner().invoke(main, ["train", command, *map(str, arguments)])
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.output


def test_makes_a_model_that_the_detector_reads(tmp_path, recordings):
    path = tmp_path / "model.npz"
    code, text = trained(*recordings, "--out", path, *QUICK)
    assert code == 0, text
    assert "predictor" in text and "none (zero)" in text
    predictor = Predictor.load(path)
    assert predictor.model.hidden == 4
    assert predictor.model.interval_s == 1.0
    assert predictor.model.provenance["recordings"] == ["dive_0", "dive_1"]
    assert set(predictor.model.provenance["sha256"]) == {"dive_0.npz", "dive_1.npz"}
    innovation, variance = predictor.step(np.zeros(INPUTS))
    assert np.isfinite(innovation).all() and (variance > 0).all()
    assert [one.name for one in tmp_path.glob("model.npz*")] == ["model.npz"]


def test_stopped_by_ctrl_c_the_same_command_goes_on(tmp_path, recordings, monkeypatch):
    def train(name):
        return trained(*recordings, "--out", tmp_path / name, *QUICK)

    train("whole.npz")
    from gateway.training.network import Training

    run_epoch, epochs = Training.run_epoch, []

    def interrupted(training):
        epochs.append(training.epochs_done)
        if len(epochs) == 5:
            raise KeyboardInterrupt
        run_epoch(training)

    monkeypatch.setattr(Training, "run_epoch", interrupted)
    code, text = train("model.npz")
    assert code == 1
    assert "stopped; the same command goes on from" in text
    assert train("model.npz")[0] == 0
    assert epochs == [0, 1, 2, 0, 1, 1, 2]
    whole, resumed = (Predictor.load(tmp_path / name).model for name in ("whole.npz", "model.npz"))
    np.testing.assert_array_equal(whole.gate_weights, resumed.gate_weights)
    np.testing.assert_array_equal(whole.output_bias, resumed.output_bias)


def test_leaves_one_out_with_the_hyperparameters_of_a_model(tmp_path, recordings):
    path, folder = tmp_path / "model.npz", tmp_path / "folds"
    trained(*recordings, "--out", path, *QUICK)
    code, text = trained(path, *recordings, "--out", folder, command="leave-one-out")
    assert code == 0, text
    assert [line.split()[1] for line in text.splitlines() if " / " in line and "│" in line] == [
        "dive_0",
        "dive_1",
        "all",
    ]
    models = {one.stem: Predictor.load(one).model for one in folder.glob("*.npz")}
    assert models.keys() == {"dive_0", "dive_1"}
    assert models["dive_0"].provenance["recordings"] == ["dive_1"]
    assert models["dive_0"].hidden == 4


def test_what_was_begun_with_other_settings_is_not_gone_on_with(tmp_path, recordings):
    path = tmp_path / "model.npz"
    path.with_name("model.npz.part").write_bytes(b"of old")
    code, text = trained(*recordings, "--out", path, *QUICK)
    assert code == 1
    assert "model.npz.part is not a checkpoint; with --anew it is not looked at" in text.replace("\n", "")
    assert trained(*recordings, "--out", path, *QUICK, "--anew")[0] == 0


def test_one_of_three_hyperparameters_is_too_few(tmp_path, recordings):
    code, text = called(*recordings, "--out", tmp_path / "model.npz", "--hidden", "4")
    assert code == 2
    assert "want all three, or none" in text


def test_a_recording_that_is_none_is_named(tmp_path, recordings):
    wrong = tmp_path / "wrong.npz"
    np.savez(wrong, imu=np.zeros((3, 7)))
    code, text = trained(*recordings, wrong, "--out", tmp_path / "model.npz", *QUICK)
    assert code == 1
    assert "wrong.npz: dvl: missing" in text


def test_a_folder_that_is_not_there_is_said_before_the_work_is_done(tmp_path, recordings):
    code, text = trained(*recordings, "--out", tmp_path / "gone" / "model.npz", *QUICK)
    assert code == 1
    assert "there is no folder" in text


class NoTorch:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError("No module named 'torch'", name="torch")


def test_without_pytorch_it_says_what_to_install(tmp_path, recordings, monkeypatch):
    for name in [one for one in sys.modules if one == "torch" or one.startswith("gateway.training.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [NoTorch(), *sys.meta_path])
    code, text = called(*recordings, "--out", tmp_path / "model.npz")
    assert code == 1
    assert text.strip() == 'Error: training needs PyTorch: pip install ".[train]"'

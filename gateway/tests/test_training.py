"""Training of the navigation watch's predictor, where PyTorch is installed."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from detectors.navigation.lstm import INPUTS, Predictor
from gateway.tests.dives import dives, record
from gateway.training.records import splits
from gateway.training.settings import Hyperparameters, Search, TrainingSettings

torch = pytest.importorskip("torch", reason='training needs PyTorch: pip install ".[train]"', exc_type=ImportError)

from gateway.training.checkpoint import Checkpoint, CheckpointError, fingerprint  # noqa: E402
from gateway.training.evaluation import evaluate, pooled  # noqa: E402
from gateway.training.fit import Fitting, Training  # noqa: E402
from gateway.training.leave_one_out import folds, settings_of  # noqa: E402
from gateway.training.network import Batch, Network, Scaling  # noqa: E402

QUICK = Hyperparameters(learning_rate=0.02, hidden=6, epochs=4)


def fitting(records, settings, path=None, *, resume=True, observer=lambda stage: None):
    return Fitting(records, settings, Checkpoint(path, fingerprint(records, settings), resume=resume), observer)


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("gate_weights", "gate_bias", "dense_weights", "dense_bias", "output_weights", "output_bias")
    )


def test_numpy_says_what_torch_says():
    network = Network(17, seed=3)
    model = fitting(dives(), TrainingSettings(hyperparameters=QUICK, splits=0)).run()
    model = replace(model, **network.arrays())
    rows = 2.0 * np.random.default_rng(5).normal(size=(50, INPUTS))
    inputs = np.clip((rows - model.input_mean) / model.input_scale, -5.0, 5.0)
    with torch.no_grad():
        outputs, _ = network(torch.tensor(inputs[np.newaxis], dtype=torch.float32))
    outputs = outputs[0].numpy() * model.output_scale + model.output_mean
    predictor = Predictor(model)
    said = np.array([np.concatenate(predictor.step(row)) for row in rows])
    np.testing.assert_allclose(said[:, :4], outputs[:, :4], atol=2e-6)
    np.testing.assert_allclose(said[:, 4:], np.exp(outputs[:, 4:]), rtol=1e-5)


def test_learns_what_can_be_known_of_a_dive_it_has_not_seen():
    known = [record(f"dive {seed}", count=300, seed=seed) for seed in range(10)]
    settings = TrainingSettings(hyperparameters=Hyperparameters(learning_rate=0.01, hidden=24, epochs=40))
    model = fitting(known, settings).run()
    figures = model.provenance["figures"]
    assert model.provenance["validated_with"] == sorted(one.name for one in known)
    assert min(figures["zero"]) > 0.12
    assert max(figures["predicted"]) < 0.5 * min(figures["zero"])
    unseen = evaluate(model, [record("another", count=300, seed=77)])
    assert max(unseen.predicted) < 0.5 * min(unseen.mean)


def test_figures_are_those_of_the_recordings_left_out_each_split_by_its_own_model():
    records, settings = dives(7), TrainingSettings(hyperparameters=QUICK, splits=2, seed=3)
    said = fitting(records, settings).run().provenance
    parts = []
    for training, validation in splits(records, seed=3, count=2):
        alone = fitting(training, replace(settings, splits=0)).run()
        parts.append(evaluate(alone, validation))
    assert said["figures"] == asdict(pooled(parts))
    np.testing.assert_allclose(
        said["figures"]["zero"], np.sqrt(np.mean([np.square(part.zero) for part in parts], axis=0))
    )


def test_zero_and_mean_are_measured_as_they_are_meant():
    model = fitting(dives(), TrainingSettings(hyperparameters=QUICK, splits=0)).run()
    dive = record("another", count=30, seed=9)
    figures = evaluate(model, [dive])
    np.testing.assert_allclose(figures.zero, np.sqrt((dive.innovation**2).mean(axis=0)))
    off = dive.innovation - model.output_mean[:4]
    np.testing.assert_allclose(figures.mean, np.sqrt((off**2).mean(axis=0)), rtol=1e-6)


def test_same_seed_same_model_and_another_seed_another():
    def trained(seed):
        return fitting(dives(), TrainingSettings(hyperparameters=QUICK, seed=seed, splits=0)).run()

    assert same(trained(1), trained(1))
    assert not same(trained(1), trained(2))


def test_training_leaves_the_random_numbers_of_others_alone():
    torch.manual_seed(8)
    expected = torch.rand(3)
    torch.manual_seed(8)
    fitting(dives(), TrainingSettings(hyperparameters=QUICK)).run()
    assert torch.equal(torch.rand(3), expected)


class Stop(Exception):
    pass


def stopping_after(epochs):
    left = iter(range(epochs - 1))

    def observe(_):
        if next(left, None) is None:
            raise Stop

    return observe


SEARCHING = TrainingSettings(hyperparameters=None, search=Search(particles=2, iterations=1), seed=4, splits=2)


@pytest.fixture
def short_search(monkeypatch):
    from detectors.thruster.swarm import Dimension
    from gateway.training import fit

    small = (Dimension(-3.0, -1.5), Dimension(2, 8, integer=True), Dimension(2, 6, integer=True))
    monkeypatch.setattr(fit, "DIMENSIONS", small)


@pytest.mark.parametrize("every", [1, 3, 7])
def test_stopped_again_and_again_it_comes_to_the_same_model(tmp_path, short_search, every):
    whole = fitting(dives(), SEARCHING).run()
    path = tmp_path / "model.part"
    for stops in range(100):  # noqa: B007
        try:
            resumed = fitting(dives(), SEARCHING, path, observer=stopping_after(every)).run()
            break
        except Stop:
            assert path.exists()
    assert stops > 1
    assert same(resumed, whole)
    assert resumed.provenance == whole.provenance


def test_a_training_that_is_over_is_not_done_again(tmp_path, short_search):
    path, epochs = tmp_path / "model.part", []
    fitting(dives(), SEARCHING, path).run()
    fitting(dives(), SEARCHING, path, observer=epochs.append).run()
    assert epochs == []


def test_begun_anew_it_looks_at_no_checkpoint(tmp_path):
    settings, path, epochs = TrainingSettings(hyperparameters=QUICK), tmp_path / "model.part", []
    fitting(dives(), settings, path).run()
    fitting(dives(), settings, path, resume=False, observer=epochs.append).run()
    assert len(epochs) == settings.trainings * QUICK.epochs == 6 * QUICK.epochs


def test_a_checkpoint_of_another_training_is_refused(tmp_path):
    settings, path = TrainingSettings(hyperparameters=QUICK), tmp_path / "model.part"
    fitting(dives(), settings, path).run()
    for others in (fitting, dives()[1:], settings), (fitting, dives(), replace(settings, seed=1)):
        make, *arguments = others
        with pytest.raises(CheckpointError, match=r"model\.part belongs to a training with other recordings"):
            make(*arguments, path)


def test_a_file_that_is_no_checkpoint_is_refused(tmp_path):
    path = tmp_path / "model.part"
    fitting(dives(), TrainingSettings(hyperparameters=QUICK), path).run()
    whole = path.read_bytes()
    for content in (b"", b"text", whole[:100], whole[:-100]):
        path.write_bytes(content)
        with pytest.raises(CheckpointError, match=r"model\.part is not a checkpoint"):
            Checkpoint(path, "", resume=True)
    torch.save({"weights": torch.zeros(3)}, path)
    with pytest.raises(CheckpointError, match=r"model\.part is not a checkpoint, or damaged: 'fingerprint'"):
        Checkpoint(path, "", resume=True)


def test_the_search_finds_the_hyperparameters_of_least_error(short_search):
    errors = {}
    made = fitting(dives(), SEARCHING, observer=lambda stage: errors.setdefault(stage.hyperparameters, None)).run()
    for hyperparameters in errors:
        single = fitting(dives(), replace(SEARCHING, hyperparameters=hyperparameters)).run()
        errors[hyperparameters] = single.provenance["figures"]["fitness"]
    best = min(errors, key=errors.get)
    assert len(errors) > 1
    assert made.provenance["hyperparameters"] == asdict(best)
    assert made.provenance["figures"]["fitness"] == errors[best]


def test_learning_rate_is_halved_after_each_fifth_of_the_epochs():
    batch = Batch.of(dives(1), Scaling(np.zeros(12), np.ones(12)), Scaling(np.zeros(8), np.ones(8)))
    training = Training(batch, Hyperparameters(learning_rate=0.016, hidden=2, epochs=10), seed=0)
    rates = []
    while not training.done:
        rates.append(training._optimizer.param_groups[0]["lr"])
        training.run_epoch()
    np.testing.assert_allclose(rates, [0.016, 0.016, 0.008, 0.008, 0.004, 0.004, 0.002, 0.002, 0.001, 0.001])


def test_a_short_dive_beside_a_long_one_counts_only_as_long_as_it_is():
    short, long = record("short", count=20, seed=1), record("long", count=120, seed=2)
    scales = Scaling(np.zeros(12), np.ones(12)), Scaling(np.zeros(8), np.ones(8))
    filled = Batch.of([short, long], *scales)
    assert filled.counts.sum() == 140
    network = Network(5, seed=0)
    with torch.no_grad():
        outputs, _ = network(filled.inputs)
        alone, _ = network(Batch.of([short], *scales).inputs)
    torch.testing.assert_close(outputs[:1, :20], alone)


def test_each_fold_is_trained_on_all_recordings_but_the_one_that_it_is_measured_on():
    records = dives(4)
    model = fitting(records, TrainingSettings(hyperparameters=QUICK, seed=6)).run()
    made = list(folds(records, settings_of(model)))
    assert [fold.left_out for fold in made] == [one.name for one in records]
    for fold, left_out in zip(made, records, strict=True):
        others = [other for other in records if other.name != fold.left_out]
        alone = fitting(others, TrainingSettings(hyperparameters=QUICK, seed=6, splits=0)).run()
        assert same(fold.model, alone)
        assert fold.figures == evaluate(alone, [left_out])
        assert left_out.name not in fold.model.provenance["recordings"]


def test_folds_want_recordings_that_can_be_told_apart():
    settings = TrainingSettings(hyperparameters=QUICK)
    with pytest.raises(ValueError, match="recordings dive 0: want two or more"):
        list(folds(dives(1), settings))
    with pytest.raises(ValueError, match="each with a name of its own"):
        list(folds([record("dive"), record("dive")], settings))


def test_a_model_that_does_not_tell_its_hyperparameters_gives_no_settings():
    model = fitting(dives(), TrainingSettings(hyperparameters=QUICK, splits=0)).run()
    with pytest.raises(ValueError, match="does not say what it was made with"):
        settings_of(replace(model, provenance={}))

"""Learnt predictor of the filter's innovations (paper 003, section 4): a long short-term memory, by numpy alone.

The network is LSTM, then a dense layer with LeakyReLU, then a linear one. (The paper has a LeakyReLU as its last;
that flattens the negative half of what an innovation can be.) One step for each sample of the DVL:

    inputs   12: velocity over ground, mean angular rate and mean specific force since the last step, and the
             direction of down, all along the axes of the body
    outputs   8: innovation of the fault-free filter (DVL forward, right, down in m/s; depth in m) and its variance

The direction of down is the attitude without the heading: where the bow points has nothing to do with what a DVL errs
by, and 1.2 hours of dives have so few headings that a network would know the dive by them. It has no wrap, either.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

Array = NDArray[np.float32]
FloatArray = NDArray[np.float64]

FORMAT = 1  # of the file; to be raised when the meaning of the inputs or of the arrays changes
INPUTS = 12
OUTPUTS = 4
LEAK = 0.01  # LeakyReLU's slope below zero
# An input farther than this from its mean in training, in standard deviations, tells the network nothing more.
FARTHEST = 5.0
SHIPPED = Path(__file__).with_name("models") / "snapir.npz"


class ModelError(ValueError):
    """A model that cannot be used: the file, what is wrong with it, and what would be right."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Model:
    """A trained network with H hidden units, and what its inputs and outputs are scaled by.

    Attributes:
        gate_weights: (4 H, 12 + H) of input, forget, cell and output gate, for the inputs and the last hidden values.
        gate_bias: (4 H,)
        dense_weights, dense_bias: (H, H) and (H,)
        output_weights, output_bias: (8, H) and (8,)
        input_mean, input_scale: (12,) mean and standard deviation in training.
        output_mean, output_scale: (8,) of the innovations and the logarithms of their variances.
        interval_s: between two steps in training.
        provenance: how it was made, as in the file.

    Raises:
        ValueError: shapes that do not fit together, values that are not finite, a scale or an interval not above 0.
    """

    gate_weights: Array
    gate_bias: Array
    dense_weights: Array
    dense_bias: Array
    output_weights: Array
    output_bias: Array
    input_mean: Array
    input_scale: Array
    output_mean: Array
    output_scale: Array
    interval_s: float
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        hidden = self.hidden
        for name, shape in _shapes(hidden).items():
            values = getattr(self, name)
            if values.shape != shape or not np.isfinite(values).all():
                raise ValueError(
                    f"{name}: shape {values.shape}: want {shape}, all finite, with {hidden} hidden units"
                )
        if not (self.interval_s > 0 and (self.input_scale > 0).all() and (self.output_scale > 0).all()):
            raise ValueError("interval_s, input_scale, output_scale: want all above 0")

    @property
    def hidden(self) -> int:
        """Number of hidden units."""
        return len(self.gate_bias) // 4

    def save(self, path: Path) -> None:
        """Writes the file that `read_model` reads.

        Raises:
            OSError: it cannot be written.
        """
        arrays = {name: getattr(self, name) for name in _shapes(self.hidden)}
        about = json.dumps(dict(self.provenance))
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays, interval_s=self.interval_s, provenance=about, format=FORMAT)


def _shapes(hidden: int) -> dict[str, tuple[int, ...]]:
    gates, outputs = 4 * hidden, 2 * OUTPUTS
    return {
        "gate_weights": (gates, INPUTS + hidden),
        "gate_bias": (gates,),
        "dense_weights": (hidden, hidden),
        "dense_bias": (hidden,),
        "output_weights": (outputs, hidden),
        "output_bias": (outputs,),
        "input_mean": (INPUTS,),
        "input_scale": (INPUTS,),
        "output_mean": (outputs,),
        "output_scale": (outputs,),
    }


def read_model(path: Path = SHIPPED) -> Model:
    """A model from its file; without one, that which was trained on AUV Snapir.

    Raises:
        ModelError: no such file, not a model, or one of another version of this program.
    """
    try:
        with path.open("rb") as file, np.load(file) as archive:
            return _model(archive)
    except KeyError as error:
        raise ModelError(f"{path}: no array {error}: want a model made by `gateway train navigation`") from error
    except (OSError, ValueError, TypeError, EOFError, BadZipFile) as error:
        raise ModelError(f"{path}: {error}; want a model made by `gateway train navigation`") from error


def _model(archive: Mapping[str, NDArray[Any]]) -> Model:
    version = int(archive["format"])
    if version != FORMAT:
        raise ValueError(f"format {version}, but this version reads {FORMAT}: train it anew")
    arrays = {name: archive[name].astype(np.float32) for name in _ARRAYS}
    provenance = json.loads(str(archive["provenance"]))
    return Model(**arrays, interval_s=float(archive["interval_s"]), provenance=provenance)


_ARRAYS = tuple(one.name for one in fields(Model) if one.name not in {"interval_s", "provenance"})


class Predictor:
    """A model that steps along with the samples of the DVL. Picklable, bit for bit.

    Args:
        model: see `read_model`.
    """

    __slots__ = ("_cell", "_hidden", "model")

    def __init__(self, model: Model) -> None:
        self.model = model
        self.reset()

    @classmethod
    def load(cls, path: Path = SHIPPED) -> Predictor:
        """See `read_model`."""
        return cls(read_model(path))

    def reset(self) -> None:
        """Forgets all it has seen, for a dive that begins."""
        self._hidden = np.zeros(self.model.hidden, dtype=np.float32)
        self._cell = np.zeros(self.model.hidden, dtype=np.float32)

    def step(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What the next innovation should be.

        Args:
            features: (12,) finite, see the head of this module.

        Returns:
            (4,) innovation, DVL in m/s and depth in m, and (4,) its variance.
        """
        model = self.model
        x = np.clip((features.astype(np.float32) - model.input_mean) / model.input_scale, -FARTHEST, FARTHEST)
        gates = model.gate_weights @ np.concatenate((x, self._hidden)) + model.gate_bias
        let_in, keep, candidate, let_out = gates.reshape(4, -1)
        self._cell = expit(keep) * self._cell + expit(let_in) * np.tanh(candidate)
        self._hidden = expit(let_out) * np.tanh(self._cell)
        dense = model.dense_weights @ self._hidden + model.dense_bias
        dense = np.maximum(dense, LEAK * dense)
        scaled = model.output_weights @ dense + model.output_bias
        outputs = (scaled * model.output_scale + model.output_mean).astype(np.float64)
        return outputs[:OUTPUTS], np.exp(outputs[OUTPUTS:])


def lstm_statistic(difference: FloatArray, covariance: FloatArray, predicted_covariance: FloatArray) -> float:
    """d' (V + V_lstm)^-1 d, the fault detection function of paper 003, section 4 (its equations 20 to 27).

    Args:
        difference: (n,) innovation less the predicted one, d.
        covariance: (n, n) of the filter's innovation, V.
        predicted_covariance: (n, n) V_lstm.
    """
    return float(difference @ np.linalg.solve(covariance + predicted_covariance, difference))

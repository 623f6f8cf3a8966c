"""The network of `detectors.navigation.lstm` in PyTorch, and one training of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from detectors.navigation.lstm import FARTHEST, INPUTS, LEAK, OUTPUTS
from gateway.training.records import InnovationRecord
from gateway.training.settings import Hyperparameters

FloatArray = NDArray[np.float64]

# Samples from one step of the weights to the next; what the network remembers is carried over, its gradient is not.
WINDOW = 50
DECAY = 0.5  # of the learning rate (paper 003, section 5.2; when it decays is not said there)
DECAYS = 5  # in one training
GRADIENT_MAX = 1.0  # longer ones are cut to it: a transient must not throw the weights off
LEAST_SCALE = 1e-3  # of what hardly varies in the training data


@dataclass(frozen=True, slots=True, eq=False)
class Scaling:
    """Mean and standard deviation of each column, of the training data alone.

    Attributes:
        mean, scale: (D,)
    """

    mean: FloatArray
    scale: FloatArray

    @classmethod
    def of(cls, rows: FloatArray) -> Scaling:
        """That of (N, D) values."""
        return cls(rows.mean(axis=0), np.maximum(rows.std(axis=0), LEAST_SCALE))

    def __call__(self, rows: FloatArray) -> FloatArray:
        return (rows - self.mean) / self.scale


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Dives side by side, scaled, the short ones filled up with zeros.

    Attributes:
        inputs: (B, T, 12) tensor.
        targets: (B, T, 8) tensor.
        counts: (B, T, 1) tensor, 1.0 where there is a sample, else 0.0.
    """

    inputs: torch.Tensor
    targets: torch.Tensor
    counts: torch.Tensor

    @classmethod
    def of(cls, records: Sequence[InnovationRecord], inputs: Scaling, targets: Scaling) -> Batch:
        """The records, scaled."""
        seen = [np.clip(inputs(record.features), -FARTHEST, FARTHEST) for record in records]
        wanted = [targets(record.targets) for record in records]
        return cls(_stacked(seen), _stacked(wanted), _stacked([np.ones((len(one), 1)) for one in seen]))


def _stacked(rows: Sequence[FloatArray]) -> torch.Tensor:
    return nn.utils.rnn.pad_sequence([torch.tensor(one, dtype=torch.float32) for one in rows], batch_first=True)


class Network:
    """LSTM, dense layer with LeakyReLU, linear layer; see `detectors.navigation.lstm`.

    Args:
        hidden: units of the first two.
        seed: of the first weights.
    """

    def __init__(self, hidden: int, seed: int) -> None:
        with torch.random.fork_rng(devices=()):
            torch.manual_seed(seed)
            self._lstm = nn.LSTM(INPUTS, hidden, batch_first=True)
            self._dense = nn.Linear(hidden, hidden)
            self._output = nn.Linear(hidden, 2 * OUTPUTS)
        self.parts = nn.ModuleList((self._lstm, self._dense, self._output))

    def __call__(self, inputs: torch.Tensor, memory: Any = None) -> tuple[torch.Tensor, Any]:
        """(B, T, 8) outputs for (B, T, 12) inputs, and what is remembered after them."""
        hidden, memory = self._lstm(inputs, memory)
        dense = nn.functional.leaky_relu(self._dense(hidden), LEAK)
        return self._output(dense), memory

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """The weights as `detectors.navigation.lstm.Model` has them."""
        lstm = self._lstm
        gates = torch.cat((lstm.weight_ih_l0, lstm.weight_hh_l0), dim=1)
        return {
            "gate_weights": _array(gates),
            "gate_bias": _array(lstm.bias_ih_l0 + lstm.bias_hh_l0),
            "dense_weights": _array(self._dense.weight),
            "dense_bias": _array(self._dense.bias),
            "output_weights": _array(self._output.weight),
            "output_bias": _array(self._output.bias),
        }


def _array(tensor: torch.Tensor) -> NDArray[np.float32]:
    return np.array(tensor.detach().numpy(), dtype=np.float32)


class Training:
    """One training, epoch by epoch. The same seed and data give the same network, bit for bit, on one machine.

    Args:
        batch: what is trained on.
        hyperparameters: of this training.
        seed: of the first weights.
    """

    def __init__(self, batch: Batch, hyperparameters: Hyperparameters, seed: int) -> None:
        self.hyperparameters = hyperparameters
        self.network = Network(hyperparameters.hidden, seed)
        self.epochs_done = 0
        self._batch = batch
        self._optimizer = torch.optim.Adam(self.network.parts.parameters(), lr=hyperparameters.learning_rate)
        period = -(-hyperparameters.epochs // DECAYS)
        self._schedule = torch.optim.lr_scheduler.StepLR(self._optimizer, period, DECAY)

    @property
    def done(self) -> bool:
        """All its epochs are over."""
        return self.epochs_done >= self.hyperparameters.epochs

    def run_epoch(self) -> None:
        """Goes through all the training data once."""
        memory = None
        for start in range(0, self._batch.inputs.shape[1], WINDOW):
            rows = slice(start, start + WINDOW)
            memory = self._step(rows, memory)
        self._schedule.step()
        self.epochs_done += 1

    def _step(self, rows: slice, memory: Any) -> Any:
        outputs, memory = self.network(self._batch.inputs[:, rows], memory)
        loss = mean_square(outputs, self._batch.targets[:, rows], self._batch.counts[:, rows])
        self._optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parts.parameters(), GRADIENT_MAX)
        self._optimizer.step()
        return tuple(one.detach() for one in memory)

    def state(self) -> dict[str, Any]:
        """All that a later `restore` needs to go on, of tensors and plain values."""
        return {
            "epochs_done": self.epochs_done,
            "network": self.network.parts.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "schedule": self._schedule.state_dict(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from the state of an earlier training with the same arguments."""
        self.network.parts.load_state_dict(state["network"])
        self._optimizer.load_state_dict(state["optimizer"])
        self._schedule.load_state_dict(state["schedule"])
        self.epochs_done = int(state["epochs_done"])


def mean_square(outputs: torch.Tensor, targets: torch.Tensor, counts: torch.Tensor) -> torch.Tensor:
    """Mean over all outputs of the samples that there are."""
    squares = (outputs - targets).square() * counts
    return squares.sum() / (counts.sum().clamp(min=1.0) * outputs.shape[-1])
